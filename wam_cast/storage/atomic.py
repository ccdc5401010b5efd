"""Files that are written whole or not at all.

By hand, since what does this alone is unmaintained (`atomicwrites`), and what is maintained writes streams (`safer`), where
Parquet's writer wants a path.
"""

from __future__ import annotations

import errno
import os
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from wam_cast.errors import InputError


@contextmanager
def replacing(path: Path) -> Iterator[Path]:
    """Give a temporary path beside `path`: what is written there takes the place of `path`, or goes if the context fails.

    Its name is hidden, so that readers of a folder of Parquet skip it, and ends in `.tmp`.
    """
    temporary = path.with_name(f".{path.name}.{os.getpid()}.tmp")
    try:
        yield temporary
        temporary.replace(path)
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
    try:
        check_writable(path)
        if _is_device(path):
            path.write_bytes(content)
        else:
            with replacing(path.resolve()) as temporary:
                temporary.write_bytes(content)
    except (OSError, RuntimeError) as error:  # RuntimeError: a link to itself
        raise _unwritable(path, getattr(error, "errno", None) or errno.ELOOP) from None


def check_writable(path: str | Path) -> None:
    """Raise `.InputError` if `write_file` cannot work; for asking before a long computation."""
    path = Path(path)
    if path.is_dir():
        raise _unwritable(path, errno.EISDIR)
    if not path.parent.exists():
        raise _unwritable(path, errno.ENOENT)
    if not path.parent.is_dir():
        raise _unwritable(path, errno.ENOTDIR)
    if not os.access(path if _is_device(path) else path.parent, os.W_OK):
        raise _unwritable(path, errno.EACCES)


def _is_device(path: Path) -> bool:
    return path.exists() and not path.is_file()


def _unwritable(path: Path, code: int) -> InputError:
    return InputError(
        f"cannot write {path}: {os.strerror(code).lower()}; name a file in an existing folder that you may write to"
    )
