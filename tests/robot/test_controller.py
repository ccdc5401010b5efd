"""The control law in closed form at single states, and a context that holds all there is to hold."""

import numpy as np
import pytest
from pydrake.math import RigidTransform, RollPitchYaw
from pydrake.multibody.parsing import Parser
from pydrake.multibody.plant import MultibodyPlant
from pydrake.multibody.tree import JacobianWrtVariable
from pydrake.systems.analysis import Simulator

from wam_cast.arm.arm_model import models_directory
from wam_cast.arm.posture import starting_posture
from wam_cast.cast import Cast
from wam_cast.motion.stages import CastMotion, Stage
from wam_cast.robot.controller import ArmController, CastController, MeasuredArm
from wam_cast.robot.station import CastStation
from wam_cast.scenario import Scenario

OUTPUTS = ("actuation", "hand", "hand_desired", "stage")

# Unequal gains, so that none passes for another.
SOFT = Scenario.from_dict(
    {
        "controller": {
            "kp": 60.0,
            "kd": 17.0,
            "posture_stiffness": [2.0, 3.0, 4.0, 5.0, 0.6, 0.7, 0.08],
            "posture_damping": [0.9, 0.8, 0.7, 0.6, 0.05, 0.04, 0.003],
        }
    }
)
CAST = Cast(0.3, 0.6, 0.1, bearing=0.25)
STATE_A = np.array([-0.2, 0.0, 0.15, 2.7, -0.1, -0.6, 0.2, 0.3, -0.2, 0.1, 0.4, -0.3, 0.2, -0.1])
STATE_B = np.array([0.1, -0.2, -0.1, 2.4, 0.3, -0.9, -0.4, -0.1, 0.5, 0.2, -0.4, 0.1, 0.6, 0.3])


class Arm:
    """The arm in a plant of the test's own, built from the model file alone."""

    def __init__(self, mount_height=1.346):
        self.plant = MultibodyPlant(0.0)
        Parser(self.plant).AddModels(str(models_directory() / "wam7.urdf"))
        X_WB = RigidTransform(RollPitchYaw(np.pi, 0, 0), [0, 0, mount_height])
        self.plant.WeldFrames(self.plant.world_frame(), self.plant.GetFrameByName("base"), X_WB)
        self.plant.Finalize()
        self.context = self.plant.CreateDefaultContext()
        self.hand = self.plant.GetFrameByName("tool_plate")

    def hand_position(self, q):
        self.plant.SetPositions(self.context, q)
        return self.hand.CalcPoseInWorld(self.context).translation()

    def jacobian(self, q):
        """Return the hand's Jacobian by differences of its position: nothing of Drake's Jacobians."""
        h = 1e-6
        columns = [(self.hand_position(q + h * e) - self.hand_position(q - h * e)) / (2 * h) for e in np.eye(7)]
        return np.array(columns).T

    def exact_jacobian(self, q):
        self.plant.SetPositions(self.context, q)
        world = self.plant.world_frame()
        return self.plant.CalcJacobianSpatialVelocity(
            self.context, JacobianWrtVariable.kQDot, self.hand, np.zeros(3), world, world
        )[3:]

    def holding_torque(self, q):
        self.plant.SetPositions(self.context, q)
        return -self.plant.CalcGravityGeneralizedForces(self.context)


@pytest.fixture(scope="module")
def arm():
    return Arm()


@pytest.fixture(scope="module")
def controller():
    return CastController(SOFT)


def context_of(controller, state=STATE_A, time=0.3, cast=CAST):
    context = controller.CreateDefaultContext()
    controller.get_input_port().FixValue(context, state)
    controller.set_cast(context, cast)
    context.SetTime(time)
    return context


def set_state(controller, context, state):
    controller.get_input_port().FixValue(context, state)


def outputs(controller, context):
    return {name: controller.GetOutputPort(name).Eval(context).copy() for name in OUTPUTS}


def assert_same(found, expected):
    for name in OUTPUTS:
        np.testing.assert_array_equal(found[name], expected[name], err_msg=name)


# ---------------------------------------------------------------- the law


