"""The one table: every number in it, in Markdown as in the terminal."""

import pytest
from planners.results import HitRate, PlannerComparison, Score
from planners.table import HEADINGS, caption, table_rows, to_markdown

from wam_cast.experiments.paper.results import Statistics

NOTHING = Statistics(n=0, mean=None, median=None, p95=None, max=None)


def hits(n):
    return tuple(
        HitRate(cup_kind=kind, n_caught=n - i, rate=(n - i) / 20, interval=(0.1, 0.95))
        for i, kind in enumerate("ab")
    )


def score(**changes):
    values = {
        "method": "cma-es",
        "source": "model",
        "n_cups": 20,
        "hits": hits(19),
        "executed_miss": Statistics(n=20, mean=0.002, median=0.00123, p95=0.0101, max=0.0345),
        "n_evaluations": 92.5,
        "seconds": 0.01234,
        "attempts": (),
    }
    return Score(**values | changes)


@pytest.fixture
def comparison():
    lost = score(source="simulator", n_evaluations=None, seconds=None, executed_miss=NOTHING)
    some = score(
        source="simulator", executed_miss=score().executed_miss.model_copy(update={"n": 17}), n_evaluations=30
    )
    return PlannerComparison(
        seed=7,
        n_cups=20,
        reach=(0.2631, 0.9858),
        budget=93,
        is_budget_given=False,
        n_casts=30,
        scores=(score(), some, lost),
    )


def test_a_row_says_it_all(comparison):
    assert table_rows(comparison) == [
        (
            "cma-es",
            "model",
            "19 of 20, 10% to 95%",
            "18 of 20, 10% to 95%",
            "1.2, 10.1, 34.5",
            "92.5",
            "0.012",
        ),
        (
            "cma-es",
            "simulator",
            "19 of 20, 10% to 95%",
            "18 of 20, 10% to 95%",
            "1.2, 10.1, 34.5 (17 of 20)",
            "30 casts",
            "0.012",
        ),
        ("cma-es", "simulator", "19 of 20, 10% to 95%", "18 of 20, 10% to 95%", "- (0 of 20)", "-", "-"),
    ]


def test_the_caption_names_cups_seed_budgets_and_versions(comparison):
    text = caption(comparison)
    for part in (
        "20 random cups from 0.263 to 0.986 m",
        "seed 7",
        "93 evaluations",
        "program",
        "30 casts",
        "drake 1.",
    ):
        assert part in text
    for package in ("cmaes", "bayesian-optimization", "scikit-learn", "numpy"):
        assert f"{package} " in text
    assert "program" not in caption(comparison.model_copy(update={"is_budget_given": True}))


def test_markdown_is_the_same_table(comparison):
    heading, rule, *rows, empty, below = to_markdown(comparison).splitlines()
    assert [cell.strip() for cell in heading.strip("|").split("|")] == list(HEADINGS)
    assert set(rule) == {"|", "-", " "}
    assert [tuple(cell.strip() for cell in row.strip("|").split("|")) for row in rows] == table_rows(
        comparison
    )
    assert (empty, below) == ("", caption(comparison))
