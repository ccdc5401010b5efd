"""Where `map` keeps finished casts until its picture is drawn, so that it goes on where it was interrupted."""

from __future__ import annotations

import os
import shutil
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from wam_cast.cli.terminal import err
from wam_cast.errors import InputError, MachineError


@contextmanager
def kept_until_drawn(picture: Path, command: str) -> Iterator[Path]:
    """Give a directory beside `picture` for finished casts, which goes once the context ends well.

    Raises `.InputError` if something else is in its place.

    If the context is interrupted and something is finished, say so, and that `command` goes on.
    """
    from wam_cast.experiments.floor_map import UnfinishedMap

    unfinished = picture.with_name(f"{picture.name}.unfinished")
    if os.path.islink(unfinished):  # noqa: PTH114 -- of any name; what it leads to is not the map's to remove
        raise InputError(
            f"{unfinished} is a link, where finished casts are to be kept; move it away, or choose another --out"
        )
    UnfinishedMap.is_begun(unfinished)
    try:
        yield unfinished
    except (KeyboardInterrupt, MachineError):
        if any(unfinished.glob("phases/*.json")):
            err.print(f"finished casts are kept in {unfinished}. Go on with: {command}")
        else:
            shutil.rmtree(unfinished, ignore_errors=True)
        raise
    shutil.rmtree(unfinished)
