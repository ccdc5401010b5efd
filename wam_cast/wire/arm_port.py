"""Where the arm's side asks for torques: in lock step, or sample by sample in real time; and the controller that only asks.

`RemoteLaw` stands in a station where the control law would. All else of the station stays what it is, so that in lock step a cast
is that of one process, bit for bit.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Callable
from time import time_ns
from typing import Any, Protocol

import numpy as np

from wam_cast.robot.controller import CastController, Desired, MeasuredArm
from wam_cast.robot.motors import saturate
from wam_cast.robot.plant import N_ARM
from wam_cast.scenario import Scenario
from wam_cast.types import Array
from wam_cast.wire.bus import Bus, Clock, WallClock
from wam_cast.wire.messages import (
    COMMAND_CHANNEL,
    STATUS_CHANNEL,
    ArmStatus,
    ControlMode,
    RobotMode,
    status_message,
    to_microseconds,
)
from wam_cast.wire.safety import ArmSafety, Refusal, SafetyMode

HOLD_RATE = 20.0
"""Natural frequency [rad/s] with which the arm holds its position, critically damped: 2 rad/s take it 0.04 rad on."""

HOLD_DURATION = 0.5
"""For which the arm is held before its brakes close [s]."""

OPENING_TIMEOUT = 2.0
"""For the brakes to open [s], after which they stay closed."""

REPEAT = 0.1
"""After which a status is sent again in lock step [s]."""

COMMAND_PATIENCE = 5.0
"""After which the arm in lock step no longer waits for a command [s]."""

PAUSE = 1.0
"""By which the arm's clock goes on before each motion [s], so that all that was said of the one before is stale."""

RATE_SAMPLES = 100
"""Over which the success rate of a status counts."""

MODES = {
    SafetyMode.LOCKED: (ControlMode.LOCKED, RobotMode.IDLE),
    SafetyMode.HOLDING: (ControlMode.POSITION, RobotMode.IDLE),
    SafetyMode.OBEYING: (ControlMode.TORQUE, RobotMode.MOVE),
    SafetyMode.STOPPED: (ControlMode.POSITION, RobotMode.REFLEX),
}
"""What a status says of what the arm does."""


class ArmStoppedError(Exception):
    """The arm has stopped: the cast is over."""


class ArmPort(Protocol):
    """Where torques come from."""

    is_open: bool

    def exchange(self, time: float, arm: MeasuredArm) -> Array:
        """Return the torque [N m], (7,), at a `time` [s] from the start of the motion. Raises `ArmStoppedError`."""


class RemoteLaw(CastController):
    """A controller that asks at a port for its torques; while that is closed it carries the arm's weight.

    It has the motion of `.CastController`, from which the tracking error counts.
    """

    def __init__(self, scenario: Scenario, port: ArmPort) -> None:
        super().__init__(scenario)
        self._port = port

    def torque(self, arm: MeasuredArm, desired: Desired) -> Array:
        """Return the torque [N m], (7,), that came over the wire."""
        return self._port.exchange(desired.time, arm) if self._port.is_open else arm.holding_torque


def hold_torque(arm: MeasuredArm, q_hold: Array, limits: Array) -> Array:
    """Return the torque [N m], (7,), within `limits`, that holds an arm at `q_hold` [rad]: its weight, and a damped pull."""
    acceleration = HOLD_RATE**2 * (q_hold - arm.q) - 2 * HOLD_RATE * arm.v
    return saturate(arm.plant.CalcMassMatrix(arm.context) @ acceleration + arm.holding_torque, limits)


def _first_utime(clock: Clock) -> int:
    """Return where the arm's clock begins [us]: on the machine's own, later than any that it said before it was restarted."""
    return time_ns() // 1000 if isinstance(clock, WallClock) else to_microseconds(clock.now())


