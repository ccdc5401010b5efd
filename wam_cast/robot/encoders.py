"""The encoders of the motors: the arm's state as the controller sees it."""

from __future__ import annotations

import numpy as np
from pydrake.multibody.plant import MultibodyPlant
from pydrake.systems.framework import BasicVector, Context, LeafSystem

from wam_cast.robot.plant import N_ARM
from wam_cast.types import Array


def encoder_resolution(plant: MultibodyPlant, counts: int) -> Array:
    """Return what one count of a motor's encoder is at its joint [rad], shape (7,); `counts` are those of a revolution."""
    actuators = (plant.get_joint_actuator(index) for index in plant.GetJointActuatorIndices())
    return np.array([2 * np.pi / (counts * actuator.default_gear_ratio()) for actuator in actuators])


class Encoders(LeafSystem):
    """Rounds angles to integer counts, and speeds to integer counts in a control period.

    The speeds are as coarse as a difference of two samples, but not late as that would be.

    Ports: arm_state -> measured; each is q [rad] and v [rad/s], (14).

    Parameters
    ----------
    resolution
        What one count is at the joint [rad], shape (7,).
    period
        Of the control [s].
    """

    def __init__(self, resolution: Array, period: float) -> None:
        super().__init__()
        self._unit = np.concatenate([resolution, resolution / period])
        self._input = self.DeclareVectorInputPort("arm_state", 2 * N_ARM)
        self.DeclareVectorOutputPort("measured", 2 * N_ARM, self._calc_measured, {self._input.ticket()})

    def _calc_measured(self, context: Context, output: BasicVector) -> None:
        output.SetFromVector(np.rint(self._input.Eval(context) / self._unit) * self._unit)
