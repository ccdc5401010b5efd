"""What trials come to, and why they missed, in words."""

import math

import pandas as pd
import pytest

import wam_cast as wc
from wam_cast.experiments.paper.findings import by_label, summarize
from wam_cast.experiments.paper.report import explain
from wam_cast.scenario import Scenario

NOWHERE = {"executed_offset": None, "executed_across": None, "executed_miss": None}


def trial(**changes):
    values = {
        "label": "label",
        "planner": "gradient",
        "radius": 0.6,
        "distance": 0.3,
        "speed": 0.5,
        "wait": 0.1,
        "is_feasible": True,
        "predicted_offset": 0.006,
        "predicted_miss": 0.006,
        "landing_along": 0.614,
        "landing_across": 0.002,
        "miss": 0.014,
        "entry_angle": 0.5,
        "status": "rim_bounce",
        "limits_hit": (),
    }
    values |= changes
    return values | {"is_caught": values["status"] == "caught"}


def record(**changes):
    ((one,),) = (found["trials"] for found in by_label(pd.DataFrame([trial()]), Scenario()))
    return one | changes


def test_summary_counts_failures_by_kind():
    caught = trial(status="caught", miss=0.004)
    lucky = trial(status="caught", is_feasible=False, miss=0.012)
    trials = [caught, lucky, trial(), trial(status="short"), trial(status="long", is_feasible=False)]
    found = summarize(pd.DataFrame(trials), Scenario())
    assert (found["n_cups"], found["n_caught"], found["hit_rate"]) == (5, 2, 0.4)
    assert found["failures"] == {"long": 1, "rim_bounce": 1, "short": 1}
    assert sum(found["failures"].values()) == found["n_cups"] - found["n_caught"]
    assert (found["n_no_plan"], found["n_no_plan_caught"]) == (2, 1)
    assert found["n_touched"] == 1  # the lucky one: the ball clears the rim by 10 mm


def test_misses_are_those_of_the_trials():
    found = summarize(pd.DataFrame([trial(miss=m) for m in (0.001, 0.002, 0.006)]), Scenario())
    assert found["executed_miss"]["mean"] == pytest.approx(0.003)
    assert found["executed_miss"]["median"] == pytest.approx(0.002)
    assert found["predicted_miss"]["max"] == pytest.approx(0.006)


def test_each_label_has_its_own_trials_in_the_order_in_which_they_came():
    trials = pd.DataFrame([trial(label=label, radius=0.1 * i) for i, label in enumerate("bbab")])
    first, second = by_label(trials, Scenario())
    assert [(one["label"], one["n_cups"]) for one in (first, second)] == [("b", 3), ("a", 1)]
    assert [one["cup"] for one in first["trials"]] == pytest.approx([0.0, 0.1, 0.3])


def test_offsets_are_counted_from_the_cup_along_the_casting_plane():
    found = record()
    assert (found["cup"], found["predicted_offset"]) == (0.6, 0.006)
    assert found["executed_offset"] == pytest.approx(0.014)
    assert (found["executed_across"], found["executed_miss"]) == (0.002, 0.014)


def test_explanation_adds_up():
    text = explain(record(), wc.Scenario())
    assert "+6.0 mm" in text  # the plan
    assert "+8.0 mm along" in text  # the model
    assert "+2.0 mm across" in text
    assert "14.0 mm from the middle" in text  # all of it
    assert f"{math.degrees(0.5):.0f}°" in text
    assert "29°" in text
    assert "clears the rim up to 10 mm from the middle" in text


def test_explanation_names_what_else_went_wrong():
    scenario = wc.Scenario()
    assert "joint 4 speed" in explain(record(limits_hit=["joint 4 speed"]), scenario)
    assert "found no cast within 10 mm" in explain(record(is_feasible=False, predicted_miss=0.02), scenario)
    hangs = record(is_feasible=False, predicted_miss=0.002)
    assert "found no cast that lets the ball rest in the cup" in explain(hangs, scenario)
    assert "never came down" in explain(record(**NOWHERE), scenario)
    diverged = record(status="diverged", limits_hit=["joint 2 speed"], **NOWHERE)
    assert explain(diverged, scenario) == "its simulation diverged"
