"""The motors: the torques that they give of what is commanded, delayed and held from sample to sample."""

from __future__ import annotations

import numpy as np
from pydrake.multibody.plant import MultibodyPlant
from pydrake.systems.framework import BasicVector, Context
from pydrake.systems.primitives import LinearSystem

from wam_cast.arm.arm_chain import DIFFERENTIALS
from wam_cast.robot.drake_types import evaluate
from wam_cast.robot.plant import N_ARM
from wam_cast.robot.python_system import PythonSystem
from wam_cast.scenario import Arm
from wam_cast.types import Array

_LOADS = np.eye(N_ARM)
"""Which joints load a joint's motors."""
for _pair in DIFFERENTIALS:
    _LOADS[np.ix_(_pair, _pair)] = 1.0

_HAS_OWN_MOTORS = _LOADS.sum(axis=1) == 1


ROUNDING = 1e-12
"""By which a pair that was scaled may come out above its limit."""


def motor_utilization(values: Array, limits: Array) -> Array:
    """Return the utilization of each joint's motors by torques [N m] or velocities [rad/s], shape (..., 7), of their limits, (7,).

    A joint with motors of its own has its value relative to its limit. The joints a, b of a differential load the same two motors,
    the busier of which has ``|a| / limit_a + |b| / limit_b``; both joints have that.
    """
    return np.asarray(np.abs(values) / limits @ _LOADS)


def saturate(torque: Array, limits: Array) -> Array:
    """Return `torque` within what the motors give, each array [N m] of shape (7,).

    Joints of their own are clipped; a differential's pair beyond its motors' limit is scaled, which keeps its direction. What is
    saturated already stays as it is, to the last bit.
    """
    utilization = motor_utilization(torque, limits)
    if np.all(utilization <= 1 + ROUNDING):
        return torque
    return np.where(_HAS_OWN_MOTORS, np.clip(torque, -limits, limits), torque / np.maximum(utilization, 1.0))


class TorqueLimits:
    """What the arm's motors give at most: their peak torque up to `Arm.knee_speed`, from there on less.

    Above the knee the limits of torques that drive the motion fall linearly, to zero at the velocity limit.

    Parameters
    ----------
    plant
        With the arm, whose effort limits are those of the scaled torque.
    arm
        Of the scenario.
    """

    def __init__(self, plant: MultibodyPlant, arm: Arm) -> None:
        self._knee = arm.knee_speed
        self._peak: Array = plant.GetEffortUpperLimits()
        self._velocity_limits: Array = plant.GetVelocityUpperLimits()[:N_ARM]

    def at(self, v: Array, torque: Array) -> Array:
        """Return the limits [N m] at joint velocities `v` [rad/s] of torques with the signs of `torque`, each (..., 7)."""
        if self._knee == 1:
            return self._peak
        speed = motor_utilization(v, self._velocity_limits)
        left = np.clip((1 - speed) / (1 - self._knee), 1e-6, 1.0)
        return np.asarray(self._peak * np.where(torque * v > 0, left, 1.0))


class Motors(PythonSystem):
    """Scales the commanded torque as this arm's motors do, and saturates it at what they give.

    Ports: commanded [N m] (7), arm_state (q [rad], v [rad/s], 14; read only if there is a knee) -> torque [N m] (7)

    Parameters
    ----------
    plant, arm
        As of `.TorqueLimits`.

    Attributes
    ----------
    limits
        Of commanded torques [N m], shape (7,), below the knee.
    has_knee
        Whether they give less to a fast arm.
    """

    def __init__(self, plant: MultibodyPlant, arm: Arm) -> None:
        super().__init__()
        self._scale, self._torque_limits = np.array(arm.torque_scale), TorqueLimits(plant, arm)
        self.limits: Array = plant.GetEffortUpperLimits() / self._scale
        self.has_knee = arm.knee_speed < 1
        self._commanded = self.DeclareVectorInputPort("commanded", N_ARM)
        self._arm_state = self.DeclareVectorInputPort("arm_state", 2 * N_ARM)
        tickets = {self._commanded.ticket()} | ({self._arm_state.ticket()} if self.has_knee else set())
        self.DeclareVectorOutputPort("torque", N_ARM, self._calc_torque, tickets)

    def given(self, commanded: Array, arm_state: Array | None = None) -> Array:
        """Return the torque [N m], (7,), that they give of a commanded one; with a knee the `arm_state` (14,) is needed."""
        limits = self.limits
        if self.has_knee:
            assert arm_state is not None
            limits = self._torque_limits.at(arm_state[N_ARM:], commanded) / self._scale
        return self._scale * saturate(commanded, limits)

    def _calc_torque(self, context: Context, output: BasicVector) -> None:
        arm_state = evaluate(self._arm_state, context) if self.has_knee else None
        output.SetFromVector(self.given(evaluate(self._commanded, context), arm_state))


def delay_line(n_samples: int, period: float) -> LinearSystem:
    """Return a block that samples torques [N m] (7) every `period` [s] and gives the one of `n_samples` before the next.

    One sample is a zero-order hold: the last torque, until the next one. The state is the samples, the newest first. Drake's own
    blocks for it start at zero, this one with what its default state is made.
    """
    n = n_samples * N_ARM
    first, last = np.eye(n, N_ARM), np.eye(N_ARM, n, n - N_ARM)
    return LinearSystem(np.eye(n, k=-N_ARM), first, last, np.zeros((N_ARM, N_ARM)), period)


def pass_through(line: LinearSystem, state: Array, torque: Array) -> tuple[Array, Array]:
    """Return what a delay line gives in a `state` [N m], (7,), and its state after it has sampled a `torque` [N m], (7,)."""
    return line.C() @ state, line.A() @ state + line.B() @ torque


def fill(line: LinearSystem, torque: Array) -> Array:
    """Return the state of a delay line that was given `torque` [N m], (7,), ever since."""
    return np.tile(torque, line.num_states() // N_ARM)
