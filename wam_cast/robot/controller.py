"""CastController: the paper's Cartesian PD through the Jacobian's transpose, and what a real arm needs beside it."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
from pydrake.common.value import AbstractValue
from pydrake.multibody.tree import JacobianWrtVariable
from pydrake.systems.framework import BasicVector, LeafSystem, NumericParameterIndex, ValueProducer
from scipy.linalg.lapack import dposv

from wam_cast.cast import Cast
from wam_cast.motion.stages import CastMotion
from wam_cast.robot.plant import N_ARM, make_arm_plant, starting_posture
from wam_cast.scenario import Scenario
from wam_cast.types import Array

DIFFERENTIALS = ((1, 2), (4, 5))
"""Pairs of joints (from 0) that share two motors through a cable differential: 2 with 3, and 5 with 6."""


class _Reference:
    """What depends on the cast alone: the hand's reference and the posture that the null space keeps."""

    def __init__(self, motion: CastMotion, q_posture: Array) -> None:
        self.motion = motion
        self._rest_state = np.concatenate([q_posture, np.zeros(N_ARM)])

    def posture(self, t: float) -> Array:
        """Return the arm's state (14,) that the null space keeps at time `t` [s]: the starting posture, which turns along."""
        bearing, rate = self.motion.bearing(t)
        state = self._rest_state.copy()
        state[0], state[N_ARM] = -bearing, -rate
        return state


class _Scratch:
    """Holds a context of the arm's plant; a plain object, since Drake's values cannot hold a Context from Python."""

    def __init__(self, plant: Any) -> None:
        self.plant = plant
        self.context = plant.CreateDefaultContext()

    def __deepcopy__(self, memo: Any) -> _Scratch:
        # A cloned diagram context must not share the arm's context with the one that it came from.
        return _Scratch(self.plant)


def saturate(torque: Array, limits: Array) -> Array:
    """Return `torque` within what the motors give, each array [N m] of shape (7,).

    Joints of their own are clipped. The two joints of a differential load the same motors: |tau_a| / limit_a +
    |tau_b| / limit_b <= 1, and a pair beyond it is scaled, which keeps its direction.
    """
    return np.asarray(torque / np.maximum(motor_load(torque, limits), 1.0))


def motor_load(torque: Array, limits: Array) -> Array:
    """Return the share of each joint's motors that `torque`, shape (..., 7), asks for; a differential's joints have the pair's."""
    load = np.abs(torque) / limits
    for a, b in DIFFERENTIALS:
        load[..., a] = load[..., b] = load[..., a] + load[..., b]
    return np.asarray(load)


