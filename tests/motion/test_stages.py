"""The hand's reference: the quintic's boundary conditions, and six stages that join without a jump."""

import numpy as np
import pytest

from wam_cast.cast import Cast
from wam_cast.motion.spline import QuinticSpline
from wam_cast.motion.stages import CastMotion, Stage
from wam_cast.scenario import Scenario

SPLINE = QuinticSpline(start_time=0.4, end_time=1.2, start=0.2, end=-0.3)
SCENARIO = Scenario()
MOTION = SCENARIO.motion
CASTS = [Cast(0.3, 0.6, 0.1), Cast(0.05, 0.21, 0.0), Cast(0.4, 0.85, 0.5, bearing=-0.7), Cast(0.1, 0.5, 1e-6)]

each_cast = pytest.mark.parametrize("cast", CASTS, ids=str)


def derivative(f, t, h=1e-5):
    return (f(t + h) - f(t - h)) / (2 * h)


def positions(motion, times):
    return np.array([motion.evaluate(t)[0] for t in times])


def velocities(motion, times):
    return np.array([motion.evaluate(t)[1] for t in times])


# ---------------------------------------------------------------- the spline


def test_spline_meets_the_six_boundary_conditions():
    assert SPLINE.evaluate(0.4) == (0.2, 0.0)
    assert SPLINE.evaluate(1.2) == (-0.3, 0.0)
    assert SPLINE.acceleration(0.4) == 0.0
    assert SPLINE.acceleration(1.2) == 0.0


def test_spline_meets_them_from_within():
    # The ends themselves are special cases of the code; the polynomial must run into them.
    h = 1e-6
    for t, end in [(0.4 + h, 0.2), (1.2 - h, -0.3)]:
        position, velocity = SPLINE.evaluate(t)
        assert position == pytest.approx(end, abs=1e-15)
        assert velocity == pytest.approx(0, abs=1e-10)  # 30 (h / T)^2 change / T
        assert SPLINE.acceleration(t) == pytest.approx(0, abs=1e-4)  # 60 h / T change / T^2


def test_spline_solves_the_linear_system_of_its_boundary_conditions():
    # x = sum of a_i t^i with x, x', x'' given at both ends: independent of the closed form in u.
    rows = []
    for t in (0.0, 0.8):
        rows += [
            [t**i for i in range(6)],
            [i * t ** (i - 1) if i else 0.0 for i in range(6)],
            [i * (i - 1) * t ** (i - 2) if i > 1 else 0.0 for i in range(6)],
        ]
    a = np.linalg.solve(rows, [0.2, 0, 0, -0.3, 0, 0])
    for t in np.linspace(0.01, 0.79, 14):
        expected = sum(a[i] * t**i for i in range(6)), sum(i * a[i] * t ** (i - 1) for i in range(1, 6))
        np.testing.assert_allclose(SPLINE.evaluate(0.4 + t), expected, atol=1e-13)
        bent = sum(i * (i - 1) * a[i] * t ** (i - 2) for i in range(2, 6))
        assert SPLINE.acceleration(0.4 + t) == pytest.approx(bent, abs=1e-12)


def test_velocity_and_acceleration_are_derivatives():
    for t in np.linspace(0.41, 1.19, 12):
        assert SPLINE.evaluate(t)[1] == pytest.approx(derivative(lambda s: SPLINE.evaluate(s)[0], t), abs=1e-9)
        assert SPLINE.acceleration(t) == pytest.approx(derivative(lambda s: SPLINE.evaluate(s)[1], t), abs=1e-8)


def test_peak_speed_is_fifteen_eighths_of_the_mean_and_half_way():
    times = np.linspace(0.4, 1.2, 801)
    speeds = [abs(SPLINE.evaluate(t)[1]) for t in times]
    assert max(speeds) == pytest.approx(15 / 8 * 0.5 / 0.8, rel=1e-12)
    assert times[np.argmax(speeds)] == pytest.approx(0.8)


def test_spline_rests_outside_of_its_times():
    for t, end in [(-1.0, 0.2), (0.39, 0.2), (1.21, -0.3), (9.0, -0.3)]:
        assert SPLINE.evaluate(t) == (end, 0.0)
        assert SPLINE.acceleration(t) == 0.0


# ---------------------------------------------------------------- the cast


@each_cast
def test_stages_come_in_order_and_last_as_long_as_they_should(cast):
    motion = CastMotion(SCENARIO, cast)
    turn = 0.0 if cast.bearing == 0 else 4.0 * abs(cast.bearing) ** 0.25
    expected = [turn, cast.distance / cast.speed, cast.wait, MOTION.drop_duration, MOTION.hold_duration, 0.8 + 2.5]
    found = np.diff([0.0, *motion.stage_ends])
    np.testing.assert_allclose(found[1:], expected[1:], atol=1e-12)
    assert expected[0] <= found[0] < expected[0] + 0.002  # in whole control periods
    times = np.linspace(0, motion.stage_ends[-1] + 0.5, 4000)
    stages = np.array([motion.stage(t) for t in times])
    assert np.all(np.diff(stages) >= 0)
    left_out = ({Stage.WAIT} if cast.wait < 1e-3 else set()) | ({Stage.TURN} if turn == 0 else set())
    assert set(stages) == set(Stage) - left_out
    assert stages[-1] == Stage.RETURN
    for stage in Stage:
        began = 0.0 if stage == Stage.TURN else motion.stage_ends[stage - 1]
        np.testing.assert_array_equal(stages >= stage, times >= began)


