"""What `wam-cast` runs: the commands, with errors of the user's in one line each, and the exit codes."""

from __future__ import annotations

import re
import sys
from typing import NoReturn

import typer

from wam_cast.cli.commands import app
from wam_cast.cli.terminal import err
from wam_cast.errors import InputError


def run() -> NoReturn:
    """Run the command line and end the process with its exit code."""
    try:
        code = app(sys.argv[1:] or ["--help"], prog_name="wam-cast", standalone_mode=False)
    except InputError as error:
        _refuse(str(error))
    except (KeyboardInterrupt, typer.Abort):
        code = 130
    except Exception as error:
        # Typer's own errors of usage; their common base has another home from version to version.
        if not hasattr(error, "format_message"):
            raise
        context = getattr(error, "ctx", None)
        command = "wam-cast" if context is None else context.command_path
        message = error.format_message().replace("Value error, ", "").rstrip(".")
        if re.search(r"option: -[\d.]", message):
            message += " (a cup is one word: --cup 0.60,-0.25)"
        _refuse(f"{message[:1].lower()}{message[1:]}; see `{command} --help`")
    if code == 130:
        err.print("interrupted")
    sys.exit(code if isinstance(code, int) else 0)


def _refuse(message: str) -> NoReturn:
    err.print(f"error: {' '.join(message.split())}")  # one line, whatever the message holds
    sys.exit(2)
