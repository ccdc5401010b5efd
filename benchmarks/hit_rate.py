"""How often the ball ends in the cup: planners, over cups along the reference model's reach, with cups of two kinds.

python benchmarks/hit_rate.py [--cups 40]
"""

from __future__ import annotations

import argparse
from collections import Counter

import numpy as np
from rich.console import Console
from rich.progress import track
from rich.table import Table

from wam_cast.evaluation.experiment.statistics import wilson_interval
from wam_cast.learning.forward_model import reference_model
from wam_cast.planning.plan import METHODS, plan_cast
from wam_cast.scenario import Cup, Scenario
from wam_cast.system.outcome import Status
from wam_cast.system.simulation import CastSimulator


def main() -> None:
    arguments = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    arguments.add_argument("--cups", type=int, default=40)
    options = arguments.parse_args()
    model = reference_model()
    nearest, farthest = model.reach
    table = Table(title=f"{options.cups} cups evenly from {nearest:.3f} to {farthest:.3f} m")
    for heading in ("planner", "cup", "caught", "95 % interval", "miss: median, P95, max [mm]", "not caught"):
        table.add_column(heading)
    for method in METHODS:
        plans = [
            plan_cast(model, (radius, 0.0), method) for radius in np.linspace(nearest, farthest, options.cups)
        ]
        for name, restitution in (("nearly inelastic", 0.25), ("lively", 0.6)):
            simulator = CastSimulator(Scenario(cup=Cup(restitution=restitution)))
            outcomes = [
                simulator.simulate(plan.cast, plan.cup)
                for plan in track(plans, f"{method}, {name}", console=Console(stderr=True), transient=True)
            ]
            statuses = Counter(outcome.status for outcome in outcomes)
            caught = statuses.pop(Status.CAUGHT, 0)
            low, high = wilson_interval(caught, len(outcomes))
            misses = np.percentile([1e3 * outcome.miss for outcome in outcomes], [50, 95, 100])
            table.add_row(
                method,
                name,
                f"{caught} of {len(outcomes)}",
                f"{low:.0%} to {high:.0%}",
                ", ".join(f"{miss:.1f}" for miss in misses),
                ", ".join(f"{count} {status}" for status, count in statuses.items()) or "-",
            )
    Console().print(table)


if __name__ == "__main__":
    main()
