"""What the arm's side lets through: limits, and a state machine that opens the brakes, obeys, and stops the arm; no clock, no wire.

::

              so many commands in a row, each in time,           a torque
              to stay where the arm is
    LOCKED  ------------------------------------------> HOLDING ---------> OBEYING
      ^                                                    |                  |
      |  no command in time for 20 ms                      |                  |  no command in time for 20 ms, a joint beyond its
      +----------------------------------------------------+                  |  limits, or told to stay
                                                                              v
                                                                           STOPPED      until the next `reset`

A command that is refused is as one that never came: the torque before it is held on.
"""

from __future__ import annotations

from collections import Counter
from dataclasses import dataclass
from enum import StrEnum
from typing import Self

import numpy as np
from pydrake.multibody.plant import MultibodyPlant

from wam_cast.robot.motors import Motors, motor_utilization
from wam_cast.robot.plant import N_ARM
from wam_cast.types import Array
from wam_cast.wire.messages import MICROSECONDS, Command, ControlMode, MessageError, decode_command

OPENING_COMMANDS = 5
"""In a row, to stay where the arm is, for the brakes to open."""

AT_REST = 0.01
"""How far from where it is the arm may be told to stay [rad]."""

SILENCE = 0.020
"""Without a command in time, after which the arm holds its position [s]."""

EXTRA_PERIODS = 1
"""By which a command may now and then be later than the control loop bears for long: else an older one would be held."""

ROUNDING = 1 + 1e-9
"""By how much a torque may exceed its limit: a controller that saturates comes out a rounding above it."""


REPEATED = "repeated or reordered"


class SafetyMode(StrEnum):
    """What the arm's side does."""

    LOCKED = "locked"
    """The brakes are closed."""
    HOLDING = "holding"
    """The brakes are open and the arm holds its position, until the first torque."""
    OBEYING = "obeying"
    """It gives the torques that it is told."""
    STOPPED = "stopped"
    """It has come to a halt and holds its position, whatever it is told."""


@dataclass(frozen=True, eq=False)
class ArmLimits:
    """What the arm is never told to go beyond.

    Attributes
    ----------
    torque
        Of a command [N m], (7,); the joints of a differential share theirs, as in `.motor_utilization`.
    velocity, lower, upper
        Of the joints [rad/s], and their range [rad], (7,) each.
    """

    torque: Array
    velocity: Array
    lower: Array
    upper: Array

    @classmethod
    def of(cls, plant: MultibodyPlant, motors: Motors) -> Self:
        """Return the limits of a station's arm."""
        arm = slice(N_ARM)
        lower, upper = plant.GetPositionLowerLimits()[arm], plant.GetPositionUpperLimits()[arm]
        return cls(motors.limits, plant.GetVelocityUpperLimits()[arm], lower, upper)

    def left_by(self, q: Array, v: Array) -> str:
        """Return which limit an arm in this state has left, such as `joint 4 speed`, or nothing."""
        checks = (
            ("encoder", np.isfinite(q) & np.isfinite(v)),
            ("position", (q >= self.lower) & (q <= self.upper)),
            ("speed", motor_utilization(v, self.velocity) <= 1),
        )
        return next((f"joint {i + 1} {what}" for what, within in checks for i in np.flatnonzero(~within)), "")


@dataclass(frozen=True)
class Refusal:
    """A command that was not obeyed.

    Attributes
    ----------
    kind
        In a word: `broken`, `not finite`, `beyond limits`, `not where the arm is`, `repeated or reordered`, `stale`,
        `of the future`, `brakes closed`, `stopped`.
    detail
        What it was, and what is allowed.
    """

    kind: str
    detail: str

    @property
    def is_of_content(self) -> bool:
        """Whether it is about what was asked for, not about when or how that came."""
        return self.kind in ("not finite", "beyond limits", "not where the arm is", "brakes closed")

    def __str__(self) -> str:
        return f"{self.kind}: {self.detail}"


