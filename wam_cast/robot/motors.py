"""The motors: the torques that they give of what is commanded, delayed and held from sample to sample."""

from __future__ import annotations

import numpy as np
from pydrake.multibody.plant import MultibodyPlant
from pydrake.systems.framework import BasicVector, Context
from pydrake.systems.primitives import LinearSystem

from wam_cast.robot.drake_types import evaluate
from wam_cast.robot.plant import N_ARM
from wam_cast.robot.python_system import PythonSystem
from wam_cast.scenario import Arm
from wam_cast.types import Array

DIFFERENTIALS = ((1, 2), (4, 5))
"""Pairs of joints (from 0) that share two motors through a cable differential: 2 with 3, and 5 with 6."""


def motor_utilization(values: Array, limits: Array) -> Array:
    """Return the utilization of each joint's motors by torques [N m] or velocities [rad/s], shape (..., 7), of their limits, (7,).

    A joint with motors of its own has its value relative to its limit. The joints a, b of a differential load the same two motors,
    the busier of which has ``|a| / limit_a + |b| / limit_b``; both joints have that.
    """
    utilization = np.abs(values) / limits
    for a, b in DIFFERENTIALS:
        utilization[..., a] = utilization[..., b] = utilization[..., a] + utilization[..., b]
    return np.asarray(utilization)


def saturate(torque: Array, limits: Array) -> Array:
    """Return `torque` within what the motors give, each array [N m] of shape (7,).

    Joints of their own are clipped; a differential's pair beyond its motors' limit is scaled, which keeps its direction.
    """
    return np.asarray(torque / np.maximum(motor_utilization(torque, limits), 1.0))


class Motors(PythonSystem):
    """Saturates the commanded torque, and scales it as this arm's motors do.

    Above `Arm.knee_speed` the limits of torques that drive the motion fall linearly, to zero at the velocity limit.

    Ports: commanded [N m] (7), arm_state (q [rad], v [rad/s], 14; read only if there is a knee) -> torque [N m] (7)

    Parameters
    ----------
    plant
        With the arm, whose effort limits are those of the scaled torque.
    arm
        Of the scenario.
    """

    def __init__(self, plant: MultibodyPlant, arm: Arm) -> None:
        super().__init__()
        self._scale, self._knee = np.array(arm.torque_scale), arm.knee_speed
        self._limits: Array = plant.GetEffortUpperLimits() / self._scale
        self._velocity_limits: Array = plant.GetVelocityUpperLimits()[:N_ARM]
        self._commanded = self.DeclareVectorInputPort("commanded", N_ARM)
        self._arm_state = self.DeclareVectorInputPort("arm_state", 2 * N_ARM)
        tickets = {self._commanded.ticket()} | ({self._arm_state.ticket()} if self._knee < 1 else set())
        self.DeclareVectorOutputPort("torque", N_ARM, self._calc_torque, tickets)

    def _calc_torque(self, context: Context, output: BasicVector) -> None:
        commanded, limits = evaluate(self._commanded, context), self._limits
        if self._knee < 1:
            limits = self._limits_at(evaluate(self._arm_state, context)[N_ARM:], commanded)
        output.SetFromVector(self._scale * saturate(commanded, limits))

    def _limits_at(self, v: Array, commanded: Array) -> Array:
        """Return the limits [N m], (7,), of torques at joint velocities `v` [rad/s], (7,)."""
        speed = motor_utilization(v, self._velocity_limits)
        left = np.clip((1 - speed) / (1 - self._knee), 1e-6, 1.0)
        return np.asarray(self._limits * np.where(commanded * v > 0, left, 1.0))


def delay_line(n_samples: int, period: float) -> LinearSystem:
    """Return a block that samples torques [N m] (7) every `period` [s] and gives the one of `n_samples` before the next.

    One sample is a zero-order hold: the last torque, until the next one. The state is the samples, the newest first. Drake's own
    blocks for it start at zero, this one with what its default state is made.
    """
    n = n_samples * N_ARM
    first, last = np.eye(n, N_ARM), np.eye(N_ARM, n, n - N_ARM)
    return LinearSystem(np.eye(n, k=-N_ARM), first, last, np.zeros((N_ARM, N_ARM)), period)


def fill(line: LinearSystem, torque: Array) -> Array:
    """Return the state of a delay line that was given `torque` [N m], (7,), ever since."""
    return np.tile(torque, line.num_states() // N_ARM)
