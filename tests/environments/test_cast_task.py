"""Where cups stand, which casts actions are, and what a cast is worth."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from wam_cast.arm.arm_model import arm_model
from wam_cast.cast import Cast, is_allowed
from wam_cast.casting_plane import to_polar
from wam_cast.environments.cast_task import RADII, CastTask, reward
from wam_cast.errors import InputError
from wam_cast.scenario import Scenario

SLOW_MOVES = Scenario.from_dict({"motion": {"min_move_duration": 0.3}})
TASK = CastTask(SLOW_MOVES)


@given(st.lists(st.floats(-1, 1), min_size=4, max_size=4))
def test_every_action_is_an_allowed_cast_and_back(action):
    cast = TASK.cast(action)
    assert is_allowed(SLOW_MOVES, cast.to_array())
    again = TASK.cast(TASK.action(cast))
    np.testing.assert_allclose([*again.to_array(), again.bearing], [*cast.to_array(), cast.bearing], atol=1e-12)


def test_the_ends_of_actions_are_the_ends_of_casts():
    low, high = (TASK.cast(np.full(4, end)) for end in (-1.0, 1.0))
    bearings = arm_model(SLOW_MOVES.arm).bearing_limits
    assert (low.wait, high.wait) == SLOW_MOVES.bounds.wait
    assert high.distance == SLOW_MOVES.bounds.distance[1]
    assert (low.bearing, high.bearing) == pytest.approx((bearings[0] + 0.01, bearings[1] - 0.01))
    assert TASK.cast(np.full(4, 7.0)) == high
    # The shortest move that is allowed at its highest speed lasts as long as it must.
    fastest = TASK.cast([-0.5, 1.0, 0.0, 0.0])
    assert fastest.move_duration == pytest.approx(0.3)


def test_cups_are_evenly_distributed_over_distance_and_bearing():
    rng = np.random.default_rng(0)
    polar = np.array([to_polar(TASK.draw_cup(rng)) for _ in range(500)])
    for values, (low, high) in zip(polar.T, (RADII, TASK.bearings), strict=True):
        share = np.sort((values - low) / (high - low))
        assert np.abs(share - np.linspace(0, 1, len(share))).max() < 0.08  # Kolmogorov and Smirnov at 0.3 %


def test_a_cast_is_worth_a_hit_less_its_miss():
    assert reward(True, 0.004) == pytest.approx(0.996)
    assert reward(False, 0.2) == pytest.approx(-0.2)
    assert reward(False, math.nan) == reward(False, 3.0) == -1.0


@pytest.mark.parametrize("radii", [(0.9, 0.3), (0.3,), (0.0, 0.5), (0.3, math.nan), 0.5, ("a", "b"), (0.5, 1e9)])
def test_wrong_radii_are_one_line(radii):
    with pytest.raises(InputError, match="radii = ") as caught:
        CastTask(Scenario(), radii)
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize("action", [[0, 0, 0], [0, 0, 0, math.nan], "abcd", None, [[0, 0, 0, 0]]])
def test_wrong_actions_are_one_line(action):
    with pytest.raises(InputError, match="must be 4 finite numbers from -1 to 1"):
        TASK.cast(action)


def test_a_cup_is_placed_by_options():
    assert TASK.cup_of({"cup": (0.5, -0.2)}) == (0.5, -0.2)
    assert TASK.cup_of(None) is TASK.cup_of({}) is None
    for options, line in (({"cop": 1}, "'cop' is unknown"), ({"cup": (2.0, 0.0)}, "outside"), ({"cup": 3}, "the pair")):
        with pytest.raises(InputError, match=line):
            TASK.cup_of(options)


def test_a_cast_at_home_is_an_action_too():
    assert TASK.action(Cast(0.3, 0.6, 0.1, 0.0))[3] == pytest.approx(0.0)
