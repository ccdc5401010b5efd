"""How fast casts are simulated on one core, what a cup costs, and where the time goes.

Ratios are taken within one run; the absolute figures are of the machine that runs it.

    python benchmarks/speed.py [--casts 60] [--seed 1]
"""

from __future__ import annotations

import argparse
import os
import time

# One core: the numerical libraries' threads must not help.
os.environ.update(OMP_NUM_THREADS="1", OPENBLAS_NUM_THREADS="1")

from rich.console import Console
from rich.table import Table

from wam_cast.learning.sampling import sample_cast
from wam_cast.scenario import Cup, Scenario
from wam_cast.system.controller import CastController
from wam_cast.system.simulation import CastSimulator


class Stopwatch:
    """Sums up the time spent in a method of a class."""

    def __init__(self, owner: type, name: str) -> None:
        self.seconds = 0.0
        method = getattr(owner, name)

        def timed(*arguments: object) -> None:
            start = time.perf_counter()
            method(*arguments)
            self.seconds += time.perf_counter() - start

        setattr(owner, name, timed)


def main() -> None:
    arguments = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    arguments.add_argument("--casts", type=int, default=60)
    arguments.add_argument("--seed", type=int, default=1)
    options = arguments.parse_args()
    in_controller = Stopwatch(CastController, "_calc_actuation")
    scenario = Scenario()
    casts = [sample_cast(scenario, options.seed, row) for row in range(options.casts)]

    simulator = CastSimulator(scenario)
    simulator.simulate(casts[0])
    in_controller.seconds, start = 0.0, time.perf_counter()
    landings = [simulator.simulate(cast).landing for cast in casts]
    free = (time.perf_counter() - start) / len(casts)
    controller = in_controller.seconds / len(casts)
    derivatives = derivative_cost(simulator) * simulator.count_derivatives() * len(casts) ** 0

    table = Table(title=f"{len(casts)} random casts (seed {options.seed}), one core")
    for heading in ("cast", "ms a cast", "casts a second", "of a free cast"):
        table.add_column(heading, justify="left" if heading == "cast" else "right")
    table.add_row("free, up to the landing", f"{1e3 * free:.1f}", f"{1 / free:.1f}", "1.00")
    for name, dissipation in (("into a nearly inelastic cup", 2.0), ("into a lively cup", 0.1)):
        with_cup = CastSimulator(Scenario(cup=Cup(dissipation=dissipation)))
        with_cup.simulate(casts[0], (0.6, 0.0))
        start = time.perf_counter()
        for cast, landing in zip(casts, landings, strict=True):
            with_cup.simulate(cast, (float(landing[0]), float(landing[1])))
        seconds = (time.perf_counter() - start) / len(casts)
        table.add_row(
            f"{name}, until the ball rests",
            f"{1e3 * seconds:.1f}",
            f"{1 / seconds:.1f}",
            f"{seconds / free:.2f}",
        )
    console = Console()
    console.print(table)


if __name__ == "__main__":
    main()
