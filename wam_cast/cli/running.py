"""Running a command line: whatever comes of it, an exit code and at most one line of error."""

from __future__ import annotations

import errno
import os
import re
from contextlib import chdir, suppress
from functools import cache
from importlib import import_module
from pathlib import Path
from typing import Any

import typer

from wam_cast.cli.commands import app
from wam_cast.cli.terminal import err, give_up_lost_streams, prepare_streams
from wam_cast.errors import InputError, MachineError, shortened

READER_LEFT = 141
"""What a shell reports of a program that SIGPIPE ended: 128 and the signal's number."""

CANNOT_BE_PRINTED = (errno.ENOSPC, errno.EDQUOT, errno.EFBIG, errno.EIO, errno.EBADF, errno.EAGAIN)
"""Of an `OSError` that comes here: files that cannot be written are input errors."""

LONGEST_USAGE = 400
"""Letters of what Typer says, which quotes the words that it was given."""


def run(words: list[str]) -> int:
    """Run a command line and return its exit code; an error is said in one line on standard error."""
    prepare_streams()
    ignore_matplotlib_settings()
    try:
        return _answer(words)
    except SystemExit as end:
        if end.code != 1:  # by which Typer and Rich end where nobody reads what they print
            raise
        code = READER_LEFT
    except OSError as error:
        if error.errno not in CANNOT_BE_PRINTED:
            raise
        code = 2
        with suppress(OSError, SystemExit):
            _print_error(
                f"what is printed cannot be written: {str(error.strerror).lower()}; make room there, or send it elsewhere"
            )
    give_up_lost_streams()
    return code


def ignore_matplotlib_settings() -> None:
    """Let matplotlib start from its own defaults: what it finds of a user's settings it may be unable to read, and then fails."""
    os.environ.update(MATPLOTLIBRC=os.devnull, MPLBACKEND="agg")
    if os.path.lexists("matplotlibrc"):  # in this folder: it looks there first
        with chdir(Path(__file__).parent):
            import_module("matplotlib")


def _answer(words: list[str]) -> int:
    try:
        code: int | None = _command()(words, prog_name="wam-cast", standalone_mode=False)
    except typer.Abort:
        return 130
    except (InputError, MachineError) as error:
        _print_error(str(error))
    except Exception as error:
        # Typer's own errors of usage; their common base has another home from version to version.
        if not hasattr(error, "format_message"):
            raise
        _print_error(_describe_usage(error))
    else:
        return code or 0
    return 2


@cache
def _command() -> Any:
    """Return what Typer makes of all commands, once in a process."""
    return typer.main.get_command(app)


def _describe_usage(error: Any) -> str:
    context = getattr(error, "ctx", None)
    command = "wam-cast" if context is None else context.command_path
    message = shortened(error.format_message().replace("Value error, ", "").rstrip("."), LONGEST_USAGE)
    if re.search(r"option: -[\d.]", message):
        message += " (a cup is one word: --cup 0.60,-0.25)"
    return f"{message[:1].lower()}{message[1:]}; see `{command} --help`"


def _print_error(line: str) -> None:
    err.print(f"error: {' '.join(line.split())}")  # one line, whatever it holds
