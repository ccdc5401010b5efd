"""The comparison of planners as one table."""

from __future__ import annotations

from importlib.metadata import version

from planners.results import HitRate, PlannerComparison, Score
from wam_cast.experiments.paper.results import Statistics
from wam_cast.storage.dataset_directory import current_versions

HEADINGS = (
    "planner",
    "asks the",
    "caught, nearly inelastic cup",
    "caught, lively cup",
    "executed miss: median, P95, max [mm]",
    "evaluations a cup",
    "seconds a cup",
)


def table_rows(comparison: PlannerComparison) -> list[tuple[str, ...]]:
    """Return the cells under `HEADINGS`, a row a contender."""
    return [_row(score) for score in comparison.scores]


def caption(comparison: PlannerComparison) -> str:
    """Return what was compared, how, and with which versions."""
    nearest, farthest = comparison.reach
    budget = f"{comparison.budget} evaluations of the model a search" + (
        "" if comparison.is_budget_given else ", what the program used at the median"
    )
    versions = current_versions() | {
        package: version(package) for package in ("scikit-learn", "cmaes", "bayesian-optimization")
    }
    return (
        f"{comparison.n_cups} random cups from {nearest:.3f} to {farthest:.3f} m, seed {comparison.seed}; {budget}; "
        f"{comparison.n_casts} casts a search on the simulator; evaluations and processor seconds are medians; 95 % intervals; "
        + ", ".join(f"{name} {number}" for name, number in versions.items())
    )


def to_markdown(comparison: PlannerComparison) -> str:
    """Return the table and its caption as Markdown."""
    lines = [HEADINGS, ("---",) * len(HEADINGS), *table_rows(comparison)]
    table = "\n".join(f"| {' | '.join(cells)} |" for cells in lines)
    return f"{table}\n\n{caption(comparison)}\n"


def _row(score: Score) -> tuple[str, ...]:
    unit = " casts" if score.source == "simulator" else ""
    return (
        score.method,
        score.source,
        *(_hits(hits, score.n_cups) for hits in score.hits),
        _misses(score.executed_miss, score.n_cups),
        "-" if score.n_evaluations is None else f"{score.n_evaluations:g}{unit}",
        "-" if score.seconds is None else f"{score.seconds:.2g}",
    )


def _hits(hits: HitRate, n_cups: int) -> str:
    low, high = hits.interval
    return f"{hits.n_caught} of {n_cups}, {low:.0%} to {high:.0%}"


def _misses(misses: Statistics, n_cups: int) -> str:
    """Return the numbers, and over how many cups they are if some have none."""
    numbers = [value for value in (misses.median, misses.p95, misses.max) if value is not None]
    of = "" if misses.n == n_cups else f" ({misses.n} of {n_cups})"
    return (", ".join(f"{1e3 * value:.1f}" for value in numbers) or "-") + of
