"""Tables of unknown robots, from robots whose numbers are known."""

import math

import numpy as np
import pandas as pd
import pytest

from wam_cast.experiments.transfer.one_robot import RobotStudy
from wam_cast.experiments.transfer.transfer_report import render_markdown
from wam_cast.experiments.transfer.transfer_settings import CUPS, TransferSettings
from wam_cast.experiments.transfer.transfer_summary import share_within, summarize
from wam_cast.scenario import Scenario

SETTINGS = TransferSettings.of(Scenario(), 0, quick=True)
FIRST, LIVELY, _ = CUPS


def study(seed, n=400):
    """Return a robot whose errors are normal with the deviations that are stated along, and half of them across."""
    rng = np.random.default_rng(seed)
    rows = [
        {
            "method": "prior",
            "k": k,
            "cup": cup,
            "radius": 0.6,
            "distance": 0.2,
            "speed": 0.5,
            "wait": 0.4,
            "cast_bearing": 0.0,
            "is_feasible": True,
            "error_along": (error := 0.004 * rng.standard_normal()),
            "error_across": 0.5 * 0.002 * rng.standard_normal(),
            "std_along": 0.004,
            "std_across": 0.002,
            "bias": abs(error) if cup else math.nan,
            f"status: {FIRST}": "caught" if cup % 4 else "short",
            f"status: {LIVELY}": "caught" if k == 5 else None,
            "miss": abs(error),
        }
        for k in SETTINGS.ks
        for cup in range(n)
    ]
    return RobotStudy(
        plans=pd.DataFrame(rows).assign(**{f"status: {name}": None for name in list(CUPS)[2:]}),
        first_catch=seed + 1,
        streak_end=None if seed == 2 else 11 + seed,
        n_casts=13,
    )


@pytest.fixture(scope="module")
def summary():
    return summarize(SETTINGS, {group.name: [study(0), study(1), study(2)] for group in SETTINGS.groups})


def test_biases_are_quantiles_of_those_that_came_down(summary):
    row = summary.bias.iloc[0]
    assert (row["n"], row["n_never"]) == (1200, 3)
    assert row["median"] == pytest.approx(0.674 * 0.004, rel=0.1)
    assert row["p95"] == pytest.approx(1.96 * 0.004, rel=0.1)
    assert len(summary.bias) == len(SETTINGS.groups) * len(SETTINGS.ks)


def test_hits_are_counted_in_each_cup_that_was_tried(summary):
    first = summary.hits[summary.hits["cup"] == FIRST]
    assert set(first["n_caught"]) == {900}
    assert (first["low"] < 0.75).all()
    assert (first["high"] > 0.75).all()
    lively = summary.hits[summary.hits["cup"] == LIVELY]
    assert set(lively["k"]) == {5}
    assert set(lively["rate"]) == {1.0}
    assert set(summary.hits["cup"]) == {FIRST, LIVELY}


def test_shares_within_deviations_are_those_of_normal_errors(summary):
    row = summary.calibration.iloc[0]
    assert row["along_within_1"] == pytest.approx(0.683, abs=0.04)
    assert row["along_within_2"] == pytest.approx(0.954, abs=0.02)
    assert row["across_within_1"] == pytest.approx(0.954, abs=0.02)


def test_a_robot_that_never_came_to_ten_in_a_row_counts_as_one_that_did_not(summary):
    of_group = summary.campaigns[summary.campaigns["group"] == "x1"]
    assert share_within(of_group, "streak_end", 12) == pytest.approx(2 / 3)
    assert share_within(of_group, "first_catch", 2) == pytest.approx(2 / 3)


def test_the_report_says_what_the_tables_say(summary, tmp_path):
    text = render_markdown(summary, SETTINGS, tmp_path)
    bias, hits = summary.bias.iloc[0], summary.hits.iloc[0]
    assert f"{1e3 * bias['median']:.1f}, {1e3 * bias['p95']:.1f}, {1e3 * bias['max']:.1f} (3 never came down)" in text
    assert f"{hits['n_caught']} of {hits['n']} ({100 * hits['low']:.1f} % to {100 * hits['high']:.1f} %)" in text
    assert "| x1 | 3 | 67 % | 3 | 67 % | 11.5 |" in text
    assert "nan" not in text
