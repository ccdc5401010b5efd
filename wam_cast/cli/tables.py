"""What the commands print for people: tables, and below them what a table has no room for."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any

from rich.table import Table

from wam_cast.cli.terminal import out

if TYPE_CHECKING:
    from pathlib import Path

    from wam_cast.experiments.floor_map import FloorMap
    from wam_cast.experiments.paper.findings import Findings
    from wam_cast.learning.forward_model import ForwardModel
    from wam_cast.planning.plan import Plan
    from wam_cast.simulation.outcome import Outcome

LOW_RIM_CLEAR_PROBABILITY = 0.5
"""Probability of a rim-clear entry below which a plan is remarked upon."""


def print_throws(executed: Sequence[tuple[Plan, Outcome]]) -> None:
    """Print a row for each cup, and below it what a row has no room for."""
    table = _table("cup\n[m]", "predicted\n[m]", "executed\n[m]", "miss\n[mm]", "status")
    for plan, outcome in executed:
        landing, miss = _position(outcome.landing), f"{1e3 * outcome.miss:.1f}"
        if not math.isfinite(outcome.miss):
            landing = miss = "-"
        table.add_row(_position(plan.cup), _position(plan.predicted_landing), landing, miss, outcome.status.value)
    out.print(table)
    for i, (plan, outcome) in enumerate(executed, 1):
        _print_infeasible(plan)
        if plan.is_feasible and plan.rim_clear_probability < LOW_RIM_CLEAR_PROBABILITY:
            out.print(
                f"cup {_position(plan.cup)}: enters without touching the rim in "
                f"{100 * plan.rim_clear_probability:.0f} % of casts like this"
            )
        if not outcome.is_caught and i < len(executed):
            out.print(f"cup {_position(plan.cup)}: missed; the next cast starts anew, from rest at home")
        if outcome.limits_hit:
            out.print(f"cup {_position(plan.cup)}: the arm meets the limit of {', '.join(outcome.limits_hit)}")
        if outcome.return_faults:
            out.print(f"cup {_position(plan.cup)}: on the way home, {', '.join(outcome.return_faults)}")


def print_plans(plans: Sequence[Plan]) -> None:
    """Print a row for each cup."""
    table = _table(
        "cup\n[m]", "distance\n[m]", "speed\n[m/s]", "wait\n[s]", "bearing\n[deg]", "predicted\nmiss [mm]", "clear\n[%]"
    )
    for plan in plans:
        cast = plan.cast
        table.add_row(
            _position(plan.cup),
            f"{cast.distance:.4f}",
            f"{cast.speed:.4f}",
            f"{cast.wait:.4f}",
            f"{math.degrees(cast.bearing):.2f}",
            f"{1e3 * plan.predicted_miss:.1f} ({1e3 * plan.predicted_std.along:.1f})",
            f"{100 * plan.rim_clear_probability:.0f}",
        )
    out.print(table)
    out.print("in brackets: predictive standard deviation")
    out.print("clear: probability of a rim-clear entry (without touching the rim)")
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
        ("ARD length scales (distance, speed, wait)", ", ".join(f"{sigma:.3f}" for sigma in info.sigma)),
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
    table.add_row("training, validation, test casts", f"{paper.N_TRAIN}, {paper.N_VALIDATION}, {paper.N_TEST}", casts)
    table.add_row("test RMSE, one length scale [cm]", f"{100 * paper.TEST_RMSE:.2f}", f"{100 * rmse['isotropic']:.2f}")
    table.add_row("test RMSE, ARD length scales [cm]", "-", f"{100 * rmse['ard']:.2f}")
    table.add_row(
        "test RMSE, polynomial 12 [cm]", f"{100 * paper.POLYNOMIAL_RMSE:.1f}", f"{100 * rmse['polynomial_12']:.2f}"
    )
    table.add_row(
        "mean predicted miss [mm]",
        f"{1e3 * paper.PREDICTED_MISS:.1f}",
        f"{1e3 * results['predicted_miss_m']['mean']:.1f}",
    )
    table.add_row("mean executed miss [mm]", "-", "-" if miss["mean"] is None else f"{1e3 * miss['mean']:.1f}")
    caught = round(results["hit_rate"] * results["n_cups"])
    table.add_row(
        "hit rate", f"{100 * paper.HIT_RATE:.0f} %", f"{caught} of {results['n_cups']} ({low:.0%} to {high:.0%})"
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
            _offset(ring["predicted_along"], ring["predicted_std"][0]),
            _scatter(ring["along"]),
            _scatter(ring["lateral"]),
            f"{100 * ring['rim_clear_probability']:.1f}",
            f"{ring['n_caught']}/{ring['n_casts']}",
            f"{100 * low:.0f}-{100 * high:.0f}",
        )
    out.print(table)
    out.print("cup: its distance from the base axis; along: outward from its axis, lateral: to the left of it;")
    out.print("in brackets: standard deviation; clear: probability of a rim-clear entry (without touching the rim)")
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
