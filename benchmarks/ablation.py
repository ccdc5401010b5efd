"""What each term of the program is for: plans without it over random cups, executed with contact.

python benchmarks/ablation.py [--cups 150] [--seed 0] [--scenario FILE] [--model FILE] [--workers N] [--markdown FILE]
"""

from __future__ import annotations

import argparse
from pathlib import Path

import pandas as pd
from planners.variants import ablate, summarize
from rich.console import Console
from rich.progress import Progress

from wam_cast.cli.terminal import out, print_table
from wam_cast.learning.forward_model import ForwardModel
from wam_cast.learning.reference import reference_model
from wam_cast.parallel.workers import Workers
from wam_cast.scenario import Scenario
from wam_cast.storage.manifest import current_versions

HEADINGS = (
    "without",
    "caught",
    "entered rim-clear",
    "executed miss: median, P95, max [mm]",
    "slack, P5 [mm]",
    "taut at the landing",
    "limits met",
    "utilization of a limit, P95",
)


def cells(without: str, trials: pd.DataFrame) -> tuple[str, ...]:
    found = summarize(trials)
    (low, high), (clear_low, clear_high) = found["hit_interval"], found["clear_interval"]
    miss, slack, utilization = found["executed_miss"], found["least_slack"], found["largest_utilization"]
    numbers = (miss["median"], miss["p95"], miss["max"])
    return (
        without,
        f"{found['n_caught']} of {found['n_cups']} ({low:.0%} to {high:.0%})",
        f"{found['n_clear']} ({clear_low:.0%} to {clear_high:.0%})",
        ", ".join(f"{1e3 * value:.1f}" for value in numbers if value is not None),
        "-" if pd.isna(slack) else f"{1e3 * slack:.1f}",
        str(found["n_taut"]),
        str(found["n_limit_hits"]),
        "-" if pd.isna(utilization) else f"{utilization:.2f}",
    )


def main() -> None:
    arguments = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    arguments.add_argument("--cups", type=int, default=150)
    arguments.add_argument("--seed", type=int, default=0)
    arguments.add_argument("--scenario", type=Path, help="YAML file; default: the reference scenario")
    arguments.add_argument("--model", type=Path, help="of the scenario; default: the reference model")
    arguments.add_argument("--workers", type=int, help="default: one for each processor")
    arguments.add_argument("--markdown", type=Path, metavar="FILE", help="write the table there too")
    options = arguments.parse_args()
    model = reference_model() if options.model is None else ForwardModel.load(options.model)
    if options.scenario is not None:
        model = model.bound_to(Scenario.from_yaml(options.scenario))
    with Workers(options.workers) as workers, Progress(console=Console(stderr=True), transient=True) as bar:
        task = bar.add_task("variants and cups")
        trials = ablate(
            model,
            options.cups,
            seed=options.seed,
            executor=workers,
            report=lambda done, n: bar.update(task, completed=done, total=n),
        )
    nearest, farthest = model.reach
    versions = ", ".join(f"{name} {number}" for name, number in current_versions().items())
    caption = f"{options.cups} random cups from {nearest:.3f} to {farthest:.3f} m, seed {options.seed}; 95 % intervals; {versions}"
    rows = [cells(str(label), group) for label, group in trials.groupby("label", sort=False)]
    print_table(rows, HEADINGS)
    out.print(caption)
    if options.markdown is not None:
        lines = [HEADINGS, ("---",) * len(HEADINGS), *rows]
        text = "\n".join(f"| {' | '.join(line)} |" for line in lines)
        options.markdown.write_text(f"{text}\n\n{caption}\n", encoding="utf-8")


if __name__ == "__main__":
    main()
