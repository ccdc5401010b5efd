"""Files that a user asked for: written whole or not at all."""

from __future__ import annotations

import os
from contextlib import suppress
from pathlib import Path

from wam_cast.errors import InputError


def write_file(path: str | Path, content: bytes) -> None:
    """Write `content` to `path` under a temporary name and rename it; what was there before is replaced.

    Raises
    ------
    InputError
        If the file cannot be written; then nothing has changed.
    """
    path = Path(path)
    temporary = path.parent / f".{path.name}.{os.getpid()}.part"
    try:
        temporary.write_bytes(content)
        temporary.replace(path)
    except OSError as error:
        with suppress(OSError):
            temporary.unlink()
        reason = (error.strerror or str(error)).lower()
        raise InputError(
            f"cannot write {path}: {reason}; name a file in an existing folder that you may write to"
        ) from None
