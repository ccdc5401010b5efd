"""SimulatedArm: a simulated arm, with its string, ball and cup, that a controller on the other side of a wire casts with."""

from __future__ import annotations

import os
import time
from collections.abc import Callable
from functools import partial
from typing import Any
from uuid import uuid4

from wam_cast.arm.posture import starting_posture
from wam_cast.errors import InputError
from wam_cast.robot.station import CastStation, believed
from wam_cast.scenario import Scenario
from wam_cast.simulation.loop_stability import MAX_GROWTH, check_loop, loop_growth
from wam_cast.simulation.outcome import Outcome
from wam_cast.simulation.simulator import CastSimulator
from wam_cast.wire.arm_port import ArmStoppedError, LockStepPort, RealTimePort, RemoteLaw
from wam_cast.wire.bus import Bus, Clock, WallClock
from wam_cast.wire.one_pass import OnePass
from wam_cast.wire.safety import ArmLimits, ArmSafety, Refusal
from wam_cast.wire.stage import (
    REPLY_CHANNEL,
    REQUEST_CHANNEL,
    StageReply,
    StageRequest,
    outcome_record,
    stopped_outcome,
)

MOST_DELAY = 20
"""Periods, beyond which nobody looks."""

LISTENING = 0.1
"""For which the arm waits for a question [s] before it looks whether it is interrupted."""


def stable_delay(robot: Scenario, belief: Scenario) -> int:
    """Return how many periods, beyond those of `controller.delay`, commands may be late with the control loop still stable.

    Raises `.InputError` if it is unstable as it is.
    """
    check_loop(robot, belief)
    delay = robot.controller.delay
    while delay < MOST_DELAY:
        later = robot.controller.model_copy(update={"delay": delay + 1})
        if loop_growth(robot.model_copy(update={"controller": later}), belief) > MAX_GROWTH:
            break
        delay += 1
    return delay - robot.controller.delay


class SimulatedArm:
    """Waits for casts to be asked for, and simulates them with the torques that come over a wire.

    Parameters
    ----------
    bus, clock
        Over which it is asked; what time it keeps.
    scenario, belief
        What is simulated, and what its controller takes it for, as in `.CastSimulator`: of that it knows where a cast starts.
    is_real_time
        Whether its clock runs by itself, at one sample a control period, or waits for each command.
    on_refusal
        Called with each command that is refused.
    on_outcome
        Called with each cast that was asked for, its outcome, and what was counted meanwhile: `refused` commands by their kind;
        in real time the `n_ticks`, how many were `n_missed`, and by how much at most, `worst_lateness` [s].

    Attributes
    ----------
    n_casts
        That are done.
    safety
        What decides about commands.

    Raises
    ------
    InputError
        As `.CastSimulator` does, and in real time if the control loop is unstable a period later, when a command acts there.
    """

    def __init__(
        self,
        bus: Bus,
        scenario: Scenario,
        belief: Scenario | None = None,
        *,
        clock: Clock | None = None,
        is_real_time: bool = False,
        on_refusal: Callable[[Refusal], None] = lambda _: None,
        on_outcome: Callable[[StageRequest, Outcome, dict[str, Any]], None] = lambda *_: None,
    ) -> None:
        self._bus, self._scenario, self._on_outcome = bus, scenario, on_outcome
        self._belief, self._is_real_time = believed(scenario, belief), is_real_time
        period, max_delay = scenario.controller.period, stable_delay(scenario, self._belief)
        if is_real_time and max_delay < 1:
            raise InputError(
                f"controller.delay = {scenario.controller.delay}: in real time a command acts a period later besides, with which "
                "the control loop is unstable; choose a lower delay, a shorter period or lower gains, or lock step"
            )
        arm = CastStation(scenario, has_scene=False, has_ball=False)
        self.safety = ArmSafety(ArmLimits.of(arm.plant, arm.motors), period, max_delay)
        # Later than any that it gave before it was restarted.
        start_utime, clock = (time.time_ns() // 1000, WallClock()) if clock is None else (0, clock)
        make_port = RealTimePort if is_real_time else LockStepPort
        self.port = make_port(bus, clock, self.safety, period, on_refusal, start_utime)
        self._q_start = starting_posture(self._belief)
        if isinstance(self.port, RealTimePort):
            law = RemoteLaw(self._belief, self.port)
            station = CastStation(scenario, belief=belief, controller=law)
            self.one_pass = OnePass(station, partial(self.port.open, self._q_start))
        else:
            self._simulator = CastSimulator(scenario, belief, make_controller=partial(RemoteLaw, port=self.port))
        self.n_casts = 0
        self._name = f"{os.getpid()}-{uuid4().hex[:8]}"
        self._asked: StageRequest | None = None
        self._reply: StageReply | None = None
        bus.subscribe(REQUEST_CHANNEL, self._hear)

    def serve(self, n_casts: int | None = None) -> None:
        """Make the casts that are asked for, so many of them, or for ever."""
        while n_casts is None or self.n_casts < n_casts:
            self._bus.handle(LISTENING)
            self.work()
        self._linger()

    def work(self) -> bool:
        """Make the cast that is asked for, if there is one, and return whether there was."""
        if self._asked is None or self._reply is not None:
            return False
        request = self._asked
        try:
            outcome, service = self._cast(request)
        except InputError as error:
            self._reply = self._say(request, "refused", detail=str(error))
        else:
            self._reply = self._say(request, "done", outcome=outcome_record(outcome), service=service)
            self._on_outcome(request, outcome, service)
            self.n_casts += 1
        self._bus.publish(REPLY_CHANNEL, self._reply.encode())
        return True

    def _linger(self) -> None:
        """Answer a little longer: the last reply may have been lost."""
        for _ in range(3):
            self._bus.handle(LISTENING)

    def _cast(self, request: StageRequest) -> tuple[Outcome, dict[str, Any]]:
        assert request.cast is not None
        self.safety.reset()
        try:
            if isinstance(self.port, RealTimePort):
                outcome = self.one_pass.simulate(request.cast, request.cup, request.noise_seed)
            else:
                self.port.open(self._q_start)
                outcome = self._simulator.simulate(request.cast, request.cup, noise_seed=request.noise_seed)
        except ArmStoppedError:
            outcome = stopped_outcome(self.safety.stop_reason, self.port.time)
        finally:
            self.port.is_open = False
        service: dict[str, Any] = {"refused": dict(self.safety.refused)}
        if isinstance(self.port, RealTimePort):
            service |= {name: getattr(self.port, name) for name in ("n_ticks", "n_missed", "worst_lateness")}
        return outcome, service

    def _hear(self, data: bytes) -> None:
        """Answer a question, at once."""
        try:
            request = StageRequest.decode(data)
        except ValueError:
            return
        self._bus.publish(REPLY_CHANNEL, self._answer(request).encode())

    def _answer(self, request: StageRequest) -> StageReply:
        is_casting = self._asked is not None and self._reply is None
        if self._asked is not None and request.number == self._asked.number:
            return self._reply or self._say(request, "casting")
        if is_casting:
            return self._say(request, "busy")
        if request.cast is None:
            return self._say(request, "ready")
        if request.robot != self._name:
            return self._say(request, "refused", detail="the arm's process was restarted meanwhile; cast again")
        self._asked, self._reply = request, None
        return self._say(request, "casting")

    def _say(self, request: StageRequest, state: str, **more: Any) -> StageReply:
        return StageReply(
            request.number, self._name, state, self._scenario.controller.period, self._is_real_time, **more
        )