@pytest.mark.parametrize("state", [STATE_A, STATE_B], ids="AB")
@pytest.mark.parametrize("time", [0.0, 0.8, 2.0, 3.1, 3.5, 3.9])  # the turn ends at 2.83 s
def test_torque_is_the_law_in_closed_form(controller, arm, state, time):
    q, v = state[:7], state[7:]
    J = arm.exact_jacobian(q)
    np.testing.assert_allclose(J, arm.jacobian(q), atol=1e-9)
    motion = CastMotion(SOFT, CAST)
    p_desired, v_desired = motion.evaluate(time)
    u_x = 60.0 * (p_desired - arm.hand_position(q)) + 17.0 * (v_desired - J @ v)
    # The posture: the hand at the start of the cast, joints 3, 5 and 7 at zero and the wrist where the scenario has it; it turns.
    bearing, rate = motion.bearing(time)
    q_posture = start_by_search(arm, SOFT, bearing)
    v_posture = np.array([-rate, 0, 0, 0, 0, 0, 0])
    pull = np.array([2.0, 3.0, 4.0, 5.0, 0.6, 0.7, 0.08]) * (q_posture - q)
    pull += np.array([0.9, 0.8, 0.7, 0.6, 0.05, 0.04, 0.003]) * (v_posture - v)
    N = np.eye(7) - J.T @ np.linalg.inv(J @ J.T) @ J
    expected = J.T @ u_x + arm.holding_torque(q) + N @ pull
    found = controller.GetOutputPort("actuation").Eval(context_of(controller, state, time))
    np.testing.assert_allclose(found, expected, atol=1e-10, rtol=0)


def test_straight_arm_gets_a_torque_of_ordinary_size(controller, arm):
    # It cannot push along itself: J J^T is singular, and the posture must do with the forces that are left.
    q = np.zeros(7)
    J = arm.exact_jacobian(q)
    assert np.linalg.matrix_rank(J) == 2
    p_desired, v_desired = CastMotion(SOFT, CAST).evaluate(3.1)
    u_x = 60.0 * (p_desired - arm.hand_position(q)) + 17.0 * v_desired
    pull = np.array([2.0, 3.0, 4.0, 5.0, 0.6, 0.7, 0.08]) * start_by_search(arm, SOFT, CAST.bearing)
    expected = J.T @ u_x + arm.holding_torque(q) + pull - J.T @ np.linalg.pinv(J.T) @ pull
    assert np.all(np.abs(expected) < 60)
    found = outputs(controller, context_of(controller, np.zeros(14), time=3.1))["actuation"]
    np.testing.assert_allclose(found, expected, atol=1e-6)


def start_by_search(arm, scenario, bearing):
    """Return the starting posture by Newton's method on the test's own arm, in place of the law of cosines."""
    q = np.array([-bearing, 0.0, 0.0, 2.9, 0.0, scenario.arm.wrist_pitch, 0.0])
    motion = scenario.motion
    outward = np.array([np.cos(bearing), np.sin(bearing), 0.0])
    goal = motion.start_radius * outward + [0, 0, motion.start_height]
    for _ in range(30):
        J = arm.exact_jacobian(q)[:, [1, 3]]
        error = goal - arm.hand_position(q)
        in_plane = np.array([outward, [0, 0, 1]])
        q[[1, 3]] += np.linalg.solve(in_plane @ J, in_plane @ error)
    np.testing.assert_allclose(arm.hand_position(q), goal, atol=1e-13)
    assert 0 < q[3] < np.pi, "the elbow bends forward"
    return q


def test_posture_gives_no_force_at_the_hand(arm):
    # At the same arm state, only the posture's gains differ: what they add must be null-space torque, without force at the hand.
    torques = []
    for stiffness in ([0.0] * 7, [5.0, 4.0, 3.0, 2.0, 1.0, 0.9, 0.2]):
        scenario = Scenario.from_dict(
            {"controller": {"kp": 60.0, "kd": 17.0, "posture_stiffness": stiffness, "posture_damping": [0.0] * 7}}
        )
        torques.append(outputs(c := CastController(scenario), context_of(c))["actuation"])
    added = torques[1] - torques[0]
    assert np.linalg.norm(added) > 0.1
    J = arm.jacobian(STATE_A[:7])
    np.testing.assert_allclose(np.linalg.solve(J @ J.T, J @ added), 0, atol=1e-7)


def test_arm_alone_needs_its_weight_alone_at_the_start(arm):
    scenario = Scenario()
    controller = CastController(scenario)
    q = start_by_search(arm, scenario, 0.0)
    context = context_of(controller, np.r_[q, np.zeros(7)], time=0.0, cast=Cast(0.3, 0.6, 0.1))
    np.testing.assert_allclose(outputs(controller, context)["actuation"], arm.holding_torque(q), atol=1e-9)


