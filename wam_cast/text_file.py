"""Files that a user names or may have edited: read only if they are regular files, and no larger than they can be."""

from __future__ import annotations

import errno
import os
import stat
from pathlib import Path

LARGEST = 1_000_000
"""More bytes than any scenario or manifest has."""


def read_text(path: str | Path, largest: int = LARGEST) -> str:
    """Return the text of a UTF-8 file, without the byte-order mark that some editors put first.

    Raises `OSError` if it is no regular file, which might never end, too large or not readable; `UnicodeDecodeError` if it is no
    UTF-8.
    """
    return read_bytes(path, largest).decode("utf-8-sig")


def read_bytes(path: str | Path, largest: int) -> bytes:
    """Return what a file holds. Raises `OSError` as `read_text` does."""
    check_regular(path)
    with Path(path).open("rb") as file:
        content = file.read(largest + 1)
    if len(content) > largest:
        raise OSError(errno.EFBIG, f"larger than {largest} bytes", str(path))
    return content


def check_regular(path: str | Path) -> None:
    """Raise `OSError` unless there is a regular file, which can be read to its end."""
    mode = Path(path).stat().st_mode
    if stat.S_ISDIR(mode):
        raise IsADirectoryError(errno.EISDIR, os.strerror(errno.EISDIR), str(path))
    if not stat.S_ISREG(mode):
        raise OSError(errno.EINVAL, "not a regular file", str(path))
