"""Whether the scenarios that laboratories have work, or are refused beforehand with the reason: the documentation's table.

    python benchmarks/laboratories.py [--only NAME] [--casts 250] [--cups 20] [--seed 0] [--workers N] [--engine drake]
                                       [--out FILE.jsonl]

Each scenario of `laboratory_scenarios.py` is tried as a new user would: what can be seen of it beforehand, random casts, a model,
random cups over the model's reach on the line y = 0, a plan for each, and each plan executed once. The table is Markdown, on
standard output; progress goes to standard error. `--out` keeps a line of JSON for each scenario, so that a run that was interrupted
goes on. The exit code is 1 if any scenario was neither refused beforehand nor had all its cups hit.
"""

from __future__ import annotations

import argparse
import json
import sys
import time
from collections.abc import Iterator, Sequence
from functools import partial
from pathlib import Path
from typing import Any

import pandas as pd
from laboratory_scenarios import LABORATORIES, Laboratory, scenarios_of
from rich.console import Console
from rich.progress import Progress

from wam_cast.casting_plane import from_polar
from wam_cast.errors import InputError
from wam_cast.experiments.preview import preview_scenario
from wam_cast.experiments.trials import Trial, draw_cups, failures, trial_row
from wam_cast.learning.dataset import CastDataset, generate_dataset
from wam_cast.learning.forward_model import ForwardModel
from wam_cast.parallel.seeds import Purpose, derived_seed
from wam_cast.parallel.workers import Workers, run_rows
from wam_cast.planning.plan import plan_cast
from wam_cast.planning.reach import Reach
from wam_cast.scenario import Scenario
from wam_cast.simulation.outcome import Outcome
from wam_cast.simulation.simulator import CastSimulator, simulate_cast
from wam_cast.storage.manifest import current_versions

Result = dict[str, Any]

COLUMNS = (
    "scenario",
    "what is special",
    "verdict",
    "miss: median, largest [mm]",
    "reach [m]",
    "landed with a slack string",
)


def main() -> None:
    arguments = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    arguments.add_argument("--only", action="append", metavar="NAME", help="repeatable; default: all")
    arguments.add_argument("--casts", type=int, default=250)
    arguments.add_argument("--cups", type=int, default=20)
    arguments.add_argument("--seed", type=int, default=0)
    arguments.add_argument("--workers", type=int, help="default: one for each processor")
    arguments.add_argument("--engine", default="drake", help="that simulates the training casts: drake or batch")
    arguments.add_argument(
        "--out", type=Path, help="keeps each scenario's result, and those that are there already count"
    )
    options = arguments.parse_args()
    chosen = [one for one in LABORATORIES if not options.only or one.name in options.only]
    unknown = set(options.only or ()) - {one.name for one in chosen}
    if unknown:
        arguments.error(
            f"--only {', '.join(sorted(unknown))}: choose from {', '.join(one.name for one in LABORATORIES)}"
        )
    settings = {"casts": options.casts, "cups": options.cups, "seed": options.seed, "engine": options.engine}
    known = _read(options.out)
    results = []
    with Workers(options.workers) as workers, Progress(console=Console(stderr=True), transient=True) as bar:
        for laboratory in bar.track(chosen, description="laboratories"):
            key = {"name": laboratory.name, **settings, "values": laboratory.values, "believed": laboratory.believed}
            key |= {"versions": current_versions()}
            result = known.get(_text(key)) or tried(laboratory, **settings, workers=workers)
            results.append(result)
            bar.console.print(" | ".join(_cells(laboratory, result)))
            if options.out is not None and _text(key) not in known:
                with options.out.open("a", encoding="utf-8") as lines:
                    lines.write(json.dumps({"key": key, "result": result}) + "\n")
    print("\n".join(_markdown([_cells(*pair) for pair in zip(chosen, results, strict=True)])))
    sys.exit(0 if all(result["verdict"] in ("refused", "all caught") for result in results) else 1)


def check(robot: Scenario, belief: Scenario) -> None:
    """Raise `.InputError` if it can be seen before anything is learned that the scenario cannot work."""
    CastSimulator(robot, belief)
    verdict = preview_scenario(belief, ends_early=True).verdict
    if not verdict.can_work:
        raise InputError(verdict.reason)


