"""What the command line prints: tables, JSON, progress."""

from __future__ import annotations

import json
import math
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import asdict
from typing import TYPE_CHECKING, Any

import numpy as np
from rich.console import Console
from rich.progress import (
    BarColumn,
    MofNCompleteColumn,
    Progress,
    SpinnerColumn,
    TaskID,
    TextColumn,
    TimeElapsedColumn,
    TimeRemainingColumn,
)
from rich.table import Table

if TYPE_CHECKING:
    from pathlib import Path

    from wam_cast.experiments.floor_map import FloorMap
    from wam_cast.experiments.paper.findings import Findings
    from wam_cast.learning.forward_model import ForwardModel
    from wam_cast.planning.plan import Plan
    from wam_cast.simulation.outcome import Outcome

# Nothing is taken for markup: [m] is a unit, and any name may be a file's.
out = Console(soft_wrap=True, highlight=False, markup=False, emoji=False)
err = Console(stderr=True, soft_wrap=True, highlight=False, markup=False, emoji=False)

Record = dict[str, Any]

UNLIKELY = 0.5
"""Probability of entering clear, below which a plan is worth a word."""


@contextmanager
def progress(what: str, total: int | None = None) -> Iterator[Callable[[int], None]]:
    """Show progress on standard error if that is a terminal; give the function that takes how much is done."""
    columns = [SpinnerColumn(), TextColumn("{task.description}")]
    if total is not None:
        columns += [BarColumn(), MofNCompleteColumn(), TimeRemainingColumn()]
    with Progress(*columns, console=err, transient=True, disable=not err.is_terminal) as bar:
        task = bar.add_task(what, total=total)
        yield lambda done: bar.update(task, completed=done)


@contextmanager
def phase_progress() -> Iterator[Callable[[str, int, int], None]]:
    """Show a bar for each phase, with its time left; give the function that takes title, how much is done, and how much there is.

    If standard error is no terminal, a line tells that a phase begins.
    """
    columns = [TextColumn("{task.description}"), BarColumn(), MofNCompleteColumn()]
    columns += [TimeElapsedColumn(), TextColumn("left"), TimeRemainingColumn()]
    with Progress(*columns, console=err, disable=not err.is_terminal) as bar:
        tasks: dict[str, TaskID] = {}

        def report(title: str, done: int, total: int) -> None:
            if title not in tasks:
                tasks[title] = bar.add_task(title, total=total)
                if not err.is_terminal:
                    err.print(title)
            bar.update(tasks[title], completed=done, total=total)

        yield report


def plan_record(plan: Plan) -> Record:
    """Return what `plan --json` prints of a plan, in SI units."""
    return {
        "cup": list(plan.cup),
        "cast": asdict(plan.cast),
        "predicted_landing": plan.predicted_landing.tolist(),
        "predicted_miss": plan.predicted_miss,
        "predicted_spread": list(plan.predicted_spread),
        "predicted_entry_angle": plan.predicted_entry_angle,
        "predicted_entry_speed": plan.predicted_entry_speed,
        "predicted_slack": plan.predicted_slack,
        "predicted_peak_load": plan.predicted_peak_load,
        "predicted_peak_speed": plan.predicted_peak_speed,
        "clear_entry_probability": plan.clear_entry_probability,
        "is_feasible": plan.is_feasible,
        "planner": plan.method,
        "n_evaluations": plan.n_evaluations,
        "n_solutions": plan.n_solutions,
        "reason": plan.reason,
    }


def throw_record(plan: Plan, outcome: Outcome) -> Record:
    """Return what `throw --json` prints of a plan and its execution, in SI units."""
    return {
        **plan_record(plan),
        "landing": outcome.landing.tolist(),
        "miss": outcome.miss,
        "status": outcome.status.value,
        "is_caught": outcome.is_caught,
        "entry_angle": outcome.entry_angle,
        "entry_speed": outcome.entry_speed,
        "is_slack": outcome.is_slack,
        "slack": outcome.slack,
        "peak_load": float(np.max(outcome.peak_load)),
        "peak_speed": float(np.max(outcome.peak_speed)),
        "limits_hit": list(outcome.limits_hit),
        "return_faults": list(outcome.return_faults),
    }


