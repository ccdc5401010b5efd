"""The bus that messages go over: LCM's, by its address; what the two sides need of any."""

from __future__ import annotations

import re
import time
from collections import deque
from collections.abc import Callable
from typing import Protocol, runtime_checkable

from wam_cast.errors import InputError, MachineError, quoted

DEFAULT_URL = "udpm://239.255.76.67:7667?ttl=0"
"""LCM's own, which does not leave this machine."""

URL_PATTERN = re.compile(r"udpm://(\d{1,3})\.(\d{1,3})\.(\d{1,3})\.(\d{1,3}):(\d{1,5})(?:\?ttl=(\d{1,3}))?", re.ASCII)

Handler = Callable[[bytes], None]


@runtime_checkable
class Bus(Protocol):
    """Carries bytes on named channels to all who listen; some may be lost. Its `url` is its address."""

    url: str

    def publish(self, channel: str, data: bytes) -> None:
        """Send bytes to all others on a channel."""

    def subscribe(self, channel: str, handler: Handler, *, newest_only: bool = False) -> None:
        """Have `handler` called with what comes on a channel, or with the newest of it if several have come meanwhile."""

    def handle(self, timeout: float = 0.0) -> None:
        """Call the handlers for what has come; if there is nothing, wait for something, so long [s] at most."""


@runtime_checkable
class Clock(Protocol):
    """Tells the time, and passes it."""

    def now(self) -> float:
        """Return the time [s], from some start."""

    def sleep_until(self, time: float) -> None:
        """Return at a time [s], or at once if it is over."""


class WallClock:
    """The machine's clock."""

    def now(self) -> float:
        """Return the time [s] since the machine was started, about."""
        return time.monotonic()

    def sleep_until(self, time_to_wake: float) -> None:
        """Sleep until a time [s]."""
        left = time_to_wake - time.monotonic()
        if left > 0:
            time.sleep(left)


def check_url(url: str) -> str:
    """Return the address of a bus. Raises `.InputError` if it is none: LCM itself takes any text, and is then silent for ever."""
    match = URL_PATTERN.fullmatch(url)
    *group, port, ttl = [0] * 6 if match is None else [int(number) for number in match.groups("0")]
    if not 224 <= group[0] <= 239 or max(*group, ttl) > 255 or not 1 <= port <= 65535:
        raise InputError(
            f"robot's address {quoted(url)}: must be udpm://GROUP:PORT?ttl=N with a multicast group from 224.0.0.0 to "
            f"239.255.255.255, a port from 1 to 65535, and a ttl up to 255, 0 for this machine alone, such as {DEFAULT_URL}"
        )
    return url


class LcmBus:
    """LCM's multicast on an address such as `DEFAULT_URL`.

    Handlers run where `handle` is called, in the order in which the messages came. Of each channel Drake keeps one message: what
    comes before `handle` has taken that is lost, and Drake's Python has nothing to set it with.

    Raises
    ------
    InputError
        If the address is none.
    MachineError
        If the machine has no multicast.
    """

    def __init__(self, url: str = DEFAULT_URL) -> None:
        from pydrake.lcm import DrakeLcm  # here: what only reads the address does without Drake

        self.url = check_url(url)
        try:
            self._lcm = DrakeLcm(url)
        except RuntimeError:
            raise MachineError(
                f"robot's address {url}: this machine cannot send to it; allow multicast, for ttl=0 on the loopback device: "
                "`sudo ip link set lo multicast on && sudo ip route add 224.0.0.0/4 dev lo`"
            ) from None
        self._waiting: deque[tuple[str, bytes]] = deque()
        self._handlers: dict[str, tuple[Handler, bool]] = {}

    def publish(self, channel: str, data: bytes) -> None:
        """Send bytes on a channel."""
        self._lcm.Publish(channel, data)

    def subscribe(self, channel: str, handler: Handler, *, newest_only: bool = False) -> None:
        """Have `handler` called as `Bus` says. LCM's own handlers must not raise, so they only put aside what comes."""
        self._handlers[channel] = handler, newest_only
        self._lcm.Subscribe(channel, lambda data: self._waiting.append((channel, data)))

    def handle(self, timeout: float = 0.0) -> None:
        """Call the handlers for what has come, or comes within `timeout` [s]."""
        self._lcm.HandleSubscriptions(max(0, round(1e3 * timeout)))
        came = list(self._waiting)
        self._waiting.clear()
        newest = dict(came)
        for channel, data in came:
            handler, newest_only = self._handlers[channel]
            if not newest_only or data is newest[channel]:
                handler(data)
