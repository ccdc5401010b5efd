"""Planners side by side over random cups: hit rate, executed miss, evaluations and seconds a cup, in one table.

The package's planners as they are; grid search, CMA-ES and Bayesian optimisation on the model at equal numbers of evaluations;
the last two on the simulator too, at equal numbers of casts. A worker is a process on one thread.

    python benchmarks/compare_planners.py [--cups 100] [--seed 0] [--noise] [--budget N] [--casts 30] [--workers N]
                                           [--markdown FILE]
"""

from __future__ import annotations

import argparse
from pathlib import Path

from planners.study import N_CASTS, compare_planners
from planners.table import HEADINGS, caption, table_rows, to_markdown
from rich.console import Console
from rich.progress import Progress

from wam_cast.cli.terminal import out, print_table
from wam_cast.learning.reference import reference_model
from wam_cast.parallel.workers import Workers
from wam_cast.scenario import Noise, Scenario


def main() -> None:
    arguments = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    arguments.add_argument("--cups", type=int, default=100)
    arguments.add_argument("--seed", type=int, default=0)
    arguments.add_argument("--noise", action="store_true", help="what is typical of a real arm")
    arguments.add_argument("--budget", type=int, help="by default what the program uses at the median")
    arguments.add_argument("--casts", type=int, default=N_CASTS, help="of a search on the simulator, for each cup")
    arguments.add_argument("--workers", type=int, help="by default one for each processor")
    arguments.add_argument("--markdown", type=Path, metavar="FILE", help="write the table there too")
    options = arguments.parse_args()
    scenario = Scenario(noise=Noise.typical() if options.noise else Noise())
    with Workers(options.workers) as workers, Progress(console=Console(stderr=True), transient=True) as bar:
        task = bar.add_task("contenders and cups")
        comparison = compare_planners(
            reference_model().bound_to(scenario),
            options.cups,
            budget=options.budget,
            n_casts=options.casts,
            seed=options.seed,
            executor=workers,
            report=lambda done, n: bar.update(task, completed=done, total=n),
        )
    print_table(table_rows(comparison), HEADINGS)
    out.print(caption(comparison))
    if options.markdown is not None:
        options.markdown.write_text(to_markdown(comparison), encoding="utf-8")


if __name__ == "__main__":
    main()
