"""What the commands print: tables for people, and below them what a table has no room for; with `--json` records in SI units."""

from __future__ import annotations

import json
import math
from collections.abc import Mapping, Sequence
from dataclasses import asdict
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

import wam_cast as wc
from wam_cast.cli.terminal import out, print_table

if TYPE_CHECKING:
    from wam_cast.experiments.floor_map import FloorMap
    from wam_cast.experiments.paper.findings import Findings

Record = dict[str, Any]

LOW_RIM_CLEAR_PROBABILITY = 0.5
"""Probability of a rim-clear entry below which a plan is remarked upon."""


def print_json(record: Record | Sequence[Record]) -> None:
    """Print one object, or a list of them; what is not a number becomes null, which JSON has a word for."""
    finite = json.loads(json.dumps(record), parse_constant=lambda _: None)
    print(json.dumps(finite, indent=2), flush=True)


PREDICTED = (
    "predicted_landing",
    "predicted_miss",
    "predicted_std",
    "predicted_entry_angle",
    "predicted_entry_speed",
    "predicted_slack",
    "predicted_peak_torque_utilization",
    "predicted_peak_velocity_utilization",
    "rim_clear_probability",
    "is_feasible",
)
FOUND = ("n_evaluations", "n_solutions", "reason")
"""Attributes of a plan that JSON has under the same names: of what it predicts, and of how it was found."""


def plan_record(plan: wc.Plan) -> Record:
    """Return what `plan --json` prints of a plan."""
    return {
        "cup": plan.cup,
        "cast": asdict(plan.cast),
        **{name: getattr(plan, name) for name in PREDICTED},
        "predicted_landing": plan.predicted_landing.tolist(),
        "planner": plan.method,
        **{name: getattr(plan, name) for name in FOUND},
    }


def _unplanned_record(throw: wc.Throw) -> Record:
    """Return the same of a cast that was given: null for all that a plan would tell."""
    return {"cup": throw.cup, "cast": asdict(throw.cast), **dict.fromkeys((*PREDICTED, "planner", *FOUND))}


class Executed(NamedTuple):
    """A cast for a cup, its plan unless it was given, and what became of it."""

    throw: wc.Throw
    plan: wc.Plan | None
    outcome: wc.Outcome


def throw_record(executed: Executed, robot: str | None = None) -> Record:
    """Return what `throw --json` prints of a cast: what was planned, null if nothing was, and what became of it.

    If it was a `robot` elsewhere that cast, its address and why it stopped, if it did, come on top.
    """
    throw, plan, outcome = executed
    return {
        **(_unplanned_record(throw) if plan is None else plan_record(plan)),
        "landing": outcome.landing.tolist(),
        "miss": outcome.miss,
        "status": outcome.status.value,
        "is_caught": outcome.is_caught,
        "entry_angle": outcome.entry_angle,
        "entry_speed": outcome.entry_speed,
        "is_slack": outcome.is_slack,
        "slack": outcome.slack,
        "peak_torque_utilization": float(outcome.peak_torque_utilization.max()),
        "peak_velocity_utilization": float(outcome.peak_velocity_utilization.max()),
        "limits_hit": outcome.limits_hit,
        "return_faults": outcome.return_faults,
        **({} if robot is None else {"robot": robot, "stop_reason": outcome.stop_reason}),
    }


def print_plans(plans: Sequence[wc.Plan]) -> None:
    """Print a row for each cup."""
    headings = [
        "cup\n[m]",
        "distance\n[m]",
        "speed\n[m/s]",
        "wait\n[s]",
        "bearing\n[deg]",
        "predicted\nmiss [mm]",
        "clear\n[%]",
    ]
    rows = [
        (
            format_position(plan.cup),
            *(f"{value:.4f}" for value in plan.cast.to_array()),
            f"{math.degrees(plan.cast.bearing):.2f}",
            f"{1e3 * plan.predicted_miss:.1f} ({1e3 * plan.predicted_std.along:.1f})",
            f"{100 * plan.rim_clear_probability:.0f}",
        )
        for plan in plans
    ]
    print_table(rows, headings)
    out.print("in brackets: predictive standard deviation")
    out.print("clear: probability of a rim-clear entry (without touching the rim)")
    for plan in plans:
        if "against" in plan.reason:
            out.print(f"cup {format_position(plan.cup)}: {plan.reason}")
        _print_infeasible(plan)