class _Port:
    """What both kinds have in common: commands come in, statuses go out, the state machine in between decides."""

    def __init__(self, bus: Bus, safety: ArmSafety, on_refusal: Callable[[Refusal], None]) -> None:
        self.safety, self.is_open, self.time = safety, False, 0.0
        self._bus, self._on_refusal = bus, on_refusal
        self._commands: deque[bytes] = deque()
        self._in_time: deque[bool] = deque(maxlen=RATE_SAMPLES)
        self._torque = np.zeros(N_ARM)
        bus.subscribe(COMMAND_CHANNEL, self._commands.append)

    def close(self) -> None:
        """Give no more torques: the motion is over."""
        self.is_open = False

    def _begin(self) -> None:
        """Close the brakes and forget the motion before."""
        self.safety.reset()
        self._bus.handle()
        self._commands.clear()
        self._in_time.clear()
        self._torque, self.time = np.zeros(N_ARM), 0.0

    def _receive(self, utime: int, q: Array) -> list[Refusal | None]:
        """Take in the commands that have come; return, and say, what is wrong with each, or none."""
        verdicts = []
        while self._commands:
            verdicts.append(self.safety.receive(self._commands.popleft(), utime, q))
            if verdicts[-1] is not None:
                self._on_refusal(verdicts[-1])
        return verdicts

    def counted(self) -> dict[str, Any]:
        """Return how many commands were refused since the last reset of `safety`, by their kind."""
        return {"refused": dict(self.safety.refused)}

    def _send_status(self, utime: int, time: float, q: Array, v: Array) -> None:
        self.time = time
        rate = sum(self._in_time) / len(self._in_time) if self._in_time else 1.0
        status = ArmStatus(
            utime, to_microseconds(time), q, v, self._torque, *MODES[self.safety.mode], success_rate=rate
        )
        self._bus.publish(STATUS_CHANNEL, status_message(status).encode())


class LockStepPort(_Port):
    """Waits at each sample for the command that answers it. The arm's clock is the number of the sample.

    The world waits as well: it is simulated on when the command is there. A command that is refused will be followed by no other,
    so that the cast ends there.
    """

    def __init__(
        self,
        bus: Bus,
        clock: Clock,
        safety: ArmSafety,
        period: float,
        on_refusal: Callable[[Refusal], None] = lambda _: None,
    ) -> None:
        super().__init__(bus, safety, on_refusal)
        self._clock, self._period = clock, to_microseconds(period)
        self._utime = _first_utime(clock)

    def open(self, q: Array) -> None:
        """Open the brakes of an arm at `q` [rad], for a new motion. Raises `ArmStoppedError` if they stay closed."""
        self._begin()
        self._utime += to_microseconds(PAUSE)
        while self.safety.mode is SafetyMode.LOCKED:
            self._answered(0.0, q, np.zeros(N_ARM))
        self.is_open = True

    def exchange(self, time: float, arm: MeasuredArm) -> Array:
        """Return the torque [N m], (7,), that answers this sample. Raises `ArmStoppedError` if none does."""
        self._answered(time, arm.q, arm.v)
        torque = self.safety.torque
        if torque is None:  # told to stay
            self.safety.stop("the controller sent no torque")
            raise ArmStoppedError
        self._torque = torque
        return torque

    def _answered(self, time: float, q: Array, v: Array) -> None:
        """Send the status of a sample until a command answers it, and have it decided about."""
        self._utime += self._period
        for _ in range(round(COMMAND_PATIENCE / REPEAT)):
            self._send_status(self._utime, time, q, v)
            if self._is_answered(q):
                break
        else:
            self.safety.stop(f"no command for {COMMAND_PATIENCE:g} s")
        if self.safety.decide(self._utime, q, v) is SafetyMode.STOPPED:
            raise ArmStoppedError

    def _is_answered(self, q: Array) -> bool:
        """Wait for a command to this sample until it is to be asked for again, and return whether one came."""
        end = self._clock.now() + REPEAT
        while (left := end - self._clock.now()) > 0:
            self._bus.handle(left)
            for refusal in self._receive(self._utime, q):
                if refusal is None:
                    return True
                if refusal.is_of_content:
                    self.safety.stop(f"the command was refused as {refusal}")
                    return True
        return False