def tried(laboratory: Laboratory, *, casts: int, cups: int, seed: int, engine: str, workers: Workers) -> Result:
    """Return what became of a laboratory's scenario: its `verdict`, and `reason` or numbers."""
    start = time.monotonic()
    try:
        robot, belief = scenarios_of(laboratory)
        check(robot, belief)
    except InputError as error:
        return {"verdict": "refused", "reason": str(error)}
    try:
        data = generate_dataset(belief, casts, seed, engine=engine, executor=workers)
    except InputError as error:
        return {"verdict": "refused late", "reason": str(error)}
    statuses = {str(name): int(n) for name, n in data.frame["status"].value_counts().items()}
    found: Result = {"statuses": statuses, "slack": float(_clean(data).mean()), "generated_s": time.monotonic() - start}
    try:
        model = ForwardModel.fit(data)
        trials = list(_planned(model.bound_to(belief), cups, seed))
    except InputError as error:
        return found | {"verdict": "refused late", "reason": str(error)}
    frame = _executed(robot, belief, trials, workers)
    caught = int(frame["is_caught"].sum())
    return found | {
        "verdict": "all caught" if caught == len(frame) else "some missed",
        "caught": caught,
        "cups": len(frame),
        "failures": failures(frame),
        "median_miss": float(frame["miss"].median()),
        "largest_miss": float(frame["miss"].max()),
        "reach": model.reach,
        "test_rmse": model.info.test_rmse,
        "trials": json.loads(frame.to_json(orient="records")),
        "seconds": time.monotonic() - start,
    }


def _clean(data: CastDataset) -> pd.Series[bool]:
    return (data.frame["status"] == "landed") & data.frame["is_slack"].astype(bool)


def _planned(model: ForwardModel, n_cups: int, seed: int) -> Iterator[Trial]:
    for i, cup in enumerate(draw_cups(Reach.of(model), n_cups, seed)):
        plan = plan_cast(model, from_polar(*cup))
        yield Trial(plan.cast, cup, derived_seed(seed, Purpose.NOISE, i), plan=plan)


def _executed(robot: Scenario, belief: Scenario, trials: Sequence[Trial], workers: Workers) -> pd.DataFrame:
    """Return the trials' rows, as `trials.execute` does, with the robot and what is believed of it."""
    outcomes = run_rows(partial(_execute, robot, belief, trials), range(len(trials)), workers)
    return pd.DataFrame([trial_row(robot, trial, outcome) for trial, outcome in zip(trials, outcomes, strict=True)])


def _execute(robot: Scenario, belief: Scenario, trials: Sequence[Trial], row: int) -> Outcome:
    trial = trials[row]
    told = None if belief is robot or belief == robot else belief
    return simulate_cast(robot, trial.cast, trial.position, belief=told, noise_seed=trial.noise_seed)


def _cells(laboratory: Laboratory, result: Result) -> tuple[str, ...]:
    """Return a row of the table."""
    verdict, reason = result["verdict"], result.get("reason", "")
    if "caught" not in result:
        slack = f"{result['slack']:.0%}" if "slack" in result else "-"
        return laboratory.name, laboratory.description, f"{verdict}: {reason}", "-", "-", slack
    failed = ", ".join(f"{n} {status}" for status, n in result["failures"].items())
    caught = f"{result['caught']} of {result['cups']} caught{f' ({failed})' if failed else ''}"
    misses = f"{1e3 * result['median_miss']:.1f}, {1e3 * result['largest_miss']:.1f}"
    reach = "{:.3f} to {:.3f}".format(*result["reach"])
    return laboratory.name, laboratory.description, caught, misses, reach, f"{result['slack']:.0%}"


def _markdown(rows: Sequence[Sequence[str]]) -> Iterator[str]:
    yield f"| {' | '.join(COLUMNS)} |"
    yield f"|{'---|' * len(COLUMNS)}"
    for row in rows:
        yield f"| {' | '.join(cell.replace('|', '/') for cell in row)} |"


def _read(path: Path | None) -> dict[str, Result]:
    """Return the results that a file holds, by what they are of."""
    if path is None or not path.exists():
        return {}
    entries = (json.loads(line) for line in path.read_text(encoding="utf-8").splitlines() if line.endswith("}"))
    return {_text(entry["key"]): entry["result"] for entry in entries}


def _text(key: Result) -> str:
    return json.dumps(json.loads(json.dumps(key)), sort_keys=True)


if __name__ == "__main__":
    main()