def test_hand_output_is_forward_kinematics(controller, arm):
    q, v = STATE_A[:7], STATE_A[7:]
    hand = outputs(controller, context_of(controller))["hand"]
    np.testing.assert_allclose(hand[:3], arm.hand_position(q), atol=1e-14)
    h = 1e-6
    by_difference = (arm.hand_position(q + h * v) - arm.hand_position(q - h * v)) / (2 * h)
    np.testing.assert_allclose(hand[3:], by_difference, atol=1e-8)


@pytest.mark.parametrize("time", [0.0, 0.3, 2.9, 3.6, 5.5, 7.0])
def test_reference_outputs_are_those_of_the_motion(controller, time):
    motion = CastMotion(SOFT, CAST)
    found = outputs(controller, context_of(controller, time=time))
    np.testing.assert_array_equal(found["hand_desired"], np.concatenate(motion.evaluate(time)))
    assert found["stage"] == [motion.stage(time)]


def test_stage_output_counts_through_the_cast(controller):
    ends = CastMotion(SOFT, CAST).stage_ends
    stages = [outputs(controller, context_of(controller, time=t - 1e-3))["stage"][0] for t in ends]
    assert stages == list(Stage)


# ---------------------------------------------------------------- controllers of one's own


class Pull(ArmController):
    """Pulls the hand toward what is desired, and keeps what it was asked with."""

    def __init__(self, scenario, stiffness):
        super().__init__(scenario)
        self.stiffness, self.asked = stiffness, []

    def torque(self, arm, desired):
        self.asked.append((arm, desired))
        return self.stiffness * arm.Jv_WE.T @ (desired.p_WE - arm.p_WE) + arm.holding_torque


def test_controller_of_ones_own_is_asked_with_what_it_measures_and_what_is_desired(arm):
    own = Pull(SOFT, 10.0)
    q, v = STATE_A[:7], STATE_A[7:]
    found = outputs(own, context_of(own))
    motion, J = CastMotion(SOFT, CAST), arm.exact_jacobian(q)
    pull = 10.0 * J.T @ (motion.evaluate(0.3)[0] - arm.hand_position(q))
    np.testing.assert_allclose(found["actuation"], pull + arm.holding_torque(q), atol=1e-10)
    ((measured, desired),) = own.asked
    assert (desired.time, desired.motion.cast) == (0.3, CAST)
    np.testing.assert_array_equal([measured.q, measured.v], [q, v])
    np.testing.assert_allclose(measured.v_WE, J @ v, atol=1e-12)
    np.testing.assert_array_equal(desired.v_WE, motion.evaluate(0.3)[1])
    ours = outputs(reference := CastController(SOFT), context_of(reference))
    for name in ("hand", "hand_desired", "stage"):
        np.testing.assert_array_equal(found[name], ours[name])


def test_base_says_no_torque():
    with pytest.raises(NotImplementedError):
        outputs(bare := ArmController(SOFT), context_of(bare))


# ---------------------------------------------------------------- the context holds all state


def test_outputs_do_not_depend_on_what_was_evaluated_before(controller):
    used = context_of(controller)
    expected = outputs(controller, used)
    set_state(controller, used, STATE_B)
    used.SetTime(0.7)
    controller.set_cast(used, Cast(0.1, 0.3, 0.4, -0.5))
    other = outputs(controller, used)
    assert not np.array_equal(other["actuation"], expected["actuation"])
    set_state(controller, used, STATE_A)
    used.SetTime(0.3)
    controller.set_cast(used, CAST)
    assert_same(outputs(controller, used), expected)
    fresh = CastController(SOFT)
    assert_same(outputs(fresh, context_of(fresh)), expected)


def test_outputs_do_not_depend_on_the_order_of_evaluation(controller):
    expected = outputs(controller, context_of(controller))
    for name in OUTPUTS:
        alone = controller.GetOutputPort(name).Eval(context_of(controller))
        np.testing.assert_array_equal(alone, expected[name])


def test_cast_round_trips_through_the_context_and_no_other_context(controller):
    one, other = context_of(controller), context_of(controller)
    controller.set_cast(one, Cast(0.11, 0.22, 0.33, -0.44))
    assert controller.get_cast(one) == Cast(0.11, 0.22, 0.33, -0.44)
    assert controller.get_cast(other) == CAST


