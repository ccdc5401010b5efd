"""What goes over the wire: the arm's status and the controller's command, in the types that Drake ships for a Panda.

Of Drake's types for arms of seven joints these are the ones that have all of it: position, velocity and torque of each joint, the
control mode that a command expects and the one that the arm is in. `lcmt_iiwa_command` has no mode, and `lcmt_iiwa_status` no
velocity. The type says how the bytes lie, not whose arm it is: seven joints, from base to hand, in radians, radians per second
and newton metres.

Conventions of their own, on top of Drake's:

- `utime` of a status is the arm's clock [us], which never goes back. `utime` of a command is that of the status that it answers: so
  the arm tells the age of a command by its own clock alone, and no two clocks need be set alike.
- `robot_utime` of a status is the time since the motion began [us]: 0 until then.
"""

from __future__ import annotations

from dataclasses import dataclass
from enum import IntEnum
from typing import Any

import numpy as np
from drake import lcmt_panda_command, lcmt_panda_status

from wam_cast.types import Array

STATUS_CHANNEL, COMMAND_CHANNEL = "WAM_STATUS", "WAM_COMMAND"

N_JOINTS = 7

MICROSECONDS = 1e6
"""In a second."""


class ControlMode(IntEnum):
    """What a command asks for, and what the arm does; the values are those of Drake's bits."""

    LOCKED = 0
    """The brakes are closed. No command asks for it."""
    POSITION = lcmt_panda_status.CONTROL_MODE_POSITION
    """The arm holds a position."""
    TORQUE = lcmt_panda_status.CONTROL_MODE_TORQUE
    """The arm gives the torques that it is told."""


class RobotMode(IntEnum):
    """How the arm is; the values are those of Drake's Panda."""

    IDLE = lcmt_panda_status.kIdle
    """It waits for a controller."""
    MOVE = lcmt_panda_status.kMove
    """It obeys one."""
    REFLEX = lcmt_panda_status.kReflex
    """It has stopped by itself."""


@dataclass(frozen=True, eq=False)
class Command:
    """What the controller asks for.

    Attributes
    ----------
    utime
        Of the status that it answers [us].
    mode
        What is asked for.
    position, torque
        Target of the joints [rad], or their torques [N m], (7,): one of them, by the mode; the other is none.
    """

    utime: int
    mode: ControlMode
    position: Array | None = None
    torque: Array | None = None


@dataclass(frozen=True, eq=False)
class ArmStatus:
    """What the arm says of itself.

    Attributes
    ----------
    utime, robot_utime
        The arm's clock, and the time since the motion began [us].
    q, v, torque
        Joint positions [rad] and velocities [rad/s] as the encoders measure them, and the torques that the motors were last told
        [N m]; (7,) each.
    control_mode, robot_mode
        What the arm does, and how it is.
    success_rate
        Share of the last samples for which a command was there in time.
    """

    utime: int
    robot_utime: int
    q: Array
    v: Array
    torque: Array
    control_mode: ControlMode
    robot_mode: RobotMode
    success_rate: float = 1.0


class MessageError(ValueError):
    """A message that is none: it says in a few words why."""


def command_message(command: Command) -> lcmt_panda_command:
    """Return Drake's message of a command."""
    message = lcmt_panda_command()
    message.utime, message.control_mode_expected = command.utime, int(command.mode)
    if command.position is not None:
        message.num_joint_position, message.joint_position = len(command.position), command.position.tolist()
    if command.torque is not None:
        message.num_joint_torque, message.joint_torque = len(command.torque), command.torque.tolist()
    return message


def command_of(message: lcmt_panda_command) -> Command:
    """Return the command in Drake's message. Raises `MessageError` if it asks for what there is not."""
    try:
        mode = ControlMode(message.control_mode_expected)
    except ValueError:
        raise MessageError(f"control mode {message.control_mode_expected} is none of the arm's") from None
    if mode is ControlMode.LOCKED:
        raise MessageError("no control mode is asked for")
    values = {ControlMode.POSITION: message.joint_position, ControlMode.TORQUE: message.joint_torque}[mode]
    if len(values) != N_JOINTS:
        raise MessageError(f"{mode.name.lower()}: {len(values)} joints, where the arm has {N_JOINTS}")
    array = np.array(values, dtype=float)
    if mode is ControlMode.POSITION:
        return Command(message.utime, mode, position=array)
    return Command(message.utime, mode, torque=array)


def decode_command(data: bytes) -> Command:
    """Return the command in bytes from the wire. Raises `MessageError` if there is none in them."""
    return command_of(_decode(lcmt_panda_command, data))


def status_message(status: ArmStatus) -> lcmt_panda_status:
    """Return Drake's message of a status; what the arm does not know is zero."""
    message = lcmt_panda_status()
    message.utime, message.robot_utime, message.num_joints = status.utime, status.robot_utime, N_JOINTS
    message.joint_position, message.joint_velocity = status.q.tolist(), status.v.tolist()
    message.joint_torque = message.joint_torque_desired = status.torque.tolist()
    message.joint_position_desired = message.joint_position
    unknown = [0.0] * N_JOINTS
    message.joint_velocity_desired = message.joint_acceleration_desired = message.joint_torque_external = unknown
    message.control_mode, message.robot_mode = int(status.control_mode), int(status.robot_mode)
    message.control_command_success_rate = status.success_rate
    return message


def status_of(message: lcmt_panda_status) -> ArmStatus:
    """Return the status in Drake's message. Raises `MessageError` if it is of another arm."""
    if message.num_joints != N_JOINTS:
        raise MessageError(f"{message.num_joints} joints, where the arm has {N_JOINTS}")
    try:
        modes = ControlMode(message.control_mode), RobotMode(message.robot_mode)
    except ValueError:
        raise MessageError(
            f"control mode {message.control_mode} or robot mode {message.robot_mode} is none of the arm's"
        ) from None
    q, v, torque = (np.array(one) for one in (message.joint_position, message.joint_velocity, message.joint_torque))
    rate = message.control_command_success_rate
    return ArmStatus(message.utime, message.robot_utime, q, v, torque, *modes, success_rate=rate)


def decode_status(data: bytes) -> ArmStatus:
    """Return the status in bytes from the wire. Raises `MessageError` if there is none in them."""
    return status_of(_decode(lcmt_panda_status, data))


def _decode(message_type: Any, data: bytes) -> Any:
    try:
        message = message_type.decode(data)
    except Exception as error:  # whatever the generated code meets in bytes of any kind
        raise MessageError(f"its bytes are no {message_type.__name__}") from error
    return message


def to_microseconds(time: float) -> int:
    """Return a time [s] in whole microseconds."""
    return round(MICROSECONDS * time)
