"""Controllers of the arm: what every one of them is, and the paper's Cartesian PD with what a real arm needs beside it."""

from __future__ import annotations

import math
from typing import NamedTuple, Self

import numpy as np
from pydrake.common.value import AbstractValue
from pydrake.multibody.plant import MultibodyPlant
from pydrake.multibody.tree import JacobianWrtVariable
from pydrake.systems.framework import BasicVector, Context, NumericParameterIndex
from scipy.linalg.lapack import dposv

from wam_cast.arm.arm_model import arm_model
from wam_cast.arm.posture import starting_posture
from wam_cast.cast import Cast, default_cast
from wam_cast.motion.stages import CastMotion, cast_motion
from wam_cast.robot.drake_types import declare_cache_entry, evaluate, evaluate_cache, weakly
from wam_cast.robot.plant import N_ARM, make_arm_plant
from wam_cast.robot.python_system import PythonSystem
from wam_cast.scenario import Scenario
from wam_cast.types import Array, checks_types


class MeasuredArm:
    """The arm as a controller knows it: what the encoders say, put into the controller's own model of the arm alone.

    Attributes
    ----------
    q, v, state
        Joint angles [rad] and velocities [rad/s], (7,) each, and both in one, (14,).
    plant, context
        The model, and a context of it in this state.
    """

    def __init__(self, plant: MultibodyPlant) -> None:
        self.plant = plant
        self.context: Context = plant.CreateDefaultContext()
        self._hand, self._world = plant.GetFrameByName("tool_plate"), plant.world_frame()
        self._hand_body = self._hand.body()
        self.measure(np.zeros(2 * N_ARM))

    def measure(self, state: Array) -> None:
        """Take on a measured state (14,)."""
        self.state, self.q, self.v = state, state[:N_ARM], state[N_ARM:]
        self.plant.SetPositionsAndVelocities(self.context, state)

    def __deepcopy__(self, memo: object) -> Self:
        # A cloned diagram context must not share the arm's context with the one that it came from.
        clone = type(self)(self.plant)
        clone.measure(self.state)
        return clone

    @property
    def p_WE(self) -> Array:
        """The hand's position [m], (3,)."""
        p_WE: Array = self._hand_body.EvalPoseInWorld(self.context).translation()
        return p_WE

    @property
    def v_WE(self) -> Array:
        """The hand's velocity [m/s], (3,)."""
        return np.asarray(self.Jv_WE @ self.v)

    @property
    def Jv_WE(self) -> Array:
        """The hand's translational Jacobian, (3, 7): v_WE = Jv_WE v."""
        # The translational one by itself would take Drake almost twice as long.
        J: Array = self.plant.CalcJacobianSpatialVelocity(
            self.context, JacobianWrtVariable.kV, self._hand, _ORIGIN, self._world, self._world
        )
        return J[3:]

    @property
    def holding_torque(self) -> Array:
        """The torque that carries the arm's own weight [N m], (7,)."""
        torque: Array = -self.plant.CalcGravityGeneralizedForces(self.context)
        return torque


class Desired(NamedTuple):
    """What the hand is to do: position p_WE [m] and velocity v_WE [m/s], (3,) each, at a time [s] from the start of the motion."""

    p_WE: Array
    v_WE: Array
    time: float
    motion: CastMotion


