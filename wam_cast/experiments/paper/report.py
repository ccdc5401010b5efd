"""The report: figures, `results.json`, Markdown, and one HTML page with the figures inside."""

from __future__ import annotations

import math
import platform
from collections.abc import Iterable
from pathlib import Path

import numpy as np

from wam_cast.cast import PARAMETERS, cast_bounds
from wam_cast.experiments.frames import Record
from wam_cast.experiments.paper import published as paper
from wam_cast.experiments.paper.findings import Findings, clear_radius
from wam_cast.experiments.paper.report_figures import CAPTIONS
from wam_cast.experiments.paper.settings import PAPERS_PLANNER, Settings
from wam_cast.experiments.report_pages import report_environment, write_pages
from wam_cast.parallel.workers import available_processors
from wam_cast.planning.solution import LONGEST_MISS
from wam_cast.scenario import Scenario
from wam_cast.simulation.outcome import Status
from wam_cast.storage.run_directory import RunDirectory

FAILURES: dict[str, str] = {
    "short": "short",
    "long": "long",
    "side": "to the side",
    "rim_bounce": "bounced off the rim",
    "came_out": "came out again",
    "hanging": "hung in a taut string",
    "not_settled": "did not come to rest",
    "limit_hit": "limit of the arm hit",
    "never_crossed": "never came down",
    "diverged": "simulation diverged",
    "stopped": "stopped by the arm",
}
"""Kinds of failure in words."""

FAST_SPEED = 0.7
"""Mean speed of a move [m/s] beyond which the report counts it as fast."""

EDGE_SHARE = 0.05
"""Share of a parameter's range that the report counts as its edge."""

ALIKE_FACTOR = 1.2
"""Errors that differ by no more than this factor are called alike."""


def write_report(findings: Findings, directory: RunDirectory) -> None:
    """Write the report's files around the figures that are there; what was there before is replaced."""
    results = findings.to_json(directory.wall_seconds())
    write_pages(results, render_markdown(results, findings.settings, directory.path), directory.path)


def render_markdown(results: Record, settings: Settings, folder: Path) -> str:
    """Return the report as Markdown: every number in it is one of `results.json`, and every conclusion follows from them.

    `results` is the content of `results.json`; the report lies in `folder`, and its figures in `folder / "figures"`.
    """
    environment = report_environment(Path(__file__).parent)
    environment.filters |= {"power": _power, "listing": _listing}
    scenario = settings.scenario
    return environment.get_template("report.md.j2").render(
        f=results,
        s=settings,
        scenario=scenario,
        paper=paper,
        papers_planner=PAPERS_PLANNER,
        row={row["name"]: row for row in results["comparison"]["rows"]},
        planner_stop=LONGEST_MISS,
        clear=clear_radius(scenario),
        platform=f"{platform.system()} {platform.machine()}, {available_processors()} processors",
        command=settings.command(folder),
        captions=CAPTIONS,
        failures=FAILURES,
        explain=lambda trial, others: explain(trial, scenario, others),
        worst=worst_casts(results["comparison"]["held_out"], scenario),
        learning=least_errors(results["learning_curves"]),
        fast=FAST_SPEED,
        edge=EDGE_SHARE,
        alike=ALIKE_FACTOR,
    )


def worst_casts(held_out: Record, scenario: Scenario) -> dict[str, float]:
    """Return shares of the casts of largest error: `fast`, and at the `edge` of a bound; `all_fast` is that of all casts."""
    error = np.abs(held_out["residual"])
    worst = np.argsort(error)[len(error) - round(held_out["worst"] * len(error)) :]
    lower, upper = cast_bounds(scenario)
    places = (np.column_stack([held_out[name] for name in PARAMETERS]) - lower) / (upper - lower)
    is_fast = np.array(held_out["speed"]) > FAST_SPEED
    is_at_edge = np.any((places < EDGE_SHARE) | (places > 1 - EDGE_SHARE), axis=1)
    return {
        "fast": float(np.mean(is_fast[worst])),
        "all_fast": float(np.mean(is_fast)),
        "edge": float(np.mean(is_at_edge[worst])),
    }


def least_errors(learning_curves: Record) -> Record:
    """Return what the learning curves say.

    `least`: the estimators that have the least median error at some size, each with those sizes; `alike`: those whose error with
    all casts is within `ALIKE_FACTOR` of the least.
    """
    sizes = learning_curves["n_train"]
    curves = {label: band["median"] for label, band in learning_curves["curves"].items()}
    least: dict[str, list[int]] = {}
    for i, size in enumerate(sizes):
        least.setdefault(min(curves, key=lambda label: curves[label][i]), []).append(size)
    bound = ALIKE_FACTOR * min(median[-1] for median in curves.values())
    return {"least": least, "alike": [label for label, median in curves.items() if median[-1] <= bound]}


def explain(trial: Record, scenario: Scenario, others: str = "the model") -> str:
    """Return in words why a cast missed: what the plan, what `others` and what the entry had to do with it.

    `trial` is one of `results.json`.
    """
    if trial["status"] == Status.DIVERGED:
        return "its simulation diverged"
    if trial["limits_hit"]:
        return f"the arm met the limit of {', '.join(trial['limits_hit'])}"
    if trial["executed_offset"] is None:
        return "the ball never came down to the rim plane"
    if trial["is_feasible"]:
        plan = f"the planner terminated at {_signed_mm(trial['predicted_offset'])} mm from the middle"
    elif trial["predicted_miss"] <= LONGEST_MISS:
        plan = "the planner found no cast that lets the ball rest in the cup"
    else:
        plan = (
            f"the planner found no cast within {1e3 * LONGEST_MISS:g} mm and kept its best one, "
            f"{1e3 * trial['predicted_miss']:.1f} mm off"
        )
    error = trial["executed_offset"] - trial["predicted_offset"]
    return (
        f"{plan}; {others} added {_signed_mm(error)} mm along and {_signed_mm(trial['executed_across'])} mm across; the ball came "
        f"in {1e3 * trial['executed_miss']:.1f} mm from the middle, at {math.degrees(trial['entry_angle']):.0f}° from the "
        f"vertical; a ball that falls straight down clears the rim up to {1e3 * clear_radius(scenario):.0f} mm from the middle"
    )


def _signed_mm(value: float) -> str:
    # Adding 0 turns a rounded -0 into 0.
    return f"{round(1e3 * value, 1) + 0:+.1f}"


def _power(value: float) -> str:
    """Return a number of any size, with a power of ten where it is small or large."""
    if 0.01 <= abs(value) < 1000:
        return f"{value:.3g}"
    mantissa, exponent = f"{value:.1e}".split("e")
    return f"{mantissa}·10^{int(exponent)}"


def _listing(words: Iterable[str]) -> str:
    """Return words as a sentence lists them: a, b and c."""
    *first, last = map(str, words)
    return f"{', '.join(first)} and {last}" if first else last
