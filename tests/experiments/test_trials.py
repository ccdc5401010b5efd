"""Trials: where cups are drawn, how often they are hit, and whether a ball entered rim-clear."""

import math
from types import SimpleNamespace

import numpy as np
import pandas as pd
import pytest

import wam_cast as wc
from wam_cast.arm.arm_model import arm_model
from wam_cast.cast import Cast
from wam_cast.casting_plane import from_polar
from wam_cast.experiments import trials as module
from wam_cast.experiments.statistics import wilson_interval
from wam_cast.experiments.trials import (
    Thrower,
    Trial,
    draw_cups,
    execute,
    failures,
    hits,
    line_of_cups,
    plan_and_execute,
    trial_row,
)
from wam_cast.parallel.seeds import Purpose, derived_seed
from wam_cast.parallel.workers import Workers
from wam_cast.planning.landing_distribution import clearance, clearance_across
from wam_cast.planning.reach import Reach
from wam_cast.scenario import Arm, Scenario
from wam_cast.simulation.outcome import Status

REACH = Reach(0.4, 0.8, *arm_model(Arm()).bearing_limits)


def fake(landing, status=Status.CAUGHT, entry_angle=0.2):
    landing = np.array(landing, dtype=float)
    return SimpleNamespace(
        landing=landing,
        landing_along=math.nan,
        landing_across=math.nan,
        status=status,
        is_caught=status is Status.CAUGHT,
        entry_angle=entry_angle,
        miss=math.nan,
        is_slack=True,
        slack=0.02,
        peak_torque_utilization=np.linspace(0.1, 0.7, 7),
        peak_velocity_utilization=np.linspace(0.6, 0.0, 7),
        limits_hit=(),
    )


def trial(cup=(0.7, 0.0), bearing=0.0):
    return Trial(Cast(0.3, 0.6, 0.1, bearing), cup)


def frame(trials, outcomes):
    return pd.DataFrame([trial_row(Scenario(), *pair) for pair in zip(trials, outcomes, strict=True)])


@pytest.mark.parametrize("region", ["line", "floor"])
def test_cups_are_drawn_from_all_of_the_reach(region):
    cups = draw_cups(REACH, 200, 3, region)
    distances = [distance for distance, _ in cups]
    assert (min(distances), max(distances)) == pytest.approx((0.4, 0.8), abs=0.01)
    assert draw_cups(REACH, 20, 3, region) == cups[:20]
    assert not set(cups) & set(draw_cups(REACH, 200, 4, region))


def test_on_the_floor_they_are_at_all_bearings_and_as_far_away():
    line, floor = (draw_cups(REACH, 200, 3, region) for region in ("line", "floor"))
    assert all(bearing == 0 for _, bearing in line)
    assert [distance for distance, _ in floor] == [distance for distance, _ in line]
    bearings = [bearing for _, bearing in floor]
    assert (min(bearings), max(bearings)) == pytest.approx(arm_model(Arm()).bearing_limits, abs=0.1)
    assert abs(np.mean(bearings)) < 0.3


def test_every_trial_counts(monkeypatch):
    outcomes = [
        fake((0.7, 0.002)),
        fake((math.nan, math.nan), Status.DIVERGED),
        fake((0.71, -0.001), Status.RIM_BOUNCE),
        fake((0.7, 0.0)),
    ]
    trials = frame([trial()] * 4, outcomes)
    expected = {"n_cups": 4, "n_caught": 2, "hit_rate": 0.5, "hit_interval": wilson_interval(2, 4)}
    assert hits(trials) == expected
    assert failures(trials) == {"diverged": 1, "rim_bounce": 1}
    assert (trials["lateral"].abs().max(), trials["lateral"].count()) == (pytest.approx(0.002), 3)


def test_a_row_has_the_largest_utilization_of_any_joint():
    row = trial_row(Scenario(), trial(), fake((0.7, 0.0)))
    assert (row["peak_torque_utilization"], row["peak_velocity_utilization"]) == (0.7, 0.6)


@pytest.mark.parametrize("bearing", [0.0, 1.1, -2.4])
def test_lateral_is_beside_the_line_from_the_axis_to_the_cup(bearing):
    c, s = math.cos(bearing), math.sin(bearing)
    there = trial((0.7, bearing), bearing)
    landing = (0.72 * c - 0.003 * s, 0.72 * s + 0.003 * c)
    row = trial_row(Scenario(), there, fake(landing))
    assert (row["along"], row["lateral"]) == (pytest.approx(0.02), pytest.approx(0.003))


