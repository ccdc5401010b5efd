"""MemoryNetwork: a bus within one process, over links that delay, lose and double, in a time of its own.

Drake's `memq://` will not do: it is one instance's own queue, so that two sides could neither have an instance each nor nest their
calls. Here both sides run in one thread: what one waits for the other does meanwhile. So a cast over a bad link is repeatable,
and takes no longer than another.
"""

from __future__ import annotations

import heapq
from collections.abc import Callable
from itertools import count

from wam_cast.wire.bus import Handler
from wam_cast.wire.lossy_link import LossyLink


class MemoryNetwork:
    """Joins any number of sides. It is a `.Clock` too: time passes when somebody waits.

    Parameters
    ----------
    link
        Between each two of them; by default a perfect one.
    """

    def __init__(self, link: LossyLink | None = None) -> None:
        self._link = LossyLink() if link is None else link
        self._now = 0.0
        self._numbers = count()
        self._under_way: list[tuple[float, int, Handler, bytes]] = []
        self._sides: list[MemoryBus] = []

    def join(self, when_idle: Callable[[], bool] = lambda: False) -> MemoryBus:
        """Return a side of its own. `when_idle` is its work, done where another side waits; it says whether there was any."""
        self._sides.append(MemoryBus(self, when_idle))
        return self._sides[-1]

    def now(self) -> float:
        """Return the time [s]."""
        return self._now

    def sleep_until(self, time: float) -> None:
        """Let time pass until `time` [s], and deliver what arrives by then."""
        while self._under_way and self._under_way[0][0] <= time + 1e-9:
            arrival, _, handler, data = heapq.heappop(self._under_way)
            self._now = max(self._now, arrival)
            handler(data)
        self._now = max(self._now, time)

    def send(self, sender: MemoryBus, channel: str, data: bytes) -> None:
        """Put bytes on their way to all other sides."""
        for side in self._sides:
            handler = side.handlers.get(channel)
            if handler is None or side is sender:
                continue
            for arrival in self._link.arrivals(self._now):
                heapq.heappush(self._under_way, (arrival, next(self._numbers), handler, data))

    def wait(self, waiting: MemoryBus, timeout: float) -> None:
        """Let others work until something arrives, or else until so much time [s] has passed."""
        until = self._now + timeout
        if not self._under_way and any(side.when_idle() for side in self._sides if side is not waiting):
            until = self._now
        self.sleep_until(min(self._under_way[0][0], until) if self._under_way else until)


class MemoryBus:
    """One side's end of a `MemoryNetwork`, which makes it; see `.Bus`."""

    def __init__(self, network: MemoryNetwork, when_idle: Callable[[], bool]) -> None:
        self._network, self.when_idle = network, when_idle
        self.handlers: dict[str, Handler] = {}
        self.url = "memory"

    def publish(self, channel: str, data: bytes) -> None:
        """Send bytes to all other sides."""
        self._network.send(self, channel, data)

    def subscribe(self, channel: str, handler: Handler, *, newest_only: bool = False) -> None:
        """Have `handler` called with each message as it arrives, so that each is the newest."""
        del newest_only
        self.handlers[channel] = handler

    def handle(self, timeout: float = 0.0) -> None:
        """Let the others work until a message arrives, or so long [s] at most."""
        self._network.wait(self, timeout)
