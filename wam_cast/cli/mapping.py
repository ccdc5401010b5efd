"""Where `map` keeps finished casts until its picture is drawn, so that it goes on where it was interrupted."""

from __future__ import annotations

import shutil
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from wam_cast.cli.terminal import err
from wam_cast.errors import MachineError


@contextmanager
def kept_until_drawn(picture: Path, command: str) -> Iterator[Path]:
    """Give a directory beside `picture` for finished casts, which goes once the context ends well.

    If the context is interrupted and something is finished, say so, and that `command` goes on.
    """
    unfinished = picture.with_name(f"{picture.name}.unfinished")
    try:
        yield unfinished
    except (KeyboardInterrupt, MachineError):
        if any(unfinished.glob("phases/*.json")):
            err.print(f"finished casts are kept in {unfinished}. Go on with: {command}")
        else:
            shutil.rmtree(unfinished, ignore_errors=True)
        raise
    shutil.rmtree(unfinished)