def print_throws(executed: Sequence[Executed]) -> None:
    """Print a row for each cup."""
    rows = []
    for throw, plan, outcome in executed:
        predicted = "-" if plan is None else format_position(plan.predicted_landing)
        landing, miss = format_position(outcome.landing), f"{1e3 * outcome.miss:.1f}"
        if not math.isfinite(outcome.miss):
            landing = miss = "-"
        rows.append((format_position(throw.cup), predicted, landing, miss, outcome.status.value))
    print_table(rows, ["cup\n[m]", "predicted\n[m]", "executed\n[m]", "miss\n[mm]", "status"])
    for i, (throw, plan, outcome) in enumerate(executed, 1):
        cup = f"cup {format_position(throw.cup)}"
        if plan is not None:
            _print_infeasible(plan)
        if plan is not None and plan.is_feasible and plan.rim_clear_probability < LOW_RIM_CLEAR_PROBABILITY:
            clear = 100 * plan.rim_clear_probability
            out.print(f"{cup}: enters without touching the rim in {clear:.0f} % of casts like this")
        if outcome.stop_reason:
            out.print(f"{cup}: the arm stopped: {outcome.stop_reason}")
        if not outcome.is_caught and i < len(executed):
            out.print(f"{cup}: missed; the next cast starts anew, from rest at home")
        if outcome.limits_hit:
            out.print(f"{cup}: the arm meets the limit of {', '.join(outcome.limits_hit)}")
        if outcome.return_faults:
            out.print(f"{cup}: on the way home, {', '.join(outcome.return_faults)}")


def dataset_record(data: wc.CastDataset, directory: Path, seconds: float) -> Record:
    """Return what `generate --json` prints."""
    from wam_cast.learning.parts import failed_casts

    return {
        "directory": str(directory),
        "n_casts": len(data),
        "seed": data.seed,
        "engine": data.engine,
        "fingerprint": data.scenario.fingerprint,
        "statuses": data.frame["status"].value_counts().to_dict(),
        "failed": failed_casts(data),
        "wall_s": seconds,
    }


def print_dataset(data: wc.CastDataset, directory: Path, seconds: float) -> None:
    """Print how many casts were made, and how they ended."""
    statuses = ", ".join(f"{count} {status}" for status, count in data.frame["status"].value_counts().items())
    out.print(f"{len(data)} casts in {directory} ({statuses}), {seconds:.1f} s")


def fit_record(model: wc.ForwardModel, data: wc.CastDataset, file: Path) -> Record:
    """Return what `fit --json` prints."""
    from wam_cast.learning.parts import failed_casts

    return {"model": str(file), "reach": model.reach, **asdict(model.info), "failed": failed_casts(data)}


def print_fit(model: wc.ForwardModel) -> None:
    """Print how a model was fitted, and how well it predicts the landing along the casting plane."""
    info, (nearest, farthest) = model.info, model.reach
    rows = [
        ("training casts", str(info.n_train)),
        ("kernel at", "all of them" if info.n_landmarks is None else f"{info.n_landmarks} of them, an approximation"),
        ("ARD length scales (distance, speed, wait)", ", ".join(f"{sigma:.3f}" for sigma in info.sigma)),
        ("lambda", f"{info.regularization:.1e}"),
        ("leave-one-out RMSE [mm]", f"{1e3 * info.leave_one_out_rmse:.2f}"),
        ("validation RMSE [mm]", f"{1e3 * info.validation_rmse:.2f}"),
        ("test RMSE [mm]", f"{1e3 * info.test_rmse:.2f}"),
        ("reach [m]", f"{nearest:.3f} to {farthest:.3f}"),
    ]
    print_table(rows)


