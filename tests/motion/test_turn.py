"""The turn: a shaped path in closed form, and in simulation a ball that hangs at rest at its end, whatever the bearing."""

import dataclasses

import numpy as np
import pytest

from wam_cast.arm.arm_model import arm_model
from wam_cast.cast import Cast
from wam_cast.motion.pendulum import swing_frequency
from wam_cast.motion.stages import CastMotion, Stage
from wam_cast.motion.turn import Turn
from wam_cast.scenario import Arm, Scenario

SCENARIO = Scenario()
OMEGA = swing_frequency(SCENARIO)
TYPICAL = Cast(0.3, 0.6, 0.1)
ANGLES = [1e-4, 0.05, -0.4, 1.0, -1.9, *(0.999 * limit for limit in arm_model(Arm()).bearing_limits)]

each_angle = pytest.mark.parametrize("angle", ANGLES)


def swing(recording, sample):
    """Return the amplitude [m] of the ball's swing about the hand at one sample, whatever its direction and phase."""
    offset = (recording.p_WL - recording.p_WE)[sample, :2]
    return np.linalg.norm([offset, recording.v_WL[sample, :2] / OMEGA])


def turn_end(cast):
    return CastMotion(SCENARIO, cast).stage_ends[Stage.TURN]


# ---------------------------------------------------------------- the path


@each_angle
def test_duration_keeps_what_limits_it(angle):
    size = abs(angle)
    expected = 4.0 * (size**0.25 if size < 1 else size**0.5)
    duration = Turn(SCENARIO, 0.3, 0.3 + angle).duration
    assert expected <= duration + 1e-9 < expected + 0.002 + 1e-9
    assert duration / 0.002 == pytest.approx(round(duration / 0.002), abs=1e-9)


@pytest.mark.parametrize("angle", [1e-60, 1e-30, -1e-12])
def test_the_smallest_turn_is_a_turn_or_none(angle):
    assert Turn(Scenario(), 0.0, angle).duration < 0.05


def test_nothing_to_turn_takes_no_time():
    turn = Turn(SCENARIO, 0.7, 0.7)
    assert turn.duration == 0
    assert turn.bearing(0.0) == (0.7, 0.0)


@each_angle
def test_turn_begins_and_ends_at_rest_at_the_starting_radius(angle):
    turn = Turn(SCENARIO, 0.1, 0.1 + angle)
    h = 1e-3 * turn.duration
    for t, inward, bearing in ((0.0, h, 0.1), (turn.duration, -h, 0.1 + angle)):
        place = np.array([0.2 * np.cos(bearing), 0.2 * np.sin(bearing), 0.8])
        (p, v), (p_in, v_in) = turn.evaluate(t), turn.evaluate(t + inward)
        np.testing.assert_allclose(p, place, atol=1e-12)
        np.testing.assert_allclose(v, 0, atol=1e-12)
        # The first derivative that is not zero is the hand's third, of 15120 / 12 u^3 or so: nothing of the order of u or u^2.
        assert np.linalg.norm(p_in - place) < 1e-5
        assert np.linalg.norm(v_in) * turn.duration < 0.02 * abs(angle)


def test_angle_of_the_ball_has_four_zero_derivatives_at_both_ends():
    turn = Turn(SCENARIO, 0.0, 1.0)
    u = 1e-3
    # theta = 126 u^5 - 420 u^6 + ..., so that it leaves its ends with the fifth power of u.
    assert turn.bearing(u * turn.duration)[0] == pytest.approx(126 * u**5, rel=5e-3)
    assert 1 - turn.bearing((1 - u) * turn.duration)[0] == pytest.approx(126 * u**5, rel=0.02)


@each_angle
def test_velocity_is_the_derivative_of_the_position(angle):
    turn = Turn(SCENARIO, 0.0, angle)
    h = 1e-6
    for t in np.linspace(0.02, 0.98, 9) * turn.duration:
        by_difference = (turn.evaluate(t + h)[0] - turn.evaluate(t - h)[0]) / (2 * h)
        np.testing.assert_allclose(turn.evaluate(t)[1], by_difference, atol=1e-8)
        rate = (turn.bearing(t + h)[0] - turn.bearing(t - h)[0]) / (2 * h)
        assert turn.bearing(t)[1] == pytest.approx(rate, abs=1e-8)


def test_hand_is_above_a_ball_on_the_arc():
    """Half way the angle's acceleration is zero and its rate 315/128 of the mean: the ball is pulled in by r theta'^2 alone."""
    turn = Turn(SCENARIO, 0.0, 2.0)
    p_WE, _ = turn.evaluate(turn.duration / 2)
    rate = 315 / 128 * 2.0 / turn.duration
    assert turn.bearing(turn.duration / 2) == pytest.approx((1.0, rate), rel=1e-12)
    length = 9.81 / OMEGA**2
    slant = np.arctan(0.2 * rate**2 / 9.81)
    radius = 0.2 - length * np.sin(slant)
    expected = [radius * np.cos(1.0), radius * np.sin(1.0), 0.8 - length * (1 - np.cos(slant))]
    np.testing.assert_allclose(p_WE, expected, atol=1e-12)


# ---------------------------------------------------------------- in simulation


@pytest.mark.parametrize(
    "bearing", [-0.3, pytest.param(0.999 * arm_model(Arm()).bearing_limits[1], marks=pytest.mark.slow)]
)
def test_ball_hangs_at_rest_after_the_turn_and_the_cast_is_the_same(simulator, bearing):
    straight = simulator.simulate(TYPICAL)
    cast = dataclasses.replace(TYPICAL, bearing=bearing)
    recording = simulator.record(cast)
    end = round(turn_end(cast) / 0.002)
    assert swing(recording, end) < 2e-4
    assert swing(recording, end // 2) > 1e-3, "it did swing on the way"
    outcome = recording.outcome
    assert outcome.landing_along == pytest.approx(straight.landing_along, abs=3e-4)
    assert outcome.landing_across == pytest.approx(0, abs=3e-4)
    assert outcome.limits_hit == ()
    assert outcome.peak_torque_utilization.max() < 0.5
    assert np.abs(recording.states[: end + 1, 29]).max() < 0.6 * 2.39
    assert np.linalg.norm(recording.p_WE - recording.p_WE_desired, axis=1)[: end + 1].max() < 2e-3


def test_unshaped_turn_would_leave_the_ball_swinging(simulator, monkeypatch):
    """The same arc at the same times, but for the hand instead of the ball."""
    from wam_cast.motion import turn

    monkeypatch.setattr(turn, "hand_above", lambda p, v, *_: (p + np.array([0, 0, 9.81 / OMEGA**2]), v))
    recording = simulator.record(dataclasses.replace(TYPICAL, bearing=0.3))
    assert swing(recording, round(turn_end(recording.cast) / 0.002)) > 2e-3


@pytest.mark.slow
@each_angle
def test_every_turn_leaves_the_ball_at_rest(simulator, angle):
    straight = simulator.simulate(TYPICAL)
    recording = simulator.record(dataclasses.replace(TYPICAL, bearing=angle))
    assert swing(recording, round(turn_end(recording.cast) / 0.002)) < 2e-4
    assert recording.outcome.landing_along == pytest.approx(straight.landing_along, abs=3e-4)
    assert recording.outcome.landing_across == pytest.approx(0, abs=3e-4)
