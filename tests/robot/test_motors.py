"""What the motors give of what is commanded: saturation, differentials, scale, and the torque-speed curve."""

import numpy as np
import pytest

from wam_cast.arm.arm_chain import DIFFERENTIALS
from wam_cast.robot.motors import Motors, motor_utilization, saturate
from wam_cast.robot.plant import make_arm_plant
from wam_cast.robot.station import CastStation
from wam_cast.scenario import Arm, Scenario

LIMITS = np.array([10.0, 20.0, 40.0, 10.0, 5.0, 10.0, 2.0])


def test_torque_within_the_motors_is_left_alone():
    torque = np.array([9.0, -9.0, 18.0, -9.9, 2.0, 5.0, 1.9])
    np.testing.assert_array_equal(saturate(torque, LIMITS), torque)


def test_what_is_saturated_stays_as_it_is_to_the_last_bit():
    # A controller on the other side of a wire saturates first, and the arm's motors again.
    for torque in np.random.default_rng(0).normal(size=(200, 7)) * 2 * LIMITS:
        once = saturate(torque, LIMITS)
        assert saturate(once, LIMITS).tobytes() == once.tobytes()


@pytest.mark.parametrize("joint", [0, 3, 6])
@pytest.mark.parametrize("sign", [1, -1])
def test_joint_of_its_own_is_clipped(joint, sign):
    torque = np.full(7, 0.1)
    torque[joint] = sign * 3 * LIMITS[joint]
    expected = torque.copy()
    expected[joint] = sign * LIMITS[joint]
    np.testing.assert_allclose(saturate(torque, LIMITS), expected, rtol=1e-15)


@pytest.mark.parametrize("pair", DIFFERENTIALS, ids=str)
@pytest.mark.parametrize("signs", [(1, 1), (1, -1), (-1, 1)])
def test_differential_pair_is_scaled_and_keeps_its_direction(pair, signs):
    # Each joint alone would be within its limit; together they ask 1.6 times what their two motors give.
    a, b = pair
    torque = np.full(7, 0.1)
    torque[a], torque[b] = 0.9 * signs[0] * LIMITS[a], 0.7 * signs[1] * LIMITS[b]
    found = saturate(torque, LIMITS)
    np.testing.assert_allclose(found[[a, b]], torque[[a, b]] / 1.6, rtol=1e-14)
    others = np.setdiff1d(np.arange(7), pair)
    np.testing.assert_array_equal(found[others], torque[others])
    assert motor_utilization(found, LIMITS)[a] == pytest.approx(1.0, rel=1e-14)


def test_saturation_leaves_its_argument_alone():
    torque = 10 * LIMITS
    saturate(torque, LIMITS)
    np.testing.assert_array_equal(torque, 10 * LIMITS)


def test_motor_load_is_the_utilization_of_each_joints_motors():
    torque = np.array([[5.0, 10.0, 10.0, -10.0, 1.0, -3.0, 0.0], np.zeros(7)])
    expected = [[0.5, 0.75, 0.75, 1.0, 0.5, 0.5, 0.0], np.zeros(7)]
    np.testing.assert_allclose(motor_utilization(torque, LIMITS), expected, rtol=1e-15)


def given(arm, commanded, v):
    """Return the torque that the motors of `arm` give."""
    motors = Motors(make_arm_plant(Scenario(arm=arm)), arm)
    context = motors.CreateDefaultContext()
    motors.GetInputPort("commanded").FixValue(context, commanded)
    motors.GetInputPort("arm_state").FixValue(context, np.r_[np.zeros(7), v])
    return motors.get_output_port().Eval(context)


def test_torque_is_scaled_after_it_was_cut_off_at_what_is_commanded_at_most():
    limits = make_arm_plant(Scenario()).GetEffortUpperLimits()
    scale = np.array([1.05, 0.9, 1.1, 1.0, 0.8, 1.2, 0.5])
    arm = Arm(torque_scale=tuple(scale))
    np.testing.assert_allclose(given(arm, 0.3 * limits, np.zeros(7)), 0.3 * scale * limits, rtol=1e-14)
    np.testing.assert_allclose(given(arm, 9.0 * limits, np.zeros(7)), scale * saturate(9 * limits, limits), rtol=1e-14)


@pytest.mark.parametrize(("share", "left"), [(0.5, 1.0), (0.7, 1.0), (0.85, 0.5), (1.0, 0.0), (1.2, 0.0)])
def test_peak_torque_falls_linearly_from_the_knee_to_the_velocity_limit(share, left):
    plant = make_arm_plant(Scenario())
    limits, v = plant.GetEffortUpperLimits(), np.zeros(7)
    v[3] = share * plant.GetVelocityUpperLimits()[3]
    arm = Arm(knee_speed=0.7)
    driving, braking = (given(arm, sign * np.eye(7)[3] * 5 * limits, v) for sign in (1, -1))
    assert driving[3] == pytest.approx(left * limits[3], abs=1e-4)
    assert braking[3] == pytest.approx(-limits[3])


def test_joints_of_a_differential_share_the_speed_of_their_motors():
    plant = make_arm_plant(Scenario())
    limits, speeds = plant.GetEffortUpperLimits(), plant.GetVelocityUpperLimits()
    v = np.zeros(7)
    v[1], v[2] = 0.45 * speeds[1], 0.45 * speeds[2]
    found = given(Arm(knee_speed=0.8), np.eye(7)[1] * 5 * limits, v)
    assert found[1] == pytest.approx(0.5 * limits[1], rel=1e-6)  # a motor turns at 0.9 of its limit


def test_log_holds_the_torque_that_acts_and_friction_acts_beside_it():
    """What a controller of one's own wants beyond the motors' limits is not in the log, and the plant clips nothing further."""
    scenario = Scenario.from_dict({"controller": {"kp": 1e6}, "arm": {"torque_scale": 1.3, "coulomb_friction": 2.0}})
    station = CastStation(scenario, has_scene=False)
    context = station.diagram.CreateDefaultContext()
    plant, plant_context = station.plant, station.plant.GetMyMutableContextFromRoot(context)
    v = np.zeros(plant.num_velocities())
    v[:7] = [0.2, -0.3, 0.4, -0.5, 0.6, -0.7, 0.8]
    plant.SetVelocities(plant_context, v)
    limits = plant.GetEffortUpperLimits()
    held = np.array([1.0, -0.6, 0.4, 1.0, 0.5, -0.5, 1.0]) * limits
    station.hold.GetMyMutableContextFromRoot(context).SetDiscreteState(held)
    found = plant.get_net_actuation_output_port().Eval(plant_context)
    np.testing.assert_array_equal(found, held)
    # M a = held + friction + what else acts: the difference that friction makes is exactly friction.
    force = plant.get_applied_generalized_force_input_port().Eval(plant_context)
    friction = np.array([2.7, 2.5, 1.5, 1.1, 0.4, 0.4, 0.1])
    np.testing.assert_allclose(force[:7], -2.0 * friction * np.sign(v[:7]), rtol=1e-12)
    np.testing.assert_array_equal(force[7:], 0)
