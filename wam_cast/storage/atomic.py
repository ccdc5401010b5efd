"""Files that a user asked for: written whole or not at all."""

from __future__ import annotations

import errno
import os
from pathlib import Path

from wam_cast.errors import InputError


def check_writable(path: str | Path) -> None:
    """Raise `InputError` if `write_file` cannot work; for asking before a long computation."""
    path = Path(path)
    if path.is_dir():
        raise _unwritable(path, errno.EISDIR)
    if not path.parent.exists():
        raise _unwritable(path, errno.ENOENT)
    if not path.parent.is_dir():
        raise _unwritable(path, errno.ENOTDIR)
    if not os.access(path if _is_device(path) else path.parent, os.W_OK):
        raise _unwritable(path, errno.EACCES)


def write_file(path: str | Path, content: bytes) -> None:
    """Write `content` to `path` under a temporary name and rename it; what was there before is replaced.

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
            _replace(path.resolve(), content)
    except (OSError, RuntimeError) as error:  # RuntimeError: a link to itself
        raise _unwritable(path, getattr(error, "errno", None) or errno.ELOOP) from None


def _replace(path: Path, content: bytes) -> None:
    temporary = path.parent / f".{path.name}.{os.getpid()}.part"
    try:
        temporary.write_bytes(content)
        temporary.replace(path)
    finally:
        temporary.unlink(missing_ok=True)


def _is_device(path: Path) -> bool:
    return path.exists() and not path.is_file()


def _unwritable(path: Path, code: int) -> InputError:
    return InputError(
        f"cannot write {path}: {os.strerror(code).lower()}; name a file in an existing folder that you may write to"
    )