class CastController(LeafSystem):
    """Moves the hand along a cast.

    With J the hand's translational Jacobian, and desired values from `CastMotion`:

        u_x = K_p (p_WE_desired - p_WE) + K_d (v_WE_desired - v_WE)              (Section 2.3 of the paper)
        u_q = J^T u_x + g(q) + N (K_posture (q_posture - q) + D_posture (v_posture - v))
        N   = I - J^T (J J^T)^-1 J                        torques that are statically without force at the hand

    and the result is kept within the motors' torques (`saturate`). The posture is the arm's at the start of the cast; during the
    turn its joint 1 turns along, else v_posture is zero. g(q) holds the arm alone, not the string and the ball, of
    which the controller knows nothing. It is a pure function of time, arm state and cast: the cast is a numeric parameter of
    the context, what follows from it alone a cache entry.

    Ports
    -----
    arm_state -> actuation [N m] (7), hand [m, m/s] (6), hand_desired [m, m/s] (6), stage (1);
    `arm_state` is q [rad] and v [rad/s], (14), `hand` is p_WE and v_WE.
    """

    def __init__(self, scenario: Scenario) -> None:
        super().__init__()
        self._scenario = scenario
        self._plant = make_arm_plant(scenario)
        self._hand_frame = self._plant.GetFrameByName("tool_plate")
        self._hand_body = self._hand_frame.body()
        self._world_frame = self._plant.world_frame()
        self._kp, self._kd = scenario.controller.kp, scenario.controller.kd
        self._posture_gain = np.hstack(
            [np.diag(scenario.controller.posture_stiffness), np.diag(scenario.controller.posture_damping)]
        )
        self.torque_limits: Array = self._plant.GetEffortUpperLimits()

        self._input = self.DeclareVectorInputPort("arm_state", 2 * N_ARM)
        self._cast_index = self.DeclareNumericParameter(BasicVector([0.3, 0.6, 0.1, 0.0, 0.0, math.nan]))
        cast_ticket = self.numeric_parameter_ticket(NumericParameterIndex(self._cast_index))
        state_ticket = self.input_port_ticket(self._input.get_index())
        self._reference = self.DeclareCacheEntry(
            description="reference",
            value_producer=ValueProducer(
                allocate=lambda: AbstractValue.Make(object()),  # Drake 1.58 refuses None
                calc=self._calc_reference,
            ),
            prerequisites_of_calc={cast_ticket},
        )
        # Not a result but a place to compute in, one for each context: whoever uses it sets the arm's state first.
        self._scratch = self.DeclareCacheEntry(
            description="scratch context of the arm",
            value_producer=ValueProducer(
                allocate=lambda: AbstractValue.Make(_Scratch(self._plant)), calc=lambda _context, _value: None
            ),
            prerequisites_of_calc={self.nothing_ticket()},
        )
        time_ticket = self.time_ticket()
        self.DeclareVectorOutputPort(
            "actuation", N_ARM, self._calc_actuation, {time_ticket, cast_ticket, state_ticket}
        )
        self.DeclareVectorOutputPort("hand", 6, self._calc_hand, {state_ticket})
        self.DeclareVectorOutputPort("hand_desired", 6, self._calc_hand_desired, {time_ticket, cast_ticket})
        self.DeclareVectorOutputPort("stage", 1, self._calc_stage, {time_ticket, cast_ticket})

    def set_cast(
        self, context: Any, cast: Cast, *, start_bearing: float = 0.0, cup_radius: float | None = None
    ) -> None:
        """Set in this system's own `context` the cast, and what else its motion depends on: see `CastMotion`."""
        parameter = context.get_mutable_numeric_parameter(self._cast_index)
        place = math.nan if cup_radius is None else cup_radius
        parameter.SetFromVector([cast.distance, cast.speed, cast.wait, cast.bearing, start_bearing, place])

    def get_cast(self, context: Any) -> Cast:
        """Return the cast in this system's own `context`."""
        *parameters, bearing = context.get_numeric_parameter(self._cast_index).value()[:4]
        return Cast.from_array(np.array(parameters), bearing)

    def _calc_reference(self, context: Any, value: Any) -> None:
        cast = self.get_cast(context)
        start_bearing, place = context.get_numeric_parameter(self._cast_index).value()[4:]
        motion = CastMotion(
            self._scenario,
            cast,
            start_bearing=start_bearing,
            cup_radius=None if math.isnan(place) else place,
        )
        q_posture = starting_posture(self._plant, self._scenario, cast.bearing)
        value.set_value(_Reference(motion, q_posture))

    def _hand_kinematics(self, context: Any) -> tuple[Any, Any, Array]:
        """Return the arm's context, p_WE (3,) and Jv_WE (3, 7)."""
        arm = self._scratch.Eval(context).context
        self._plant.SetPositionsAndVelocities(arm, self._input.Eval(context))
        p_WE = self._hand_body.EvalPoseInWorld(arm).translation()
        Jv_WE = self._plant.CalcJacobianTranslationalVelocity(
            arm, JacobianWrtVariable.kV, self._hand_frame, _ORIGIN, self._world_frame, self._world_frame
        )
        return arm, p_WE, Jv_WE

    def _calc_actuation(self, context: Any, output: Any) -> None:
        arm, p_WE, J = self._hand_kinematics(context)
        state = self._input.Eval(context)
        reference = self._reference.Eval(context)
        p_desired, v_desired = reference.motion.evaluate(context.get_time())
        u_x = self._kp * (p_desired - p_WE) + self._kd * (v_desired - J @ state[N_ARM:])
        posture = self._posture_gain @ (reference.posture(context.get_time()) - state)
        # dposv solves a positive definite system without the checks that cost numpy.linalg.solve most of its time.
        _, force_of_posture, failed = dposv(J @ J.T, J @ posture)
        if failed:  # a straight arm cannot push along itself
            force_of_posture = np.linalg.lstsq(J.T, posture)[0]
        gravity = -self._plant.CalcGravityGeneralizedForces(arm)
        u_q = J.T @ (u_x - force_of_posture) + posture + gravity
        output.SetFromVector(saturate(u_q, self.torque_limits))

    def _calc_hand(self, context: Any, output: Any) -> None:
        _, p_WE, J = self._hand_kinematics(context)
        output.SetFromVector(np.concatenate([p_WE, J @ self._input.Eval(context)[N_ARM:]]))

    def _calc_hand_desired(self, context: Any, output: Any) -> None:
        output.SetFromVector(
            np.concatenate(self._reference.Eval(context).motion.evaluate(context.get_time()))
        )

    def _calc_stage(self, context: Any, output: Any) -> None:
        output.SetFromVector([self._reference.Eval(context).motion.stage(context.get_time())])


_ORIGIN = np.zeros(3)