class ArmController(PythonSystem):
    """Base of a controller: a subclass says in `torque` what it wants of the motors.

    It is a pure function of time, arm state and cast: the cast is a numeric parameter of the context, by default `.default_cast`,
    its motion a cache entry.
    What the motors cannot give the station's `.Motors` cut off.

    Ports: arm_state -> actuation [N m] (7), hand [m, m/s] (6), hand_desired [m, m/s] (6), stage (1);
    `arm_state` is q [rad] and v [rad/s], (14), `hand` is p_WE and v_WE.

    Parameters
    ----------
    scenario
        Of the casts, and of the robot as the controller knows it.

    Attributes
    ----------
    scenario, plant
        As given, and the controller's own model of the arm.
    """

    @checks_types
    def __init__(self, scenario: Scenario) -> None:
        super().__init__()
        self.scenario = scenario
        plant = self.plant = make_arm_plant(scenario)
        self._input = self.DeclareVectorInputPort("arm_state", 2 * N_ARM)
        by_default = BasicVector(np.array([*default_cast(scenario).to_array(), 0.0, 0.0, math.nan]))
        self._cast_index = self.DeclareNumericParameter(by_default)
        time, arm_state = self.time_ticket(), self._input.ticket()
        cast = self.numeric_parameter_ticket(NumericParameterIndex(self._cast_index))
        # An object at first, since Drake 1.58 refuses None.
        self._motion = declare_cache_entry(self, "motion", object, weakly(self._calc_motion), {cast})
        # Not a result but a place to compute in, one for each context: whoever uses it measures first.
        self._arm = declare_cache_entry(
            self, "measured arm", lambda: MeasuredArm(plant), lambda _context, _value: None, {self.nothing_ticket()}
        )
        self.DeclareVectorOutputPort("actuation", N_ARM, self._calc_actuation, {time, cast, arm_state})
        self.DeclareVectorOutputPort("hand", 6, self._calc_hand, {arm_state})
        self.DeclareVectorOutputPort("hand_desired", 6, self._calc_hand_desired, {time, cast})
        self.DeclareVectorOutputPort("stage", 1, self._calc_stage, {time, cast})

    def torque(self, arm: MeasuredArm, desired: Desired) -> Array:
        """Return the torque [N m], (7,), that the motors are to give."""
        raise NotImplementedError

    def hand_desired(self, time: float, motion: CastMotion) -> tuple[Array, Array]:
        """Return p_WE [m] and v_WE [m/s], (3,) each, that the hand is to have; the tracking error counts from there.

        Here, those of the `motion`; a controller that follows another reference returns its own, or nan if it has none.
        """
        return motion.evaluate(time)

    def set_cast(
        self, context: Context, cast: Cast, *, start_bearing: float = 0.0, cup_radius: float | None = None
    ) -> None:
        """Set in this system's own `context` the cast, and what else its motion depends on: see `.CastMotion`."""
        parameter = context.get_mutable_numeric_parameter(self._cast_index)
        radius = math.nan if cup_radius is None else cup_radius
        parameter.SetFromVector(np.array([*cast.to_array(), cast.bearing, start_bearing, radius]))

    def get_cast(self, context: Context) -> Cast:
        """Return the cast in this system's own `context`."""
        *parameters, bearing = context.get_numeric_parameter(self._cast_index).value()[:4]
        return Cast.from_array(np.array(parameters), bearing)

    def motion(self, context: Context) -> CastMotion:
        """Return the motion of the cast in this system's own `context`."""
        motion: CastMotion = evaluate_cache(self, self._motion, context)
        return motion

    @property
    def is_law(self) -> bool:
        """Whether `torque` and `hand_desired` are all that it does.

        That is so if no subclass has changed the ports, has state of its own, or has declared an event.
        """
        methods = ("_calc_actuation", "_desired", "_measured_arm", "motion")
        n_states = self.num_continuous_states() + self.num_discrete_state_groups() + self.num_abstract_states()
        is_pure = n_states == 0 and not self.has_events
        return is_pure and all(getattr(type(self), one) is getattr(ArmController, one) for one in methods)

    def _calc_motion(self, context: Context, value: AbstractValue) -> None:
        start_bearing, radius = context.get_numeric_parameter(self._cast_index).value()[4:]
        cup_radius = None if math.isnan(radius) else radius
        cast = self.get_cast(context)
        value.set_value(cast_motion(self.scenario, cast, start_bearing=start_bearing, cup_radius=cup_radius))

    def _desired(self, context: Context) -> Desired:
        time, motion = context.get_time(), self.motion(context)
        return Desired(*self.hand_desired(time, motion), time, motion)

    def _measured_arm(self, context: Context) -> MeasuredArm:
        arm: MeasuredArm = evaluate_cache(self, self._arm, context)
        arm.measure(evaluate(self._input, context))
        return arm

    def _calc_actuation(self, context: Context, output: BasicVector) -> None:
        output.SetFromVector(self.torque(self._measured_arm(context), self._desired(context)))

    def _calc_hand(self, context: Context, output: BasicVector) -> None:
        arm = self._measured_arm(context)
        output.SetFromVector(np.concatenate([arm.p_WE, arm.v_WE]))

    def _calc_hand_desired(self, context: Context, output: BasicVector) -> None:
        output.SetFromVector(np.concatenate(self._desired(context)[:2]))

    def _calc_stage(self, context: Context, output: BasicVector) -> None:
        output.SetFromVector(np.array([self.motion(context).stage(context.get_time())], dtype=float))


