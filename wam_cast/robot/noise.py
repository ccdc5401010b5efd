"""TorqueNoise: the noise of the commanded torques as a block; what it draws says `wam_cast.motion.noise_draws`."""

from __future__ import annotations

import math

from pydrake.common.value import Value
from pydrake.systems.framework import AbstractParameterIndex, BasicVector, Context

from wam_cast.motion.noise_draws import torque_deviates
from wam_cast.robot.drake_types import evaluate, held
from wam_cast.robot.plant import N_ARM
from wam_cast.robot.python_system import PythonSystem
from wam_cast.types import Array


class TorqueNoise(PythonSystem):
    """Adds noise to the commanded torque.

    The noise is a pure function of the noise seed, an abstract parameter of the context, and of the number of the control
    period: any two of these systems agree on it.

    Ports: commanded [N m] (7) -> torque [N m] (7)

    Parameters
    ----------
    share
        Standard deviation as a fraction of each joint's limit.
    limits
        Of the torques [N m], shape (7,).
    period
        Of the control [s].
    """

    def __init__(self, share: float, limits: Array, period: float) -> None:
        super().__init__()
        self._deviation, self._period = share * limits, period
        self._input = self.DeclareVectorInputPort("commanded", N_ARM)
        # A Python object, since a number of Drake's could not hold every integer.
        self._seed_index = self.DeclareAbstractParameter(Value[object](0))
        seed_ticket = self.abstract_parameter_ticket(AbstractParameterIndex(self._seed_index))
        self.DeclareVectorOutputPort(
            "torque", N_ARM, self._calc_torque, {self._input.ticket(), seed_ticket, self.time_ticket()}
        )

    def set_seed(self, context: Context, noise_seed: int) -> None:
        """Set the noise seed in this system's own `context`."""
        context.get_mutable_abstract_parameter(self._seed_index).set_value(noise_seed)

    def added_to(self, commanded: Array, time: float, noise_seed: int) -> Array:
        """Return the commanded torque [N m], (7,), with the noise of a seed at a time [s]."""
        # A sample's time may fall short of it by rounding.
        sample = math.floor(time / self._period + 1e-6)
        return commanded + self._deviation * torque_deviates(noise_seed, sample)

    def _calc_torque(self, context: Context, output: BasicVector) -> None:
        seed = held(context.get_abstract_parameter(self._seed_index))
        output.SetFromVector(self.added_to(evaluate(self._input, context), context.get_time(), seed))
