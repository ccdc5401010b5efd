"""How fast casts are simulated on one core, what a cup costs, and where the time goes.

Ratios are taken within one run; the absolute figures are of the machine that runs it.

    python benchmarks/speed.py [--casts 60] [--seed 1]
"""

from __future__ import annotations

import argparse
import math
import os
import time
from collections.abc import Callable

# One core: the numerical libraries' threads must not help. It counts only before they are loaded.
os.environ.update(OMP_NUM_THREADS="1", OPENBLAS_NUM_THREADS="1")

from pydrake.systems.analysis import Simulator

from wam_cast.cast import Cast
from wam_cast.cli.terminal import out, print_table
from wam_cast.generation.sampling import sample_cast
from wam_cast.robot.controller import CastController
from wam_cast.robot.station import CastStation
from wam_cast.scenario import Cup, Scenario
from wam_cast.simulation.contact_free import ACCURACY
from wam_cast.simulation.integration import EXPLICIT, begin_integration
from wam_cast.simulation.simulator import CastSimulator

N_REPEATS = 3


def mean_seconds(run: Callable[[int], object], n: int) -> float:
    """Return the mean processor time of `run(0)` to `run(n - 1)` [s]: of each the best of three, since others disturb."""
    run(0)
    best = [math.inf] * n
    for _ in range(N_REPEATS):
        for i in range(n):
            start = time.process_time()
            run(i)
            best[i] = min(best[i], time.process_time() - start)
    return sum(best) / n


def controller_seconds(scenario: Scenario, casts: list[Cast]) -> float:
    """Return the mean time a cast spends in the controller [s], of each the best of three."""
    original, spent = CastController._calc_actuation, 0.0

    def timed(self: CastController, *arguments: object) -> None:
        nonlocal spent
        start = time.process_time()
        original(self, *arguments)
        spent += time.process_time() - start

    CastController._calc_actuation = timed
    simulator = CastSimulator(scenario)
    best = [math.inf] * len(casts)
    for _ in range(N_REPEATS):
        for i, cast in enumerate(casts):
            spent = 0.0
            simulator.simulate(cast)
            best[i] = min(best[i], spent)
    CastController._calc_actuation = original
    return sum(best) / len(casts)


def plant_seconds(scenario: Scenario, flight_time: float) -> float:
    """Return the time that integrating the contact-free phase takes [s]: the difference that halving its steps makes."""
    cast = Cast(0.3, 0.6, 0.1)
    station = CastStation(scenario, has_scene=False)
    seconds = []
    step = scenario.simulation.max_step
    for h in (step, step / 2):
        simulator = Simulator(station.diagram)
        begin_integration(simulator, EXPLICIT, h, ACCURACY)

        def run(_: int, simulator: Simulator = simulator) -> None:
            station.set_start(simulator.get_mutable_context(), cast)
            simulator.Initialize()
            simulator.AdvanceTo(0.7)

        seconds.append(mean_seconds(run, 10))
    return (seconds[1] - seconds[0]) * flight_time / 0.7


def main() -> None:
    arguments = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    arguments.add_argument("--casts", type=int, default=60)
    arguments.add_argument("--seed", type=int, default=1)
    options = arguments.parse_args()
    scenario = Scenario()
    casts = [sample_cast(scenario, options.seed, row) for row in range(options.casts)]
    simulator = CastSimulator(scenario)
    outcomes = [simulator.simulate(cast) for cast in casts]
    cups = [(float(outcome.landing[0]), float(outcome.landing[1])) for outcome in outcomes]
    flight_time = sum(outcome.end_time for outcome in outcomes) / len(outcomes)

    free = mean_seconds(lambda i: simulator.simulate(casts[i]), len(casts))
    rows = [("free, up to the landing", f"{1e3 * free:.1f}", f"{1 / free:.1f}", "1.00")]
    for name, restitution in (("nearly inelastic", 0.25), ("lively", 0.6)):
        with_cup = CastSimulator(Scenario(cup=Cup(restitution=restitution)))
        seconds = mean_seconds(lambda i: with_cup.simulate(casts[i], cups[i]), len(casts))  # noqa: B023 - used at once
        row = f"{1e3 * seconds:.1f}", f"{1 / seconds:.1f}", f"{seconds / free:.2f}"
        rows.append((f"into a {name} cup, until the ball rests", *row))
    out.print(f"{len(casts)} random casts (seed {options.seed}), {flight_time:.2f} s each, one core")
    print_table(rows, ["cast", "ms a cast", "casts a second", "of a free cast"])

    controller = controller_seconds(scenario, casts)
    plant = plant_seconds(scenario, flight_time)
    shares = {"plant": plant, "controller": controller, "the rest": free - plant - controller}
    out.print("of a free cast: " + ", ".join(f"{name} {seconds / free:.0%}" for name, seconds in shares.items()))


if __name__ == "__main__":
    main()
