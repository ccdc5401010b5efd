"""Ctrl-C and SIGTERM that are always heard, and where it can be answered for."""

from __future__ import annotations

import signal
import sys
from collections.abc import Collection, Iterator
from contextlib import contextmanager
from types import FrameType

A_MOMENT = 0.01
"""After which an interruption is tried again [s]."""


@contextmanager
def heard_everywhere(numbers: Collection[int]) -> Iterator[Collection[int]]:
    """Let signals, such as Ctrl-C's, raise `KeyboardInterrupt` only where it ends the context; give those that have come.

    Where compiled modules are initialized it becomes other errors, and where Python ignores exceptions, as in `__del__` or where an
    import is locked, it gets lost: there it is raised a moment later.
    """
    heard: set[int] = set()

    def interrupt(number: int, frame: FrameType | None) -> None:
        heard.add(number)
        if frame is not None and (_is_import(frame) or _loads_compiled_code(frame)):
            _try_again()
        else:
            raise KeyboardInterrupt

    before = [(number, signal.signal(number, interrupt)) for number in (*numbers, signal.SIGALRM)]
    report = sys.unraisablehook

    def hear(ignored: sys.UnraisableHookArgs) -> None:
        if issubclass(ignored.exc_type, KeyboardInterrupt):
            _try_again()
        else:
            report(ignored)

    sys.unraisablehook = hear
    try:
        yield heard
    finally:
        signal.setitimer(signal.ITIMER_REAL, 0)
        sys.unraisablehook = report
        for number, handler in before:
            signal.signal(number, handler)


def _is_import(frame: FrameType) -> bool:
    return frame.f_code.co_filename.startswith("<frozen importlib")


def _loads_compiled_code(frame: FrameType | None) -> bool:
    """Return whether a compiled module is being initialized, which may import others."""
    while frame is not None:
        if _is_import(frame) and frame.f_code.co_qualname.startswith("ExtensionFileLoader."):
            return True
        frame = frame.f_back
    return False


def _try_again() -> None:
    signal.setitimer(signal.ITIMER_REAL, A_MOMENT)
