"""The comparison of planners as one table."""

from __future__ import annotations

from importlib.metadata import version

import pandas as pd

from planners.study import CUP_KINDS, PlannerComparison
from wam_cast.experiments.statistics import Statistics, describe
from wam_cast.experiments.trials import hits
from wam_cast.storage.manifest import current_versions

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
    contenders = comparison.trials.groupby(["label", "source"], sort=False)
    return [_row(method, source, trials) for (method, source), trials in contenders]


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


def _row(method: str, source: str, trials: pd.DataFrame) -> tuple[str, ...]:
    unit = " casts" if source == "simulator" else ""
    # The choice and where the ball lands do not depend on the kind of cup.
    by_kind = {kind: trials[trials["cup_kind"] == kind] for kind in CUP_KINDS}
    first = next(iter(by_kind.values()))
    n_evaluations, seconds = first["n_evaluations"].median(), first["seconds"].median()
    return (
        method,
        source,
        *(_hits(group) for group in by_kind.values()),
        _misses(describe(first["miss"].to_numpy()), len(first)),
        "-" if pd.isna(n_evaluations) else f"{n_evaluations:g}{unit}",
        "-" if pd.isna(seconds) else f"{seconds:.2g}",
    )


def _hits(trials: pd.DataFrame) -> str:
    found = hits(trials)
    low, high = found["hit_interval"]
    return f"{found['n_caught']} of {found['n_cups']}, {low:.0%} to {high:.0%}"


def _misses(misses: Statistics, n_cups: int) -> str:
    """Return the numbers, and over how many cups they are if some have none."""
    numbers = [value for value in (misses["median"], misses["p95"], misses["max"]) if value is not None]
    of = "" if misses["n"] == n_cups else f" ({misses['n']} of {n_cups})"
    return (", ".join(f"{1e3 * value:.1f}" for value in numbers) or "-") + of