def test_new_cast_changes_every_output_that_depends_on_it(controller):
    context = context_of(controller, time=3.35)  # in the wait, and then in the move
    before = outputs(controller, context)
    controller.set_cast(context, Cast(0.3, 0.5, 0.1, bearing=0.25))
    after = outputs(controller, context)
    fresh = context_of(controller, time=3.35, cast=Cast(0.3, 0.5, 0.1, 0.25))
    assert_same(after, outputs(controller, fresh))
    for name in ("actuation", "hand_desired", "stage"):
        assert not np.array_equal(before[name], after[name]), name
    np.testing.assert_array_equal(before["hand"], after["hand"])


def test_clone_gives_what_its_original_gave(controller):
    # The clone's caches count as up to date: what they hold must be worth it.
    context = context_of(controller)
    outputs(controller, context)
    clone = context.Clone()
    clone.SetTime(0.45)
    assert_same(outputs(controller, clone), outputs(controller, context_of(controller, time=0.45)))


def test_clone_and_original_do_not_share_anything(controller):
    context = context_of(controller)
    expected = outputs(controller, context)
    clone = context.Clone()
    controller.set_cast(clone, Cast(0.1, 0.3, 0.4, -0.5))
    set_state(controller, clone, STATE_B)
    in_clone = outputs(controller, clone)
    # A change of time makes the original compute its torque anew, from an arm context that must still be its own.
    context.SetTime(0.31)
    context.SetTime(0.3)
    assert_same(outputs(controller, context), expected)

    controller.set_cast(context, Cast(0.2, 0.4, 0.0, 0.1))
    set_state(controller, context, 0.5 * STATE_A)
    outputs(controller, context)
    clone.SetTime(0.31)
    clone.SetTime(0.3)
    assert_same(outputs(controller, clone), in_clone)


def test_simulating_writes_no_attribute():
    station = CastStation(Scenario(), has_scene=False)
    before = dict(vars(station.controller))
    arrays = {name: value.copy() for name, value in before.items() if isinstance(value, np.ndarray)}
    simulator = Simulator(station.diagram)
    station.set_start(simulator.get_mutable_context(), Cast(0.3, 0.6, 0.1))
    simulator.AdvanceTo(0.05)
    after = vars(station.controller)
    assert after.keys() == before.keys()
    assert all(after[name] is before[name] for name in before)
    for name, value in arrays.items():
        np.testing.assert_array_equal(after[name], value)


class Meddler(CastController):
    """Leaves its own model of the arm in another state than the one that was measured."""

    def torque(self, arm, desired):
        torque = super().torque(arm, desired)
        arm.plant.SetPositionsAndVelocities(arm.context, np.zeros(14))
        return torque


def test_what_a_torque_does_to_the_model_changes_no_other_output():
    ours, meddler = CastController(Scenario()), Meddler(Scenario())
    state = np.concatenate([starting_posture(Scenario()), 0.1 * np.ones(7)])
    found = []
    for controller in (ours, meddler):
        context = controller.CreateDefaultContext()
        controller.GetInputPort("arm_state").FixValue(context, state)
        outputs = [controller.GetOutputPort(name).Eval(context) for name in ("actuation", "hand")]
        context.SetTime(0.1)
        found.append([*outputs, controller.GetOutputPort("actuation").Eval(context)])
    for one, other in zip(*found, strict=True):
        np.testing.assert_array_equal(one, other)


def test_torque_of_a_force_does_its_work_and_carries_the_arm_in_its_posture():
    controller, arm, force = CastController(SOFT), Arm(), np.array([3.0, -5.0, 7.0])
    measured = MeasuredArm(controller.plant)
    measured.measure(STATE_A)
    torque = controller.torque_of_force(force, measured)
    none = controller.torque_of_force(np.zeros(3), measured)
    np.testing.assert_allclose(torque - none, arm.exact_jacobian(STATE_A[:7]).T @ force, atol=1e-12)
    # At home and at rest the posture asks for nothing.
    measured.measure(np.concatenate([starting_posture(SOFT), np.zeros(7)]))
    np.testing.assert_allclose(controller.torque_of_force(np.zeros(3), measured), measured.holding_torque, atol=1e-12)
