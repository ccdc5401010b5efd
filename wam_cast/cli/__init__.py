"""The command line `wam-cast`."""

from __future__ import annotations

import os
import sys


def main() -> None:
    """Run the command line and end the process with its exit code; Ctrl-C ends it with 130 and no traceback."""
    try:
        # Imported in here, where Ctrl-C is answered for.
        import signal

        handler = signal.getsignal(signal.SIGINT)
        is_answered = handler is signal.default_int_handler
        if is_answered:  # nothing is begun yet, and a `KeyboardInterrupt` can get lost where Python loads modules
            signal.signal(signal.SIGINT, _leave)
        try:
            from contextlib import nullcontext

            from wam_cast.cli.interruption import heard_everywhere
            from wam_cast.cli.running import run

            with heard_everywhere() if is_answered else nullcontext():
                code = run(sys.argv[1:] or ["--help"])
        finally:
            signal.signal(signal.SIGINT, handler)
    except KeyboardInterrupt:
        code = 130
    if code == 130:
        exec("")  # lest Python remember an interruption amid another `exec`, as dataclasses have, and end by a signal
        _say_interrupted()
    sys.exit(code)


def _leave(*_: object) -> None:
    _say_interrupted()
    os._exit(130)


def _say_interrupted() -> None:
    try:  # noqa: SIM105 -- the handler may be called amid an import, where it cannot import anything itself
        print("interrupted", file=sys.stderr, flush=True)
    except OSError:
        pass
