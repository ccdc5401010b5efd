"""The decision vector: what it accepts, its array, and the casts that a scenario allows."""

import dataclasses

import numpy as np
import pytest

from wam_cast.cast import Cast, cast_bounds, checked_cup, is_allowed, nearest_allowed
from wam_cast.errors import InputError
from wam_cast.scenario import Scenario


def test_array_round_trip_keeps_the_cast_and_its_order():
    cast = Cast(distance=0.3, speed=0.6, wait=0.1, bearing=-0.4)
    np.testing.assert_array_equal(cast.to_array(), [0.3, 0.6, 0.1])
    assert Cast.from_array(cast.to_array(), cast.bearing) == cast
    assert Cast.from_array(cast.to_array()).bearing == 0.0


def test_array_is_the_callers_own():
    cast = Cast(0.3, 0.6, 0.1)
    cast.to_array()[0] = 9.0
    assert cast.distance == 0.3


def test_speed_is_the_mean_of_the_move():
    assert Cast(0.3, 0.6, 0.1).move_duration == pytest.approx(0.5)


def test_cast_is_frozen_and_hashable():
    cast = Cast(0.3, 0.6, 0.1)
    with pytest.raises(dataclasses.FrozenInstanceError):
        cast.speed = 1.0
    assert len({cast, Cast(0.3, 0.6, 0.1), Cast(0.3, 0.6, 0.2)}) == 2


@pytest.mark.parametrize("name", ["distance", "speed", "wait", "bearing"])
@pytest.mark.parametrize("value", [float("nan"), float("inf"), -float("inf")])
def test_values_that_are_not_finite_are_refused_by_name(name, value):
    with pytest.raises(InputError, match=f"{name} = .*finite"):
        Cast(**{"distance": 0.3, "speed": 0.6, "wait": 0.1, "bearing": 0.0, name: value})


@pytest.mark.parametrize(("name", "value"), [("distance", 0.0), ("speed", -0.1), ("wait", -1e-9)])
def test_values_out_of_range_are_refused_in_one_line(name, value):
    with pytest.raises(InputError) as caught:
        Cast(**{"distance": 0.3, "speed": 0.6, "wait": 0.1, name: value})
    assert f"{name} = {value:g}" in str(caught.value)
    assert "positive" in str(caught.value)
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize(
    ("name", "value"), [("distance", 1e300), ("speed", 1e9), ("bearing", 1e308), ("bearing", -7.0)]
)
def test_values_beyond_any_arm_are_refused_in_one_line(name, value):
    with pytest.raises(InputError, match=f"{name} = .*; choose at most") as caught:
        Cast(**{"distance": 0.3, "speed": 0.6, "wait": 0.1, name: value})
    assert len(str(caught.value)) < 120


def test_no_wait_is_allowed():
    assert Cast(0.3, 0.6, 0.0).wait == 0.0


def test_bounds_come_in_the_order_of_the_array():
    lower, upper = cast_bounds(Scenario.from_dict({"bounds": {"wait": [0.1, 0.2]}}))
    np.testing.assert_array_equal(lower, [0.05, 0.21, 0.1])
    np.testing.assert_array_equal(upper, [0.40, 0.85, 0.2])


def test_allowed_casts_keep_the_bounds_and_the_shortest_move():
    parameters = np.array(
        [
            [0.30, 0.60, 0.10],
            [0.40, 0.85, 0.50],  # a corner of the bounds
            [0.41, 0.60, 0.10],  # too long
            [0.30, 0.20, 0.10],  # too slow
            [0.30, 0.60, 0.51],  # waits too long
            [0.10, 0.50, 0.10],  # lasts the shortest duration exactly
            [0.10, 0.51, 0.10],  # lasts less
        ]
    )
    expected = [True, True, False, False, False, True, False]
    np.testing.assert_array_equal(is_allowed(Scenario(), parameters), expected)
    np.testing.assert_array_equal(is_allowed(Scenario(), parameters.reshape(7, 1, 3))[:, 0], expected)
    assert is_allowed(Scenario(), parameters[0])


