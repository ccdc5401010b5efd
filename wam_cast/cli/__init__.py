"""The command line `wam-cast`."""

import re
import sys
from typing import NoReturn


def main() -> NoReturn:
    """Run the command line and end the process with its exit code; Ctrl-C ends it with 130 and no traceback."""
    try:
        code = _run(sys.argv[1:] or ["--help"])
    except KeyboardInterrupt:
        code = 130
    if code == 130:
        print("interrupted", file=sys.stderr)
    sys.exit(code)


def _run(words: list[str]) -> int:
    # Imported in here, where Ctrl-C is answered for.
    import typer

    from wam_cast.cli.commands import app
    from wam_cast.cli.terminal import err
    from wam_cast.errors import InputError, MachineError

    try:
        code: int | None = app(words, prog_name="wam-cast", standalone_mode=False)
    except typer.Abort:
        return 130
    except (InputError, MachineError) as error:
        line = str(error)
    except Exception as error:
        # Typer's own errors of usage; their common base has another home from version to version.
        if not hasattr(error, "format_message"):
            raise
        context = getattr(error, "ctx", None)
        command = "wam-cast" if context is None else context.command_path
        message = error.format_message().replace("Value error, ", "").rstrip(".")
        if re.search(r"option: -[\d.]", message):
            message += " (a cup is one word: --cup 0.60,-0.25)"
        line = f"{message[:1].lower()}{message[1:]}; see `{command} --help`"
    else:
        return code or 0
    err.print(f"error: {' '.join(line.split())}")  # one line, whatever the message holds
    return 2
