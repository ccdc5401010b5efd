"""ArmService: the side of an arm, simulated or real, that others ask for casts: says how it goes, and what came of it."""

from __future__ import annotations

import os
from abc import ABC, abstractmethod
from collections.abc import Callable
from typing import Any
from uuid import uuid4

from wam_cast.cast import Cast
from wam_cast.errors import InputError
from wam_cast.simulation.outcome import Outcome
from wam_cast.types import Position
from wam_cast.wire.bus import Bus
from wam_cast.wire.messages import MessageError
from wam_cast.wire.stage import REPLY_CHANNEL, REQUEST_CHANNEL, StageReply, StageRequest, State, outcome_record

LISTENING = 0.1
"""For which it waits for a question [s] before it looks whether it is interrupted."""

N_MORE = 3
"""How often it listens again when it has made all casts: the last reply may have been lost."""

OnOutcome = Callable[[StageRequest, Outcome, dict[str, Any]], None]


class ArmService(ABC):
    """Waits for casts to be asked for, and makes them, one at a time: an arm that is busy says so. A subclass has the arm.

    Parameters
    ----------
    bus
        Over which it is asked.
    period
        Of the control [s].
    is_real_time
        Whether the arm's clock runs by itself, or waits for each command.
    on_outcome
        Called with each cast that was asked for, its outcome, and what was counted meanwhile.

    Attributes
    ----------
    n_casts
        That are done.
    """

    def __init__(
        self, bus: Bus, period: float, *, is_real_time: bool = True, on_outcome: OnOutcome = lambda *_: None
    ) -> None:
        self._bus, self._period, self._is_real_time, self._on_outcome = bus, period, is_real_time, on_outcome
        self._name = f"{os.getpid()}-{uuid4().hex[:8]}"
        self._asked: StageRequest | None = None
        self._reply: StageReply | None = None
        self.n_casts = 0
        bus.subscribe(REQUEST_CHANNEL, self._hear)

    @abstractmethod
    def make(self, cast: Cast, cup: Position | None, noise_seed: int) -> tuple[Outcome, dict[str, Any]]:
        """Make a cast; return its outcome, and what was counted meanwhile. Raises `.InputError` if the arm cannot make it."""

    def serve(self, n_casts: int | None = None) -> None:
        """Make the casts that are asked for, so many of them, or for ever."""
        while n_casts is None or self.n_casts < n_casts:
            self._bus.handle(LISTENING)
            self.work()
        for _ in range(N_MORE):
            self._bus.handle(LISTENING)

    def work(self) -> bool:
        """Make the cast that is asked for, if there is one, and return whether there was."""
        request = self._asked
        if request is None or request.cast is None or self._reply is not None:
            return False
        try:
            outcome, counted = self.make(request.cast, request.cup, request.noise_seed)
        except InputError as error:
            self._reply = self._say(request, "refused", detail=str(error))
        else:
            self._reply = self._say(request, "done", outcome=outcome_record(outcome), service=counted)
            self._on_outcome(request, outcome, counted)
            self.n_casts += 1
        self._bus.publish(REPLY_CHANNEL, self._reply.encode())
        return True

    def _hear(self, data: bytes) -> None:
        """Answer a question, at once."""
        try:
            request = StageRequest.decode(data)
        except MessageError:
            return
        self._bus.publish(REPLY_CHANNEL, self._answer(request).encode())

    def _answer(self, request: StageRequest) -> StageReply:
        if self._asked is not None and request.number == self._asked.number:
            return self._reply or self._say(request, "casting")
        if self._asked is not None and self._reply is None:
            return self._say(request, "busy")
        if request.cast is None:
            return self._say(request, "ready")
        if request.robot != self._name:
            return self._say(request, "refused", detail="the arm's process was restarted meanwhile; cast again")
        self._asked, self._reply = request, None
        return self._say(request, "casting")

    def _say(self, request: StageRequest, state: State, **more: Any) -> StageReply:
        return StageReply(request.number, self._name, state, self._period, self._is_real_time, **more)