@pytest.mark.parametrize("shortest", [0.2, 0.5, 0.62, 0.4 / 0.21 - 1e-6])
def test_the_nearest_allowed_cast_is_allowed_and_an_allowed_one_is_its_own(shortest):
    scenario = Scenario.from_dict({"motion": {"min_move_duration": shortest}})
    rng = np.random.default_rng(0)
    for parameters in rng.uniform([-0.1, 0, -0.2], [0.6, 1.2, 0.8], size=(300, 3)):
        nearest = nearest_allowed(scenario, parameters)
        assert is_allowed(scenario, nearest)
        np.testing.assert_array_equal(nearest_allowed(scenario, nearest), nearest)
        if is_allowed(scenario, parameters):
            np.testing.assert_array_equal(nearest, parameters)


@pytest.mark.parametrize(
    ("parameters", "nearest"),
    [
        ([0.30, 0.60, 0.10], [0.30, 0.60, 0.10]),
        ([0.50, 0.90, 0.60], [0.40, 0.85, 0.50]),
        ([0.30, 0.10, -0.10], [0.30, 0.21, 0.00]),
        ([0.10, 0.80, 0.10], [0.10, 0.50, 0.10]),  # slowed down to the shortest duration
        ([0.00, 0.85, 0.10], [0.05, 0.25, 0.10]),
    ],
)
def test_a_cast_that_is_not_allowed_is_moved_within_the_bounds_and_slowed_down(parameters, nearest):
    given = np.array(parameters)
    np.testing.assert_allclose(nearest_allowed(Scenario(), given), nearest)
    np.testing.assert_array_equal(given, parameters)  # the caller's own is left alone


def test_a_move_too_short_for_the_lowest_speed_is_made_longer():
    scenario = Scenario.from_dict({"motion": {"min_move_duration": 0.5}})
    np.testing.assert_allclose(nearest_allowed(scenario, np.array([0.05, 0.85, 0.1])), [0.105, 0.21, 0.1])


@pytest.mark.parametrize("cup", [(0.7, -0.1), [0.7, -0.1], np.array([0.7, -0.1])])
def test_a_cup_is_a_pair_of_numbers(cup):
    assert checked_cup(cup) == (0.7, -0.1)
    assert [type(value) for value in checked_cup(cup)] == [float, float]


NO_CUPS = [
    *(None, 0.7, (0.7,), (0.7, 0.1, 0.1), ("x", "y"), np.eye(2), (np.nan, 0.0)),
    *("69", ("0.7", "0.1"), (True, False), {0.7: 0.1, 0.1: 0.7}, {0.7, 0.1}),
]


@pytest.mark.parametrize("cup", NO_CUPS)
def test_other_cups_are_refused_in_one_line(cup):
    with pytest.raises(InputError, match="metres") as caught:
        checked_cup(cup)
    assert "\n" not in str(caught.value)


def test_words_of_a_cast_are_short_and_have_units():
    cast = Cast(0.2229401655761124, 0.48, 0.482, bearing=-1e-5)
    assert str(cast) == "distance 0.223 m, speed 0.480 m/s, wait 0.482 s, bearing 0.0°"
    assert eval(repr(cast)) == cast


@pytest.mark.parametrize("cup", [(1e308, 0), (0, -101.0)])
def test_a_cup_that_is_nowhere_near_is_refused(cup):
    with pytest.raises(InputError, match="must be within 100 m of the robot"):
        checked_cup(cup)


@pytest.mark.parametrize("cast", [(0.3, 0.6, 1e8), (0.3, 1e-6, 0.1)])
def test_a_cast_that_takes_minutes_is_refused(cast):
    with pytest.raises(InputError, match=r"longer than 300 s; choose a higher speed or a shorter wait"):
        Cast(*cast)