def print_findings(findings: Findings, directory: Path) -> None:
    """Print the experiment's main numbers beside the paper's, and where the report is."""
    from wam_cast.experiments.paper import published as paper

    here = findings.summary()
    rmse, predicted, executed = here["test_rmse_m"], here["predicted_miss_m"]["mean"], here["executed_miss_m"]["mean"]
    n_cups, (low, high) = here["n_cups"], here["hit_interval"]
    caught = f"{round(here['hit_rate'] * n_cups)} of {n_cups} ({low:.0%} to {high:.0%})"
    if findings.settings.is_quick:
        out.print("a quick run, with a tenth of a full run's data")
    rows = [
        (
            "training, validation, test casts",
            f"{paper.N_TRAIN}, {paper.N_VALIDATION}, {paper.N_TEST}",
            f"{here['n_train']}, {here['n_validation']}, {here['n_test']}",
        ),
        ("test RMSE, one length scale [cm]", f"{100 * paper.TEST_RMSE:.2f}", f"{100 * rmse['isotropic']:.2f}"),
        ("test RMSE, ARD length scales [cm]", "-", f"{100 * rmse['ard']:.2f}"),
        ("test RMSE, polynomial 12 [cm]", f"{100 * paper.POLYNOMIAL_RMSE:.1f}", f"{100 * rmse['polynomial_12']:.2f}"),
        ("mean predicted miss [mm]", f"{1e3 * paper.PREDICTED_MISS:.1f}", f"{1e3 * predicted:.1f}"),
        ("mean executed miss [mm]", "-", "-" if executed is None else f"{1e3 * executed:.1f}"),
        ("hit rate", f"{100 * paper.HIT_RATE:.0f} %", caught),
    ]
    print_table(rows, ["what", "paper", "here"])
    out.print(f"report: {directory / 'report.html'}")


def print_map(floor: FloorMap) -> None:
    """Print a row for each distance from the base axis: what was predicted, what was executed, and how often it succeeded."""
    headings = ["cup\n\n[m]", "predicted\nalong\n[mm]", "executed\nalong\n[mm]", "executed\nlateral\n[mm]"]
    headings += ["clear\n\n[%]", "caught", "interval\n\n[%]"]
    record, rows = floor.record(), []
    for ring in record["rings"]:
        low, high = ring["hit_interval"]
        rows.append(
            (
                f"{ring['radius']:.3f}",
                _offset(ring["predicted_along"], ring["predicted_std"][0]),
                _scatter(ring["along"]),
                _scatter(ring["lateral"]),
                f"{100 * ring['rim_clear_probability']:.1f}",
                f"{ring['n_caught']}/{ring['n_casts']}",
                f"{100 * low:.0f}-{100 * high:.0f}",
            )
        )
    print_table(rows, headings)
    out.print("cup: its distance from the base axis; along: outward from its axis, lateral: to the left of it;")
    out.print("in brackets: standard deviation; clear: probability of a rim-clear entry (without touching the rim)")
    for ring in record["rings"]:
        if not ring["is_feasible"]:
            out.print(f"cup {ring['radius']:.3f}: no cast is predicted to end in it ({ring['reason']})")
    out.print(f"{record['n_caught']} of {record['n_casts']} caught")


def _print_infeasible(plan: wc.Plan) -> None:
    if not plan.is_feasible:
        out.print(f"cup {format_position(plan.cup)}: no cast is predicted to end in it ({plan.reason})")


def format_position(xy: Any) -> str:
    """Return world (x, y) [m] as tables have it."""
    # Adding 0 turns a rounded -0 into 0.
    return ", ".join(f"{round(value, 4) + 0:.4f}" for value in xy)


def _scatter(offsets: Mapping[str, float | None]) -> str:
    mean, std = offsets["mean"], offsets["std"]
    return "-" if mean is None or std is None else _offset(mean, std)


def _offset(mean: float, std: float) -> str:
    return f"{round(1e3 * mean, 1) + 0:.1f} ({1e3 * std:.1f})"
