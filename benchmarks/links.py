"""How many links a string needs: how far landings are from those with the most links, and what a cast costs.

Landings are those of the batched engine in steps of an eighth of a control period or less, whose error is far smaller than the
differences. Costs are those of an ordinary simulation by Drake, measured in processor time.

    python benchmarks/links.py [--links 5 7 10 14 20 40] [--casts 50] [--timed 3] [--seed 2]
"""

from __future__ import annotations

import argparse
import time
from collections.abc import Sequence

import numpy as np

from wam_cast.batch.engine import simulate_batch
from wam_cast.cast import Cast
from wam_cast.cli.terminal import out, print_table
from wam_cast.generation.sampling import sample_cast
from wam_cast.scenario import Scenario
from wam_cast.simulation.simulator import CastSimulator
from wam_cast.types import Array


def landings(scenario: Scenario, casts: Sequence[Cast]) -> Array:
    """Return the landings' distances from the base axis [m], one a cast."""
    finer = scenario.simulation.model_copy(update={"max_step": scenario.controller.period / 8})
    frame = simulate_batch(
        scenario.model_copy(update={"simulation": finer}), np.array([cast.to_array() for cast in casts])
    )
    return frame["landing_along"].to_numpy(dtype=float)


def seconds(scenario: Scenario, casts: Sequence[Cast]) -> float:
    """Return the processor time that an ordinary simulation of `casts` takes [s]: the best of three, since others disturb."""
    simulator = CastSimulator(scenario)
    simulator.simulate(casts[0])
    spent = []
    for _ in range(3):
        start = time.process_time()
        for cast in casts:
            simulator.simulate(cast)
        spent.append(time.process_time() - start)
    return min(spent)


def main() -> None:
    arguments = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    arguments.add_argument(
        "--links", type=int, nargs="+", default=[5, 7, 10, 14, 20, 40], help="the last is the standard"
    )
    arguments.add_argument("--casts", type=int, default=50)
    arguments.add_argument("--timed", type=int, default=3, help="casts whose cost is measured")
    arguments.add_argument("--seed", type=int, default=2)
    options = arguments.parse_args()
    default = Scenario().string.n_links
    scenarios = {n: Scenario.from_dict({"string": {"n_links": n}}) for n in (*options.links, default)}
    casts = [sample_cast(Scenario(), options.seed, row) for row in range(options.casts)]
    found = {n: landings(scenarios[n], casts) for n in options.links}
    spent = {n: seconds(scenario, casts[: options.timed]) for n, scenario in scenarios.items()}

    rows = []
    for n, along in found.items():
        off = np.percentile(1e3 * np.abs(along - found[options.links[-1]]), [50, 95, 100])
        rows.append((f"{n} links", f"{spent[n] / spent[default]:.2g}", *(f"{value:.2f}" for value in off)))
    out.print(f"{len(casts)} random casts (seed {options.seed}), off {options.links[-1]} links [mm]")
    print_table(rows, ["string", "cost of a cast, to the default's", "median", "P95", "max"])


if __name__ == "__main__":
    main()
