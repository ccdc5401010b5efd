"""Trials: where cups are drawn, how often they are hit, and whether a ball entered clear."""

import math
from types import SimpleNamespace

import numpy as np
import pytest

from wam_cast.arm_model import bearing_limits
from wam_cast.cast import Cast
from wam_cast.experiments import trials as module
from wam_cast.experiments.statistics import wilson_interval
from wam_cast.experiments.trials import Trial, draw_cups, entered_clear, execute, summarize
from wam_cast.planning.landing_distribution import clear_half_width, clear_offset
from wam_cast.planning.reach import Reach
from wam_cast.scenario import Scenario
from wam_cast.simulation.outcome import Status

REACH = Reach(0.4, 0.8, *bearing_limits())


def fake(landing, status=Status.CAUGHT, entry_angle=0.2):
    landing = np.array(landing, dtype=float)
    return SimpleNamespace(
        landing=landing,
        status=status,
        is_caught=status is Status.CAUGHT,
        entry_angle=entry_angle,
        miss=math.nan,
    )


def trial(cup=(0.7, 0.0), bearing=0.0):
    return Trial(Cast(0.3, 0.6, 0.1, bearing), cup)


@pytest.mark.parametrize("region", ["line", "floor"])
def test_cups_are_drawn_from_all_of_the_reach(region):
    cups = draw_cups(REACH, 200, 3, region)
    distances = [math.hypot(*cup) for cup in cups]
    assert (min(distances), max(distances)) == pytest.approx((0.4, 0.8), abs=0.01)
    assert draw_cups(REACH, 20, 3, region) == cups[:20]
    assert not set(cups) & set(draw_cups(REACH, 200, 4, region))


def test_on_the_floor_they_are_at_all_bearings_and_as_far_away():
    line, floor = (draw_cups(REACH, 200, 3, region) for region in ("line", "floor"))
    assert all(y == 0 for _, y in line)
    np.testing.assert_allclose([math.hypot(*cup) for cup in floor], [x for x, _ in line])
    bearings = [math.atan2(y, x) for x, y in floor]
    assert (min(bearings), max(bearings)) == pytest.approx(bearing_limits(), abs=0.1)
    assert abs(np.mean(bearings)) < 0.3


def test_every_trial_counts(monkeypatch):
    outcomes = [fake((0.7, 0.002)), None, fake((0.71, -0.001), Status.RIM_BOUNCE), fake((0.7, 0.0))]
    hits = summarize([trial()] * 4, outcomes)
    assert (hits.n_cups, hits.n_caught) == (4, 2)
    assert hits.interval == wilson_interval(2, 4)
    assert hits.failures == {"lost": 1, "rim_bounce": 1}
    assert (hits.lateral.max, hits.lateral.n) == (pytest.approx(0.002), 3)


@pytest.mark.parametrize("bearing", [0.0, 1.1, -2.4])
def test_lateral_is_beside_the_line_from_the_axis_to_the_cup(bearing):
    c, s = math.cos(bearing), math.sin(bearing)
    there = trial((0.7 * c, 0.7 * s), bearing)
    landing = (0.72 * c - 0.003 * s, 0.72 * s + 0.003 * c)
    assert summarize([there], [fake(landing)]).lateral.max == pytest.approx(0.003)


@pytest.mark.parametrize("bearing", [0.0, 1.1])
@pytest.mark.parametrize("share", [0.0, 0.5, -0.8])
def test_a_ball_is_clear_up_to_the_clear_width(bearing, share):
    c, s = math.cos(bearing), math.sin(bearing)
    R = np.array([[c, -s], [s, c]])
    there = trial(tuple(R @ [0.7, 0.0]), bearing)
    along = share * clear_offset(Scenario(), 0.5)
    (width,) = clear_half_width(Scenario(), 0.5, np.array([along]))
    for across, is_clear in ((0.98 * width, True), (-0.98 * width, True), (1.02 * width, False)):
        landing = R @ [0.7 + along, across]
        assert entered_clear(Scenario(), there, fake(landing, entry_angle=0.5)) is is_clear


def test_no_ball_is_clear_that_never_came_or_is_too_wide():
    assert not entered_clear(Scenario(), trial(), None)
    assert not entered_clear(Scenario(), trial(), fake((math.nan, math.nan), entry_angle=math.nan))
    assert not entered_clear(Scenario(), trial(), fake((0.7, 0.0), entry_angle=1.0))


class InOrder:
    def run(self, function, rows):
        yield from map(function, rows)


def test_each_trial_is_executed_with_its_cup_and_its_noise(monkeypatch):
    told = []
    monkeypatch.setattr(
        module, "simulate_cast", lambda *arguments, noise_seed: told.append((*arguments, noise_seed))
    )
    both = [Trial(Cast(0.3, 0.6, 0.1), (0.7, 0.0), 5), Trial(Cast(0.2, 0.6, 0.1), (0.6, 0.1), 6)]
    done = []
    execute(Scenario(), both, InOrder(), done.append)
    assert told == [(Scenario(), one.cast, one.cup, one.noise_seed) for one in both]
    assert done == [1, 2]
