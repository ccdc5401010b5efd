"""Whether the predictive standard deviation holds for the casts that a planner chooses, by how many casts a model learned from.

    python benchmarks/few_casts.py [--casts 40 60 ...] [--models 4] [--cups 25] [--seed 0]

Each model learns from casts drawn at random from the reference dataset, and is split and fitted as `wam-cast fit` does it. The
program plans for random cups over the model's reach; each feasible plan is executed without noise. A planner takes casts with a
small standard deviation, and so takes those first where it is too small.
"""

from __future__ import annotations

import argparse

import numpy as np
from rich.console import Console
from rich.progress import track

from wam_cast.cli.terminal import print_table
from wam_cast.experiments.statistics import describe, wilson_interval
from wam_cast.experiments.trials import Thrower, draw_cups, plan_and_execute
from wam_cast.learning.dataset import CastDataset
from wam_cast.learning.forward_model import ForwardModel
from wam_cast.learning.reference import reference_dataset
from wam_cast.parallel.seeds import Purpose, derived_seed
from wam_cast.parallel.workers import Workers
from wam_cast.planning.reach import Reach

N_CASTS = (40, 60, 100, 170, 250, 500, 1000)

HEADINGS = (
    "casts",
    "feasible",
    "caught",
    "miss: median, P95, max [mm]",
    "within 2 standard deviations",
    "95 % interval",
    "worst",
)


def main() -> None:
    arguments = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    arguments.add_argument("--casts", type=int, nargs="+", default=N_CASTS)
    arguments.add_argument("--models", type=int, default=4, help="for each number of casts")
    arguments.add_argument("--cups", type=int, default=25, help="for each model")
    arguments.add_argument("--seed", type=int, default=0)
    arguments.add_argument("--workers", type=int, help="default: one for each processor")
    options = arguments.parse_args()
    data = reference_dataset()
    rows = []
    with Workers(options.workers) as workers:
        for n in track(options.casts, console=Console(stderr=True), transient=True):
            throwers = []
            for i in range(options.models):
                seed = derived_seed(options.seed, Purpose.SEARCH, i)
                drawn = data.frame.sample(n, random_state=seed).sort_index()
                model = ForwardModel.fit(CastDataset(data.scenario, data.seed, drawn))
                cups = draw_cups(Reach.of(model), options.cups, seed)
                throwers.append(Thrower(f"model {i}", "program", model, cups))
            planned = plan_and_execute(data.scenario, throwers, seed=options.seed, executor=workers)
            trials = planned[planned["is_feasible"]]
            miss = describe(trials["miss"].to_numpy())
            normalized = np.abs(trials["along"] - trials["predicted_offset"]) / trials["std_along"]
            held = int((normalized <= 2).sum())
            low, high = wilson_interval(held, len(trials))
            rows.append(
                (
                    f"{n}",
                    f"{len(trials)} of {len(planned)}",
                    f"{trials['is_caught'].sum()} of {len(trials)}",
                    ", ".join(f"{1e3 * miss[name]:.1f}" for name in ("median", "p95", "max")),
                    f"{held / len(trials):.0%}",
                    f"{low:.0%} to {high:.0%}",
                    f"{normalized.max():.1f}",
                )
            )
    print_table(rows, HEADINGS)


if __name__ == "__main__":
    main()
