"""Files that are written whole or not at all.

By hand, since what does this alone is unmaintained (`atomicwrites`), and what is maintained writes streams (`safer`), where
Parquet's writer wants a path.
"""

from __future__ import annotations

import errno
import glob
import os
import socket
from collections.abc import Iterator
from contextlib import contextmanager
from itertools import count
from pathlib import Path

from wam_cast.errors import InputError

_PREFIX, _SUFFIX = f".wam_cast-{socket.gethostname()}-", ".tmp"
"""Of a temporary file's name: between them, the number of the process on this machine and one of its own."""

_numbers = count()


@contextmanager
def replacing(path: Path, folder: Path | None = None) -> Iterator[Path]:
    """Give a temporary path beside `path`: what is written there takes the place of `path`, or goes if the context fails.

    With a `folder` it lies there. Its name is hidden. What killed processes have left beside it goes first.
    """
    beside = path if folder is None else folder / path.name
    _remove_leftovers(beside.parent)
    with _beside(beside) as temporary:
        yield temporary
        temporary.replace(path)


@contextmanager
def _beside(path: Path) -> Iterator[Path]:
    temporary = path.with_name(f"{_PREFIX}{os.getpid()}-{next(_numbers)}{_SUFFIX}")
    try:
        yield temporary
    finally:
        temporary.unlink(missing_ok=True)


def write_file(path: str | Path, content: bytes) -> None:
    """Write a file that a user asked for; what was there before is replaced.

    A link is followed; a device or a pipe is written to as it is.

    Raises
    ------
    InputError
        If the file cannot be written; then nothing has changed.
    """
    path = Path(path)
    with _refusing(path):
        if _is_device(path):
            path.write_bytes(content)
        else:
            with replacing(path.resolve()) as temporary:
                temporary.write_bytes(content)


def check_writable(path: str | Path) -> None:
    """Raise `.InputError` if `write_file` cannot work; for asking before a long computation."""
    path = Path(path)
    with _refusing(path):
        if not _is_device(path):
            with _beside(path.resolve()) as temporary:
                temporary.touch()
        elif not os.access(path, os.W_OK):
            raise OSError(errno.EACCES, "")


def _remove_leftovers(folder: Path) -> None:
    """Remove the temporary files in `folder` whose processes, on this machine, are no more."""
    for leftover in folder.glob(f"{glob.escape(_PREFIX)}*{_SUFFIX}"):
        process, _, number = leftover.name[len(_PREFIX) : -len(_SUFFIX)].partition("-")
        if process.isdecimal() and number.isdecimal() and not _is_alive(int(process)):
            leftover.unlink(missing_ok=True)


def _is_alive(process: int) -> bool:
    try:
        os.kill(process, 0)
    except ProcessLookupError:
        return False
    except (PermissionError, OverflowError):
        pass
    return True


def _is_device(path: Path) -> bool:
    """Return whether there is something else than a file. Raises `IsADirectoryError` if it is a folder."""
    if path.is_dir():
        raise IsADirectoryError(errno.EISDIR, "")
    return path.exists() and not path.is_file()


@contextmanager
def _refusing(path: Path) -> Iterator[None]:
    try:
        yield
    except (OSError, RuntimeError, ValueError) as error:  # RuntimeError: a link to itself; ValueError: a null byte
        code = getattr(error, "errno", None) or (errno.ELOOP if isinstance(error, RuntimeError) else errno.EINVAL)
        raise InputError(
            f"cannot write {path}: {os.strerror(code).lower()}; name a file in an existing folder that you may write to"
        ) from None
