"""The command line `wam-cast`."""

from __future__ import annotations

import os
import sys
from collections.abc import Container


def main() -> None:
    """Run the command line and end the process with its exit code.

    Ctrl-C ends it with 130 and no traceback. So does SIGTERM what is under way, and the process then ends by that signal.
    """
    heard: Container[int] = ()
    try:
        # Imported in here, where Ctrl-C is answered for.
        import signal

        handler = signal.getsignal(signal.SIGINT)
        answered = [signal.SIGTERM] if signal.getsignal(signal.SIGTERM) is signal.SIG_DFL else []
        if handler is signal.default_int_handler:
            answered.append(signal.SIGINT)
            # Nothing is begun yet, and a `KeyboardInterrupt` can get lost where Python loads modules.
            signal.signal(signal.SIGINT, _leave)
        try:
            from wam_cast.cli.interruption import heard_everywhere
            from wam_cast.cli.running import run

            with heard_everywhere(answered) as heard:
                code = run(sys.argv[1:] or ["--help"])
        finally:
            signal.signal(signal.SIGINT, handler)
    except KeyboardInterrupt:
        code = 130
    if code == 130:
        exec("")  # lest Python remember an interruption amid another `exec`, as dataclasses have, and end by a signal
        if heard and signal.SIGTERM in heard:
            _say("terminated")
            _end_by(signal.SIGTERM)
        _say("interrupted")
    sys.exit(code)


def _leave(*_: object) -> None:
    _say("interrupted")
    os._exit(130)


def _end_by(number: int) -> None:
    """End this process by a signal, as whoever sent it expects."""
    import signal

    for stream in (sys.stdout, sys.stderr):
        try:  # noqa: SIM105 -- as below
            stream.flush()
        except OSError:
            pass
    signal.signal(number, signal.SIG_DFL)
    os.kill(os.getpid(), number)


def _say(word: str) -> None:
    try:  # noqa: SIM105 -- the handler may be called amid an import, where it cannot import anything itself
        print(word, file=sys.stderr, flush=True)
    except OSError:
        pass