class RealTimePort(_Port):
    """Gives at each tick of a clock the torque that came last, whatever the controller does meanwhile.

    A torque acts from the tick after the sample that it answers: a real driver has no answer earlier either. Where the simulation
    itself is late, its clock is stopped for so long: a missed deadline, which is counted; its commands are none the older for it.

    Attributes
    ----------
    n_ticks, n_missed
        Since the port was opened, and how many of them began late.
    worst_lateness
        Of them [s].
    """

    def __init__(
        self,
        bus: Bus,
        clock: Clock,
        safety: ArmSafety,
        period: float,
        on_refusal: Callable[[Refusal], None] = lambda _: None,
    ) -> None:
        super().__init__(bus, safety, on_refusal)
        self._clock, self._period, self._start_utime = clock, period, _first_utime(clock)
        self._n = 0
        self._deadline = self._clock.now()
        self._stopped_since: int | None = None
        self._q_hold = np.zeros(N_ARM)
        self.n_ticks = self.n_missed = 0
        self.worst_lateness = 0.0

    def open(self, q: Array) -> None:
        """Open the brakes of an arm at `q` [rad], for a new motion, and wait for the first torque of it.

        Raises `ArmStoppedError` if they stay closed.
        """
        self._begin()
        self._n += round(PAUSE / self._period)
        self._stopped_since, self._deadline = None, self._clock.now()
        self.n_ticks, self.n_missed, self.worst_lateness = 0, 0, 0.0
        for _ in range(round(OPENING_TIMEOUT / self._period)):
            if self._tick(q, np.zeros(N_ARM)) is SafetyMode.OBEYING:
                break
            self._send_status(self._utime, 0.0, q, np.zeros(N_ARM))
        else:
            self.safety.stay_locked()
            raise ArmStoppedError
        self.is_open, self.n_ticks, self.n_missed, self.worst_lateness = True, 0, 0, 0.0

    def exchange(self, time: float, arm: MeasuredArm) -> Array:
        """Return the torque [N m], (7,), of this tick, when it is time. Raises `ArmStoppedError` when a stopped arm is at rest."""
        if self._tick(arm.q, arm.v) is SafetyMode.STOPPED:
            if self._stopped_since is None:
                self._stopped_since, self._q_hold = self._n, arm.q.copy()
            if (self._n - self._stopped_since) * self._period > HOLD_DURATION:
                raise ArmStoppedError
            self._torque = hold_torque(arm, self._q_hold, self.safety.limits.torque)
        else:
            assert self.safety.torque is not None
            self._torque = self.safety.torque
        self._send_status(self._utime, time, arm.q, arm.v)
        return self._torque

    def _tick(self, q: Array, v: Array) -> SafetyMode:
        """Wait for the next tick, take in what has come, and have it decided about."""
        self._n += 1
        self.n_ticks += 1
        self._deadline += self._period
        lateness = self._clock.now() - self._deadline
        if lateness > 0:
            self.n_missed += 1
            self.worst_lateness = max(self.worst_lateness, lateness)
            self._deadline += lateness
        self._clock.sleep_until(self._deadline)
        self._bus.handle()
        self._in_time.append(None in self._receive(self._utime, q))
        return self.safety.decide(self._utime, q, v)

    def counted(self) -> dict[str, Any]:
        """Return what every port counts, and the ticks: how many, how many were late, and by how much [s]."""
        late = {"n_ticks": self.n_ticks, "n_missed": self.n_missed, "worst_lateness": self.worst_lateness}
        return {**super().counted(), **late}

    @property
    def _utime(self) -> int:
        return self._start_utime + to_microseconds(self._n * self._period)