class CastController(ArmController):
    """Moves the hand along a cast.

    With J the hand's translational Jacobian, and desired values from `.CastMotion`::

        u_x = K_p (p_WE_desired - p_WE) + K_d (v_WE_desired - v_WE)              (Section 2.3 of the paper)
        u_q = J^T u_x + g(q) + N (K_posture (q_posture - q) + D_posture (v_posture - v))
        N   = I - J^T (J J^T)^-1 J                        null-space torques: zero force at the end effector

    The posture is the arm's at the start of the cast; during the turn its joint 1 turns along, else v_posture is zero. g(q) holds
    the arm alone, not the string and the ball, of which the controller knows nothing.
    """

    def __init__(self, scenario: Scenario) -> None:
        super().__init__(scenario)
        gains = scenario.controller
        self._kp, self._kd = gains.kp, gains.kd
        self._joint_1_turn = arm_model(scenario.arm).joint_1_turn
        self._posture_gain = np.hstack([np.diag(gains.posture_stiffness), np.diag(gains.posture_damping)])
        self._rest_state = np.concatenate([starting_posture(scenario), np.zeros(N_ARM)])

    def torque(self, arm: MeasuredArm, desired: Desired) -> Array:
        """Return the law's torque [N m], (7,)."""
        J = arm.Jv_WE
        u_x = self._kp * (desired.p_WE - arm.p_WE) + self._kd * (desired.v_WE - J @ arm.v)
        return self._torque_of(u_x, J, arm, self._posture(desired))

    def torque_of_force(self, force: Array, arm: MeasuredArm) -> Array:
        """Return the torque [N m], (7,), with which the hand pushes with a `force` [N], (3,), world frame.

        It is the law's u_q with this force in place of u_x: it carries the arm's weight and keeps the starting posture.
        """
        return self._torque_of(force, arm.Jv_WE, arm, self._rest_state)

    def _torque_of(self, u_x: Array, J: Array, arm: MeasuredArm, rest_state: Array) -> Array:
        """Return u_q of the law, (7,), for a force of the hand, and the arm's state (14,) that the null space keeps."""
        posture = self._posture_gain @ (rest_state - arm.state)
        # dposv solves a positive definite system without the checks that cost numpy.linalg.solve most of its time.
        _, force_of_posture, failed = dposv(J @ J.T, J @ posture)
        if failed:  # a straight arm cannot push along itself
            force_of_posture = np.linalg.lstsq(J.T, posture)[0]
        return np.asarray(J.T @ (u_x - force_of_posture) + posture + arm.holding_torque)

    def _posture(self, desired: Desired) -> Array:
        """Return the arm's state (14,) that the null space keeps: the starting posture, which turns along."""
        bearing, rate = desired.motion.bearing(desired.time)
        state = self._rest_state.copy()
        state[0], state[N_ARM] = self._joint_1_turn * bearing, self._joint_1_turn * rate
        return state


_ORIGIN = np.zeros(3)
