"""ActionLoop: a station under way whose motors are told by a caller, control period by control period."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from wam_cast.robot.controller import CastController, MeasuredArm
from wam_cast.robot.plant import N_ARM
from wam_cast.robot.station import CastStation
from wam_cast.scenario import Scenario
from wam_cast.simulation.integration import choose_integration
from wam_cast.simulation.sampled_loop import SampledLoop
from wam_cast.types import Array

ToTorque = Callable[[CastController, MeasuredArm, Array], Array]
"""Torque [N m], (7,), of a controller's parts, the arm as it is measured, and an action."""


def torque_itself(_controller: CastController, _arm: MeasuredArm, action: Array) -> Array:
    """Return the action, joint torques [N m], (7,)."""
    return action


def torque_of_force(controller: CastController, arm: MeasuredArm, action: Array) -> Array:
    """Return the torques [N m], (7,), of a force of the hand [N], (3,), world frame: see `.CastController.torque_of_force`."""
    return controller.torque_of_force(action, arm)


class ActionLoop(SampledLoop):
    """A `.SampledLoop` with contact whose controller is replaced by an action that is held for a control period.

    Encoders, delay, noise of the torque and motors are the station's. The diagram is built once; `begin` starts anew in it.

    Raises
    ------
    InputError
        If the scenario cannot be simulated.
    """

    _action: Array

    def __init__(self, scenario: Scenario, to_torque: ToTorque) -> None:
        station = CastStation(scenario)
        integration = choose_integration(station)
        accuracy = scenario.simulation.contact_accuracy
        super().__init__(station, integration.contact_method, integration.max_step, accuracy)
        self._to_torque = to_torque

    def step(self, action: Array) -> None:
        """Hold an action for a control period; raises `.DivergedError` if the numbers run away."""
        self._action = action
        self.advance(self._n + 1)

    def _commanded(self, arm: MeasuredArm, time: float) -> Array:  # noqa: ARG002
        assert isinstance(self._controller, CastController)
        return self._to_torque(self._controller, arm, self._action)

    @property
    def period(self) -> float:
        """Of the control [s]."""
        return self._period

    @property
    def state_of_plant(self) -> Array:
        """Positions and velocities of the plant, shape (n_x,)."""
        return self._states[-1].copy()

    def measured(self) -> Array:
        """Return the arm's q [rad] and v [rad/s] as the encoders read them, (14,)."""
        arm_state: Array = self._states[-1][self._of_arm]
        encoders = self.station.encoders
        return arm_state if encoders is None else encoders.measured(arm_state)

    def ball(self) -> tuple[Array, Array]:
        """Return p_WL [m] and v_WL [m/s], (3,) each."""
        context, ball = self.plant_context, self.plant.GetBodyByName("ball")
        velocity = ball.EvalSpatialVelocityInWorld(context).translational()
        return np.array(ball.EvalPoseInWorld(context).translation()), np.array(velocity)

    def arm(self) -> tuple[Array, Array]:
        """Return the arm's true q [rad] and v [rad/s], (7,) each."""
        arm_state = self._states[-1][self._of_arm]
        return arm_state[:N_ARM], arm_state[N_ARM:]
