"""The encoders of the motors: the arm's state as the controller sees it."""

from __future__ import annotations

import numpy as np
from pydrake.systems.framework import BasicVector, Context

from wam_cast.robot.drake_types import evaluate
from wam_cast.robot.plant import N_ARM
from wam_cast.robot.python_system import PythonSystem
from wam_cast.types import Array


class Encoders(PythonSystem):
    """Adds an offset to the angles, and rounds angles to integer counts and speeds to integer counts in a control period.

    The speeds are as coarse as a difference of two samples, but not late as that would be.

    Ports: arm_state -> measured; each is q [rad] and v [rad/s], (14).

    Parameters
    ----------
    resolution
        What one count is at the joint [rad], shape (7,); 0: exact.
    period
        Of the control [s].
    offset
        By which the angles are read too large [rad], shape (7,).
    """

    def __init__(self, resolution: Array, period: float, offset: Array) -> None:
        super().__init__()
        self._offset = np.concatenate([offset, np.zeros(N_ARM)])
        self._unit = np.concatenate([resolution, resolution / period])
        self._input = self.DeclareVectorInputPort("arm_state", 2 * N_ARM)
        self.DeclareVectorOutputPort("measured", 2 * N_ARM, self._calc_measured, {self._input.ticket()})

    def measured(self, arm_state: Array) -> Array:
        """Return what is read of an arm's state, (14,) each."""
        measured: Array = arm_state + self._offset
        counted = self._unit > 0
        measured[counted] = np.rint(measured[counted] / self._unit[counted]) * self._unit[counted]
        return measured

    def _calc_measured(self, context: Context, output: BasicVector) -> None:
        output.SetFromVector(self.measured(evaluate(self._input, context)))
