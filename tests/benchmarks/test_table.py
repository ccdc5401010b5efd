"""The one table: every number in it, in Markdown as in the terminal."""

from dataclasses import replace

import numpy as np
import pandas as pd
import pytest
from planners.study import PlannerComparison
from planners.table import HEADINGS, caption, table_rows, to_markdown

MISSES = np.full(20, 0.00123)
"""By their median, 95th percentile and maximum 1.2, 10.2 and 34.5 mm."""
MISSES[-2:] = 0.00887, 0.0345


def trials(source, n_lost=0, **changes):
    """Return 20 cups of each kind, of which the lively one loses one ball more; the last `n_lost` never came down."""
    misses = np.concatenate([np.full(n_lost, np.nan), MISSES[n_lost:]])
    kinds = (("nearly inelastic", 19), ("lively", 18))
    values = {"label": "cma-es", "source": source, "miss": misses, "n_evaluations": 92.5, "seconds": 0.01234}
    values |= changes
    return pd.concat([pd.DataFrame(values | {"cup_kind": kind, "is_caught": np.arange(20) < n}) for kind, n in kinds])


@pytest.fixture
def comparison():
    return PlannerComparison(
        trials=trials("model"), seed=7, n_cups=20, reach=(0.2631, 0.9858), budget=93, is_budget_given=False, n_casts=30
    )


def test_a_row_says_it_all(comparison):
    caught = ("19 of 20, 76% to 99%", "18 of 20, 70% to 97%")
    assert table_rows(comparison) == [("cma-es", "model", *caught, "1.2, 10.2, 34.5", "92.5", "0.012")]
    for found, cells in (
        (trials("simulator", 3, n_evaluations=30.0), ("1.2, 14.0, 34.5 (17 of 20)", "30 casts", "0.012")),
        (trials("simulator", 20, n_evaluations=np.nan, seconds=np.nan), ("- (0 of 20)", "-", "-")),
    ):
        assert table_rows(replace(comparison, trials=found)) == [("cma-es", "simulator", *caught, *cells)]


def test_contenders_keep_their_order(comparison):
    both = pd.concat([trials("simulator"), trials("model")])
    assert [row[1] for row in table_rows(replace(comparison, trials=both))] == ["simulator", "model"]


def test_the_caption_names_cups_seed_budgets_and_versions(comparison):
    text = caption(comparison)
    for part in ("20 random cups from 0.263 to 0.986 m", "seed 7", "93 evaluations", "program", "30 casts", "drake 1."):
        assert part in text
    for package in ("cmaes", "bayesian-optimization", "scikit-learn", "numpy"):
        assert f"{package} " in text
    assert "program" not in caption(replace(comparison, is_budget_given=True))


def test_markdown_is_the_same_table(comparison):
    heading, rule, *rows, empty, below = to_markdown(comparison).splitlines()
    assert [cell.strip() for cell in heading.strip("|").split("|")] == list(HEADINGS)
    assert set(rule) == {"|", "-", " "}
    assert [tuple(cell.strip() for cell in row.strip("|").split("|")) for row in rows] == table_rows(comparison)
    assert (empty, below) == ("", caption(comparison))