def print_json(records: Sequence[Record], *, is_list: bool | None = None) -> None:
    """Print one object, or a list of several; what is not a number becomes null, which JSON has a word for.

    `is_list` says which it is to be whatever their number.
    """

    def clean(value: Any) -> Any:
        if isinstance(value, dict):
            return {key: clean(item) for key, item in value.items()}
        if isinstance(value, list | tuple):
            return [clean(item) for item in value]
        return None if isinstance(value, float) and not math.isfinite(value) else value

    if is_list is None:
        is_list = len(records) != 1
    print(json.dumps(clean(list(records) if is_list else records[0]), indent=2), flush=True)


def print_throws(plans: Sequence[Plan], outcomes: Sequence[Outcome], as_json: bool) -> None:
    """Print what became of the plans that were executed, the first ones: JSON, or a table."""
    executed = list(zip(plans, outcomes, strict=False))
    if as_json:
        print_json([throw_record(*pair) for pair in executed], is_list=len(plans) > 1)
    else:
        _print_throw_table(executed)


def _print_throw_table(executed: Sequence[tuple[Plan, Outcome]]) -> None:
    """Print a row for each cup, and below it what a row has no room for."""
    table = _table("cup\n[m]", "predicted\n[m]", "executed\n[m]", "miss\n[mm]", "status")
    for plan, outcome in executed:
        landing, miss = _position(outcome.landing), f"{1e3 * outcome.miss:.1f}"
        if not math.isfinite(outcome.miss):
            landing = miss = "-"
        table.add_row(
            _position(plan.cup), _position(plan.predicted_landing), landing, miss, outcome.status.value
        )
    out.print(table)
    for i, (plan, outcome) in enumerate(executed, 1):
        _print_infeasible(plan)
        _print_unlikely(plan)
        if not outcome.is_caught and i < len(executed):
            out.print(f"cup {_position(plan.cup)}: missed; the next cast starts anew, from rest at home")
        if outcome.limits_hit:
            out.print(
                f"cup {_position(plan.cup)}: the arm meets the limit of {', '.join(outcome.limits_hit)}"
            )
        if outcome.return_faults:
            out.print(f"cup {_position(plan.cup)}: on the way home, {', '.join(outcome.return_faults)}")


def _print_unlikely(plan: Plan) -> None:
    if plan.is_feasible and plan.clear_entry_probability < UNLIKELY:
        share = f"{100 * plan.clear_entry_probability:.0f} %"
        out.print(f"cup {_position(plan.cup)}: enters without touching the rim in {share} of casts like this")


def print_plans(plans: Sequence[Plan]) -> None:
    """Print a row for each cup."""
    headings = (
        "cup\n[m]",
        "distance\n[m]",
        "speed\n[m/s]",
        "wait\n[s]",
        "bearing\n[deg]",
        "predicted\nmiss [mm]",
        "clear\n[%]",
    )
    table = _table(*headings)
    for plan in plans:
        cast = plan.cast
        table.add_row(
            _position(plan.cup),
            f"{cast.distance:.4f}",
            f"{cast.speed:.4f}",
            f"{cast.wait:.4f}",
            f"{math.degrees(cast.bearing):.2f}",
            f"{1e3 * plan.predicted_miss:.1f} ({1e3 * plan.predicted_spread.along:.1f})",
            f"{100 * plan.clear_entry_probability:.0f}",
        )
    out.print(table)
    out.print("in brackets: standard deviation; clear: entering without touching the rim")
    for plan in plans:
        if "against" in plan.reason:
            out.print(f"cup {_position(plan.cup)}: {plan.reason}")
        _print_infeasible(plan)


def print_fit(model: ForwardModel) -> None:
    """Print how a model was fitted, and how well it predicts the landing along the casting plane."""
    info = model.info
    nearest, farthest = model.reach
    table = Table(show_header=False)
    for name, value in (
        ("training casts", str(info.n_train)),
        ("sigma of distance, speed, wait", ", ".join(f"{sigma:.3f}" for sigma in info.sigma)),
        ("lambda", f"{info.regularization:.1e}"),
        ("leave-one-out RMSE [mm]", f"{1e3 * info.leave_one_out_rmse:.2f}"),
        ("validation RMSE [mm]", f"{1e3 * info.validation_rmse:.2f}"),
        ("test RMSE [mm]", f"{1e3 * info.test_rmse:.2f}"),
        ("reach [m]", f"{nearest:.3f} to {farthest:.3f}"),
    ):
        table.add_row(name, value)
    out.print(table)


