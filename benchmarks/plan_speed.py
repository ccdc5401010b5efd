"""How long a plan takes on one core once the model is loaded: the program with each solver, and the paper's descent beside it.

    python benchmarks/plan_speed.py [--cups 60] [--noise]

Processor time, of each cup the best of three. Cups lie evenly over the reach of the reference model.
"""

from __future__ import annotations

import argparse
import os
import time

# One core: the numerical libraries' threads must not help. It counts only before they are loaded.
os.environ.update(OMP_NUM_THREADS="1", OPENBLAS_NUM_THREADS="1")

import numpy as np

from wam_cast.cli.terminal import out, print_table
from wam_cast.learning.forward_model import ForwardModel
from wam_cast.learning.reference import reference_model
from wam_cast.planning.plan import Method, plan_cast
from wam_cast.planning.solution import SOLVERS, Solver
from wam_cast.scenario import Noise, Scenario

N_REPEATS = 3


def seconds_and_evaluations(
    model: ForwardModel, radius: float, method: Method, solver: Solver | None
) -> tuple[float, int]:
    best = np.inf
    for _ in range(N_REPEATS):
        start = time.process_time()
        plan = plan_cast(model, (radius, 0.0), method, solver)
        best = min(best, time.process_time() - start)
    return best, plan.n_evaluations


def main() -> None:
    arguments = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    arguments.add_argument("--cups", type=int, default=60)
    arguments.add_argument("--noise", action="store_true", help="plan for what is typical of a real arm")
    options = arguments.parse_args()
    start = time.process_time()
    model = reference_model().bound_to(Scenario(noise=Noise.typical() if options.noise else Noise()))
    loaded = time.process_time() - start
    planners: list[tuple[Method, Solver | None]] = [("gradient", None), *(("program", name) for name in SOLVERS)]
    rows = []
    descent = np.nan
    for method, solver in planners:
        plan_cast(model, (sum(model.reach) / 2, 0.0), method, solver)
        pairs = [
            seconds_and_evaluations(model, float(radius), method, solver)
            for radius in np.linspace(*model.reach, options.cups)
        ]
        seconds, evaluations = np.array(pairs).T
        if method == "gradient":
            descent = np.median(seconds)
        rows.append(
            (
                method if solver is None else f"{method}, {solver}",
                ", ".join(f"{1e3 * value:.1f}" for value in np.percentile(seconds, [50, 95, 100])),
                f"{np.median(evaluations):g}",
                f"{np.median(seconds) / descent:.1f}",
            )
        )
    out.print(f"{options.cups} cups, one core; the model was loaded in {loaded:.1f} s")
    print_table(rows, ["planner", "ms a plan: median, P95, max", "evaluations, median", "of the descent's time"])


if __name__ == "__main__":
    main()
