"""The controller's end of the wire as blocks of a diagram: what receives a status, and what sends the command that answers it."""

from __future__ import annotations

from typing import Any

import numpy as np
from drake import lcmt_panda_command, lcmt_panda_status
from pydrake.common.value import AbstractValue
from pydrake.systems.framework import BasicVector, Context

from wam_cast.robot.drake_types import evaluate
from wam_cast.robot.motors import saturate
from wam_cast.robot.plant import N_ARM
from wam_cast.robot.python_system import PythonSystem
from wam_cast.types import Array
from wam_cast.wire.messages import Command, ControlMode, command_message, status_of


class StatusReceiver(PythonSystem):
    """Takes the arm's state out of its status.

    Ports: status (`lcmt_panda_status`) -> arm_state: q [rad] and v [rad/s], (14)
    """

    def __init__(self) -> None:
        super().__init__()
        self._status = self.DeclareAbstractInputPort("status", AbstractValue.Make(lcmt_panda_status()))
        self.DeclareVectorOutputPort("arm_state", 2 * N_ARM, self._calc_arm_state, {self._status.ticket()})

    def _calc_arm_state(self, context: Context, output: BasicVector) -> None:
        status = status_of(evaluate(self._status, context))
        output.SetFromVector(np.concatenate([status.q, status.v]))


class CommandSender(PythonSystem):
    """Answers each status of the arm: while the brakes are closed, to stay where it is; from then on with a torque.

    A torque beyond what the motors give is cut off, as they would.

    Ports: status (`lcmt_panda_status`), torque [N m] (7) -> command (`lcmt_panda_command`)

    Parameters
    ----------
    limits
        Of the torques [N m], (7,).
    """

    def __init__(self, limits: Array) -> None:
        super().__init__()
        self._limits = limits
        self._status = self.DeclareAbstractInputPort("status", AbstractValue.Make(lcmt_panda_status()))
        self._torque = self.DeclareVectorInputPort("torque", N_ARM)
        tickets = {self._status.ticket(), self._torque.ticket()}
        calc: Any = self._calc_command  # the stubs want a function of any two objects
        self.DeclareAbstractOutputPort("command", lambda: AbstractValue.Make(lcmt_panda_command()), calc, tickets)

    def _calc_command(self, context: Context, output: AbstractValue) -> None:
        status = status_of(evaluate(self._status, context))
        if status.control_mode is ControlMode.LOCKED:
            command = Command(status.utime, ControlMode.POSITION, position=status.q)
        else:
            torque = saturate(evaluate(self._torque, context), self._limits)
            command = Command(status.utime, ControlMode.TORQUE, torque=torque)
        output.set_value(command_message(command))