def print_findings(findings: Findings, directory: Path) -> None:
    """Print the experiment's main numbers beside the paper's, and where the report is."""
    from wam_cast.experiments.paper import published as paper

    results = findings.summary()
    rmse, miss = results["test_rmse_m"], results["executed_miss_m"]
    low, high = results["hit_interval"]
    table = _table("", "paper", "here")
    casts = ", ".join(str(results[name]) for name in ("n_train", "n_validation", "n_test"))
    table.add_row(
        "training, validation, test casts", f"{paper.N_TRAIN}, {paper.N_VALIDATION}, {paper.N_TEST}", casts
    )
    table.add_row(
        "test RMSE, one sigma [cm]", f"{100 * paper.TEST_RMSE:.2f}", f"{100 * rmse['isotropic']:.2f}"
    )
    table.add_row("test RMSE, three sigmas [cm]", "-", f"{100 * rmse['ard']:.2f}")
    table.add_row(
        "test RMSE, polynomial 12 [cm]",
        f"{100 * paper.POLYNOMIAL_RMSE:.1f}",
        f"{100 * rmse['polynomial_12']:.2f}",
    )
    table.add_row(
        "mean predicted miss [mm]",
        f"{1e3 * paper.PREDICTED_MISS:.1f}",
        f"{1e3 * results['predicted_miss_m']['mean']:.1f}",
    )
    table.add_row(
        "mean executed miss [mm]", "-", "-" if miss["mean"] is None else f"{1e3 * miss['mean']:.1f}"
    )
    caught = round(results["hit_rate"] * results["n_cups"])
    table.add_row(
        "hit rate",
        f"{100 * paper.HIT_RATE:.0f} %",
        f"{caught} of {results['n_cups']} ({low:.0%} to {high:.0%})",
    )
    out.print(table)
    out.print(f"report: {directory / 'report.html'}")


def print_map(floor: FloorMap, picture: Path) -> None:
    """Print a row for each distance from the base axis: what was predicted, what was executed, and how often it succeeded."""
    table = _table(
        "cup\n\n[m]",
        "predicted\nalong\n[mm]",
        "executed\nalong\n[mm]",
        "executed\nlateral\n[mm]",
        "clear\n\n[%]",
        "caught",
        "interval\n\n[%]",
    )
    record = floor.record()
    for ring in record["rings"]:
        low, high = ring["hit_interval"]
        table.add_row(
            f"{ring['radius']:.3f}",
            _offset(ring["predicted_along"], ring["predicted_spread"][0]),
            _scatter(ring["along"]),
            _scatter(ring["lateral"]),
            f"{100 * ring['clear_entry_probability']:.1f}",
            f"{ring['n_caught']}/{ring['n_casts']}",
            f"{100 * low:.0f}-{100 * high:.0f}",
        )
    out.print(table)
    out.print(
        "cup: its distance from the base axis; along: outward from its axis, lateral: to the left of it;"
    )
    out.print("in brackets: standard deviation; clear: probability of entering without touching the rim")
    for ring in record["rings"]:
        if not ring["is_feasible"]:
            out.print(f"cup {ring['radius']:.3f}: no cast is predicted to land in it")
    out.print(f"{record['n_caught']} of {record['n_casts']} caught; the map is in {picture}")


def _scatter(offsets: Mapping[str, float | None]) -> str:
    mean, std = offsets["mean"], offsets["std"]
    return "-" if mean is None or std is None else _offset(mean, std)


def _offset(mean: float, std: float) -> str:
    return f"{round(1e3 * mean, 1) + 0:.1f} ({1e3 * std:.1f})"


def _table(*headings: str) -> Table:
    table = Table()
    for heading in headings:
        table.add_column(heading, no_wrap=True)
    return table


def _position(xy: Any) -> str:
    # Adding 0 turns a rounded -0 into 0.
    return ", ".join(f"{round(value, 4) + 0:.4f}" for value in xy)


def _print_infeasible(plan: Plan) -> None:
    if not plan.is_feasible:
        out.print(f"cup {_position(plan.cup)}: no cast is predicted to land in it ({plan.reason})")