class ArmSafety:
    """Decides about each command, and what the arm does.

    It knows no clock and no wire: all that it depends on is told to it. One sample of the arm is some calls of `receive`, and
    then one of `decide`.

    Parameters
    ----------
    limits
        Of the arm.
    period
        Between two samples [s].
    max_delay
        Periods that a command may be late and still be in time: what the control loop bears for long. Commands that are later by
        more than `EXTRA_PERIODS` are stale.

    Attributes
    ----------
    mode
        See `SafetyMode`.
    stop_reason
        Why the arm has stopped, or its brakes stayed closed.
    refused
        How many commands of each kind were refused, since the last `reset`.
    torque
        The torque that is obeyed [N m], (7,), if any.
    """

    def __init__(self, limits: ArmLimits, period: float, max_delay: int) -> None:
        self.limits, self._period, self._max_delay = limits, period, max_delay
        self._last_utime = -1
        self.reset()

    def reset(self) -> None:
        """Close the brakes and forget why it stopped, for a new motion. Commands from before stay too old."""
        self.mode = SafetyMode.LOCKED
        self.stop_reason = ""
        self.refused: Counter[str] = Counter()
        self.last_refusal: Refusal | None = None
        self.torque: Array | None = None
        self._n_in_a_row, self._n_late, self._in_time_at = 0, 0, 0
        self._told_to_stay = False

    def receive(self, data: bytes, utime: int, q: Array) -> Refusal | None:
        """Take in the bytes of a command, at the arm's clock `utime` [us] with its joints at `q` [rad]; return what is wrong."""
        try:
            command = decode_command(data)
        except MessageError as error:
            refusal: Refusal | None = Refusal("broken", str(error))
        else:
            refusal = self._flaw(command, utime, q)
            if refusal is None:
                self._obey(command, utime)
        if refusal is not None:
            self.refused[refusal.kind] += 1
            self.last_refusal = refusal
            if refusal.kind != REPEATED:  # which says nothing of the others
                self._n_in_a_row = 0
        return refusal

    def _flaw(self, command: Command, utime: int, q: Array) -> Refusal | None:
        """Return what is wrong with a command, first what is wrong with its time."""
        if command.utime <= self._last_utime:
            last = self._last_utime
            return Refusal(REPEATED, f"it answers sample {command.utime} us, after the one of {last} us")
        if command.utime > utime:
            return Refusal(
                "of the future", f"it answers sample {command.utime} us, and the arm's clock is at {utime} us"
            )
        age, oldest = self._periods(utime - command.utime), self._max_delay + EXTRA_PERIODS
        if age > oldest:
            ms = 1e3 * self._period
            return Refusal("stale", f"its torque would be {age * ms:.3g} ms late; {oldest * ms:.3g} ms at most")
        if self.mode is SafetyMode.STOPPED:
            return Refusal("stopped", f"the arm holds its position: {self.stop_reason}")
        return self._position_flaw(command.position, q) if command.position is not None else self._torque_flaw(command)

    def _position_flaw(self, position: Array, q: Array) -> Refusal | None:
        if not np.all(np.isfinite(position)):
            return Refusal("not finite", f"joint {_first(~np.isfinite(position))} is to go to no number")
        beyond = (position < self.limits.lower) | (position > self.limits.upper)
        if beyond.any():
            i = int(np.flatnonzero(beyond)[0])
            low, high = self.limits.lower[i], self.limits.upper[i]
            return Refusal(
                "beyond limits", f"joint {i + 1} is to go to {position[i]:.4g} rad; {low:.3g} to {high:.3g} rad"
            )
        off = np.abs(position - q)
        if off.max() > AT_REST and self.mode is not SafetyMode.OBEYING:
            i = int(off.argmax())
            told = f"joint {i + 1} is to go to {position[i]:.4g} rad and is at {q[i]:.4g} rad"
            return Refusal("not where the arm is", f"{told}; the arm can only be told to stay")
        return None

    def _torque_flaw(self, command: Command) -> Refusal | None:
        assert command.torque is not None
        if not np.all(np.isfinite(command.torque)):
            return Refusal("not finite", f"joint {_first(~np.isfinite(command.torque))} is to give no number")
        utilization = motor_utilization(command.torque, self.limits.torque)
        if np.any(utilization > ROUNDING):
            i = int(utilization.argmax())
            told, limit = command.torque[i], self.limits.torque[i]
            return Refusal(
                "beyond limits",
                f"joint {i + 1} is to give {told:.4g} N m, {100 * utilization[i]:.0f} % of its motors' limit ({limit:.4g} N m "
                "alone)",
            )
        if self.mode is SafetyMode.LOCKED:
            return Refusal(
                "brakes closed", f"a torque before {OPENING_COMMANDS} commands in a row to stay where the arm is"
            )
        return None

    def _obey(self, command: Command, utime: int) -> None:
        self._last_utime = command.utime
        is_in_time = self._periods(utime - command.utime) <= self._max_delay
        self._n_late += 1
        if is_in_time:
            self._in_time_at, self._n_late, self.last_refusal = utime, 0, None
        if command.mode is ControlMode.TORQUE:
            self.mode, self.torque = SafetyMode.OBEYING, command.torque
        elif self.mode is SafetyMode.OBEYING:
            self._told_to_stay = True
        elif self.mode is SafetyMode.LOCKED:
            self._n_in_a_row = self._n_in_a_row + 1 if is_in_time else 0
            if self._n_in_a_row == OPENING_COMMANDS:
                self.mode = SafetyMode.HOLDING

    def decide(self, utime: int, q: Array, v: Array) -> SafetyMode:
        """Return what the arm does in this sample, at its clock `utime` [us] and in its state [rad], [rad/s], (7,) each."""
        silent = 1e-6 * (utime - self._in_time_at)
        if self.mode is SafetyMode.HOLDING and silent >= SILENCE:
            self.mode, self._n_in_a_row = SafetyMode.LOCKED, 0
        elif self.mode is SafetyMode.OBEYING:
            left = self.limits.left_by(q, v)
            if left:
                self.stop(f"the arm left its limits: {left}")
            elif self._told_to_stay:
                self.stop("the controller told it to stay")
            elif silent >= SILENCE:
                self.stop(f"no command in time for {1e3 * SILENCE:.0f} ms{self._because()}")
        return self.mode

    def stop(self, reason: str) -> None:
        """Stop the arm, until `reset`; the first reason is the one that is kept."""
        if self.mode is not SafetyMode.STOPPED:
            self.mode, self.stop_reason, self.torque = SafetyMode.STOPPED, reason, None

    def stay_locked(self) -> None:
        """Note that the brakes were to open and did not, and refuse all that comes."""
        self.stop(f"the brakes stayed closed{self._because() or ': no command came'}")

    def _because(self) -> str:
        """Return what was wrong with the commands since the last one in time."""
        if self._n_late:
            in_time = 1e3 * self._period * self._max_delay
            return f": commands come more than {in_time:.3g} ms late, up to which the control loop is stable"
        if self.last_refusal is not None:
            return f": the last one that was refused is {self.last_refusal}"
        return ""

    def _periods(self, microseconds: int) -> int:
        return round(microseconds / MICROSECONDS / self._period)


def _first(flags: Array) -> int:
    """Return the number of the first joint, from 1, of which the flag is set."""
    return int(np.flatnonzero(flags)[0]) + 1
