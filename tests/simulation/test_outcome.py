"""Crossings and verdicts on synthetic paths, without Drake."""

import numpy as np
import pytest

from wam_cast.casting_plane import to_casting_plane
from wam_cast.scenario import Cup
from wam_cast.simulation.outcome import (
    BallTrack,
    Status,
    angle_from_vertical,
    find_crossing,
    is_inside,
    judge,
    possible_rise,
    touches_rim,
)

CUP = Cup()
R = 0.020
G = 9.81


def ballistic(p0, v0, times):
    """Return the track of a ball in free fall from p0 and v0."""
    p0, v0, a = np.array(p0), np.array(v0), np.array([0, 0, -G])
    t = times[:, None]
    return BallTrack(times, p0 + v0 * t + a * t**2 / 2, v0 + a * t)


# ---------------------------------------------------------------- the crossing


@pytest.mark.parametrize("period", [0.002, 0.0137])
def test_crossing_of_a_free_fall_is_its_closed_form(period):
    # The cubic between two samples holds a parabola, so the sampling must not show.
    track = ballistic([0.1, -0.2, 0.5], [0.7, 0.3, 1.2], np.arange(0, 1, period))
    crossing = find_crossing(track, 0.12)
    t = (1.2 + np.sqrt(1.2**2 + 2 * G * (0.5 - 0.12))) / G
    assert crossing.time == pytest.approx(t, abs=1e-11)
    np.testing.assert_allclose(crossing.p_WL, [0.1 + 0.7 * t, -0.2 + 0.3 * t, 0.12], atol=1e-11)
    np.testing.assert_allclose(crossing.v_WL, [0.7, 0.3, 1.2 - G * t], atol=1e-9)


def test_crossing_from_below_does_not_count():
    rising = ballistic([0, 0, 0.0], [0.1, 0, 2.0], np.arange(0, 0.2, 0.002))
    assert rising.p_WL[-1, 2] > 0.12
    assert find_crossing(rising, 0.12) is None
    whole = ballistic([0, 0, 0.0], [0.1, 0, 2.0], np.arange(0, 0.5, 0.002))
    assert find_crossing(whole, 0.12).v_WL[2] < 0


def test_first_of_several_crossings_counts():
    times = np.arange(0, 2, 0.002)
    z = 0.12 + 0.1 * np.cos(2 * np.pi * times)
    v = -0.2 * np.pi * np.sin(2 * np.pi * times)
    zero = np.zeros_like(times)
    track = BallTrack(times, np.column_stack([times, zero, z]), np.column_stack([zero + 1, zero, v]))
    assert find_crossing(track, 0.12).time == pytest.approx(0.25, abs=1e-6)


def test_ball_that_stays_above_never_crosses():
    times = np.arange(0, 1, 0.002)
    still = BallTrack(times, np.full((500, 3), 0.2), np.zeros((500, 3)))
    assert find_crossing(still, 0.12) is None


def test_sample_exactly_on_the_plane_is_the_crossing():
    track = ballistic([0, 0, 0.12 + G * 0.1**2 / 2], [0, 0, 0.0], np.array([0.0, 0.05, 0.1, 0.15]))
    assert find_crossing(track, 0.12).time == pytest.approx(0.1, abs=1e-9)


@pytest.mark.parametrize(
    ("velocity", "angle"),
    [([0, 0, -2], 0), ([1, 0, -1], 45), ([0, -1, -1], 45), ([3, 4, 0], 90), ([0, 0, 1], 180)],
)
def test_angle_is_from_straight_down(velocity, angle):
    assert np.rad2deg(angle_from_vertical(np.array(velocity, float))) == pytest.approx(angle)


def test_casting_planes_axes_point_outward_and_to_the_left():
    assert to_casting_plane(np.array([0.3, 0.1]), 0.0) == pytest.approx((0.3, 0.1))
    assert to_casting_plane(np.array([0.0, 0.5]), np.pi / 2) == pytest.approx((0.5, 0.0))
    assert to_casting_plane(np.array([-0.1, 0.5]), np.pi / 2) == pytest.approx((0.5, 0.1))


# ---------------------------------------------------------------- the verdict