@pytest.mark.parametrize("bearing", [0.0, 1.1])
@pytest.mark.parametrize("share", [0.0, 0.5, -0.8])
def test_a_ball_is_clear_up_to_the_clear_width(bearing, share):
    c, s = math.cos(bearing), math.sin(bearing)
    R = np.array([[c, -s], [s, c]])
    there = trial((0.7, bearing), bearing)
    along = share * clearance(Scenario(), 0.5)
    (width,) = clearance_across(Scenario(), 0.5, np.array([along]))
    for across, is_clear in ((0.98, True), (-0.98, True), (1.02, False), (-1.02, False)):
        landing = R @ [0.7 + along, across * width]
        row = trial_row(Scenario(), there, fake(landing, entry_angle=0.5))
        assert row["entered_rim_clear"] is is_clear


def test_no_ball_is_clear_that_never_came_or_is_too_wide():
    nowhere, too_wide = fake((math.nan, math.nan), entry_angle=math.nan), fake((0.7, 0.0), entry_angle=1.0)
    for outcome in (nowhere, too_wide):
        assert not trial_row(Scenario(), trial(), outcome)["entered_rim_clear"]


class InOrder:
    def run(self, function, rows):
        yield from map(function, rows)


def test_each_trial_is_executed_with_its_cup_and_its_noise(monkeypatch):
    told = []

    def simulate(*arguments, noise_seed):
        told.append((*arguments, noise_seed))
        return fake((0.7, 0.0))

    monkeypatch.setattr(module, "simulate_cast", simulate)
    both = [Trial(Cast(0.3, 0.6, 0.1), (0.7, 0.0), 5), Trial(Cast(0.2, 0.6, 0.1), (0.6, 0.1), 6)]
    done = []
    found = execute(Scenario(), both, InOrder(), report=done.append)
    assert told == [(Scenario(), one.cast, from_polar(*one.cup), one.noise_seed) for one in both]
    assert done == [1, 2]
    assert found["noise_seed"].tolist() == [5, 6]


# --- plans that are executed


def test_a_row_is_its_plan_and_its_outcome():
    model = wc.reference_model()
    plan = wc.plan_cast(model, (0.6, 0.0), "gradient")
    outcome = wc.simulate_cast(Scenario(), plan.cast, plan.cup)
    row = trial_row(Scenario(), Trial(plan.cast, (0.6, 0.0), label="a", plan=plan), outcome)
    assert (row["label"], row["planner"], row["is_feasible"]) == ("a", "gradient", True)
    assert row["predicted_miss"] == plan.predicted_miss
    assert abs(row["predicted_offset"]) == pytest.approx(plan.predicted_miss, abs=1e-6)
    assert (row["std_along"], row["std_across"]) == plan.predicted_std
    assert row["rim_clear_probability"] == plan.rim_clear_probability
    assert row["miss"] == outcome.miss
    assert abs(row["along"]) == pytest.approx(outcome.miss, abs=1e-5)
    assert (row["landing_along"], row["slack"]) == (outcome.landing_along, outcome.slack)
    assert row["status"] == "caught"


def test_cups_lie_evenly_over_the_reach(no_physics):
    model = wc.reference_model()
    throwers = [Thrower(*named, model, line_of_cups(model, 6)) for named in (("a", "gradient"), ("b", "program"))]
    seen = []
    found = plan_and_execute(Scenario(), throwers, executor=Workers(), report=lambda *done: seen.append(done))
    assert found["label"].tolist() == ["a"] * 6 + ["b"] * 6
    assert found["planner"].tolist() == ["gradient"] * 6 + ["program"] * 6
    for _, group in found.groupby("label"):
        cups = group["radius"].to_numpy()
        assert cups[[0, -1]] == pytest.approx(model.reach)
        assert np.diff(cups) == pytest.approx(np.diff(cups)[0])
    assert found["radius"][2] == found["radius"][8]
    assert seen == [(done, 24) for done in range(25)]  # plans, then casts


def test_every_cup_has_noise_of_its_own_and_every_thrower_the_same(no_physics):
    def seeds(seed):
        model = wc.reference_model()
        throwers = [Thrower(name, "gradient", model, line_of_cups(model, 3)) for name in "ab"]
        return plan_and_execute(Scenario(), throwers, seed=seed, executor=Workers())["noise_seed"].tolist()

    first = seeds(7)
    assert first == [derived_seed(7, Purpose.NOISE, cup) for cup in range(3)] * 2
    assert len(set(first)) == 3
    assert not set(first) & set(seeds(8))
