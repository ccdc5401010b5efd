"""Writing files whole or not at all."""

from __future__ import annotations

import os
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from wam_cast.errors import InputError


@contextmanager
def replace_file(path: str | Path) -> Iterator[Path]:
    """Give a temporary path beside `path` to write to, and rename it to `path` if all went well.

    Raises
    ------
    InputError
        If the file cannot be written; the temporary one is removed whatever happens.
    """
    target = Path(path)
    # The suffix stays, since some writers choose their format by it.
    temporary = target.with_name(f".{target.stem}.{os.getpid()}{target.suffix}")
    try:
        if target.is_dir():
            raise InputError(f"output {target} is a directory; name a file")
        yield temporary
        temporary.replace(target)
    except OSError as error:
        raise InputError(
            f"output {target}: cannot be written ({error.strerror or error}); name a file in a folder that is writable"
        ) from None
    finally:
        temporary.unlink(missing_ok=True)