def fall(x, y, to=-0.1):
    """Return a path straight down at (x, y) about the cup, from 10 cm above the rim plane."""
    z = np.linspace(0.1, to, 101)
    return np.column_stack([np.full(101, x), np.full(101, y), z])


@pytest.mark.parametrize(
    ("x", "y", "expected"),
    [
        (-0.07, 0.0, Status.SHORT),
        (0.07, 0.0, Status.LONG),
        (0.0, 0.07, Status.SIDE),
        (0.0, -0.07, Status.SIDE),
        (-0.07, 0.06, Status.SHORT),
        (0.06, -0.07, Status.SIDE),
        (-0.04, 0.0, Status.RIM_BOUNCE),
        (0.0, 0.05, Status.RIM_BOUNCE),
    ],
)
def test_miss_is_named_after_its_side(x, y, expected):
    assert judge(fall(x, y), False, False, CUP, R) is expected


@pytest.mark.parametrize(
    ("is_at_rest", "is_carried", "expected"),
    [
        (True, True, Status.CAUGHT),
        (True, False, Status.NOT_SETTLED),  # it hangs in the cup on its string
        (False, True, Status.NOT_SETTLED),
        (False, False, Status.NOT_SETTLED),
    ],
)
def test_ball_is_caught_only_at_rest_and_carried(is_at_rest, is_carried, expected):
    assert judge(fall(0.005, -0.003, to=-0.094), is_at_rest, is_carried, CUP, R) is expected


def test_ball_that_leaves_the_cup_came_out():
    inside, outside = fall(0.0, 0.0, to=-0.05), fall(0.08, 0.0)
    assert judge(np.vstack([inside, inside[::-1], outside]), True, True, CUP, R) is Status.CAME_OUT


def test_ball_above_the_rim_at_the_end_has_not_settled():
    assert judge(fall(0.0, 0.0, to=0.015), True, True, CUP, R) is Status.NOT_SETTLED


def test_touching_the_outside_of_the_wall_is_no_rim_bounce():
    slides = fall(CUP.outer_radius + R + 0.001, 0.0)
    assert judge(slides, False, True, CUP, R) is Status.LONG


def test_inside_ends_at_the_wall_and_at_the_rim():
    p_CL = np.array(
        [[0.0, 0, -0.001], [0, 0, 0.001], [0.0299, 0, -0.05], [0.0301, 0, -0.05], [0.022, 0.022, -0.1]]
    )
    np.testing.assert_array_equal(is_inside(p_CL, CUP), [True, False, True, False, False])


def test_ball_could_rise_by_its_kinetic_energy_above_where_it_is():
    lying = CUP.bottom_thickness + R - CUP.rim_height
    assert possible_rise(np.array([0.01, 0.0, lying]), 0.0, CUP, R) == pytest.approx(0.0, abs=1e-15)
    assert possible_rise(np.array([0.01, 0.0, lying + 0.03]), 0.0, CUP, R) == pytest.approx(0.03)
    # Thrown up at sqrt(2 g h), a ball rises by h.
    upward = np.sqrt(2 * G * 0.02)
    assert possible_rise(np.array([0.01, 0.0, lying]), upward, CUP, R) == pytest.approx(0.02)
    assert possible_rise(np.array([0.01, 0.0, lying + 0.03]), upward, CUP, R) == pytest.approx(0.05)


def test_rim_is_touched_at_a_balls_radius():
    middle = (CUP.inner_radius + CUP.outer_radius) / 2
    gaps = np.array([0.0, 4e-4, 6e-4, 0.01])
    above = np.column_stack([np.full(4, middle), np.zeros(4), R + gaps])
    np.testing.assert_array_equal(touches_rim(above, CUP, R), [True, True, False, False])
    diagonal = (R + gaps) / np.sqrt(2)
    outside = np.column_stack([np.zeros(4), -(CUP.outer_radius + diagonal), diagonal])
    np.testing.assert_array_equal(touches_rim(outside, CUP, R), [True, True, False, False])
    assert not touches_rim(np.array([0.0, 0.0, 0.001]), CUP, R)  # in the middle of the opening