@each_cast
def test_hand_is_where_each_stage_should_end(cast):
    motion = CastMotion(SCENARIO, cast)
    c, s = np.cos(cast.bearing), np.sin(cast.bearing)
    far = MOTION.start_radius + cast.distance
    high, low = MOTION.start_height, MOTION.start_height - MOTION.drop_distance
    expected = [(0.2, high), (far, high), (far, high), (far, low), (far, low), (0.2, high)]
    for t, (radius, height) in zip(motion.stage_ends, expected, strict=True):
        position, velocity = motion.evaluate(t)
        np.testing.assert_allclose(position, [radius * c, radius * s, height], atol=1e-15)
        np.testing.assert_allclose(velocity, 0, atol=1e-25)


@each_cast
def test_position_velocity_and_acceleration_are_continuous_at_every_boundary(cast):
    motion = CastMotion(SCENARIO, cast)
    h = 1e-6
    ends = [0.0, *motion.stage_ends, motion.stage_ends[Stage.HOLD] + MOTION.lift_duration]
    for t in ends:
        before, after = motion.evaluate(t - h), motion.evaluate(t + h)
        np.testing.assert_allclose(before[0], after[0], atol=1e-14)
        # With no acceleration at the boundary, velocity grows with the square of h and acceleration with h.
        np.testing.assert_allclose(before[1], after[1], atol=1e-8)
        np.testing.assert_allclose((after[1] - before[1]) / (2 * h), 0, atol=3e-3)


@each_cast
def test_desired_velocity_is_the_derivative_of_the_desired_position(cast):
    motion = CastMotion(SCENARIO, cast)
    for t in np.linspace(0.0013, motion.stage_ends[-1] + 0.1, 97):
        np.testing.assert_allclose(motion.evaluate(t)[1], derivative(lambda s: motion.evaluate(s)[0], t), atol=1e-6)


@each_cast
def test_move_is_horizontal_with_the_casts_mean_speed_and_the_drop_vertical(cast):
    motion = CastMotion(SCENARIO, cast)
    turn_end, move_end, wait_end, drop_end, hold_end, _ = motion.stage_ends
    moving = velocities(motion, np.linspace(turn_end, move_end, 1001))
    np.testing.assert_array_equal(moving[:, 2], 0)
    assert np.hypot(moving[:, 0], moving[:, 1]).max() == pytest.approx(15 / 8 * cast.speed, rel=1e-9)
    np.testing.assert_array_equal(velocities(motion, np.linspace(move_end, wait_end, 11)), 0)
    dropping = velocities(motion, np.linspace(wait_end, drop_end, 1001))
    np.testing.assert_array_equal(dropping[:, :2], 0)
    assert dropping[:, 2].min() == pytest.approx(-15 / 8 * 0.45 / MOTION.drop_duration, rel=1e-9)
    np.testing.assert_allclose(velocities(motion, np.linspace(drop_end, hold_end, 11)), 0, atol=1e-25)


@each_cast
def test_without_a_cup_the_return_goes_straight_up_and_then_home(cast):
    motion = CastMotion(SCENARIO, cast)
    hold_end, return_end = motion.stage_ends[Stage.HOLD], motion.stage_ends[Stage.RETURN]
    lift_end = hold_end + MOTION.lift_duration
    lifting = velocities(motion, np.linspace(hold_end + 1e-3, lift_end, 50)[:-1])
    np.testing.assert_allclose(lifting[:, :2], 0, atol=1e-12)
    assert np.all(lifting[:, 2] > 0)
    ends = positions(motion, [motion.stage_ends[Stage.TURN], return_end, return_end + 1.0])
    np.testing.assert_allclose(ends[1:], ends[[0, 0]], atol=1e-13)


@pytest.mark.parametrize("bearing", [0.6, -1.1, np.pi / 2])
def test_bearing_rotates_the_path_about_the_base_axis(bearing):
    straight = CastMotion(SCENARIO, Cast(0.3, 0.6, 0.1), cup_radius=0.6)
    turned = CastMotion(SCENARIO, Cast(0.3, 0.6, 0.1, bearing), cup_radius=0.6)
    c, s = np.cos(bearing), np.sin(bearing)
    R = np.array([[c, -s, 0], [s, c, 0], [0, 0, 1]])
    times = np.linspace(0, straight.stage_ends[-1], 200)
    later = times + turned.stage_ends[Stage.TURN]
    np.testing.assert_allclose(positions(turned, later), positions(straight, times) @ R.T, atol=1e-13)
    np.testing.assert_allclose(velocities(turned, later), velocities(straight, times) @ R.T, atol=1e-11)
    # Where the clocks round to different sides of a stage's end, it is the end.
    assert np.sum([turned.stage(t) for t in later] != np.array([straight.stage(t) for t in times])) <= 2


def test_cast_that_starts_in_its_own_plane_does_not_turn():
    cast = Cast(0.3, 0.6, 0.1, bearing=0.9)
    motion = CastMotion(SCENARIO, cast, start_bearing=0.9)
    assert motion.stage_ends[Stage.TURN] == 0
    assert motion.stage(0.0) == Stage.MOVE
    assert motion.bearing(0.0) == (0.9, 0.0)


def test_without_a_wait_the_drop_begins_when_the_move_ends():
    motion = CastMotion(SCENARIO, Cast(0.3, 0.6, 0.0))
    assert motion.stage_ends[Stage.MOVE] == motion.stage_ends[Stage.WAIT]
    assert motion.stage(0.5 - 1e-9) == Stage.MOVE
    assert motion.stage(0.5) == Stage.DROP
