"""A directory for one piece of work: the same work goes on there, other work is refused, and a lock keeps a second process out."""

from __future__ import annotations

import errno
import os
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from itertools import count
from pathlib import Path
from typing import Any, ClassVar, Self

from filelock import FileLock, Timeout

from wam_cast.errors import InputError, quoted
from wam_cast.storage.atomic import replacing

ELSEWHERE = "choose another directory (--out)"


class WorkDirectory:
    """What directories of datasets and of runs have in common; `path` need not exist yet.

    As a context manager it makes the directory and keeps other processes out; it raises `.InputError` if one is at work there,
    something else is there, or it cannot be written.

    Attributes
    ----------
    kind
        What is kept there, for messages.
    identity_name
        Of the file that says which work it is.
    path, identity_path, scenario_path
        The directory, that file, and the file of the scenario.
    """

    kind: ClassVar[str]
    identity_name: ClassVar[str]

    def __init__(self, path: str | Path) -> None:
        self.path = Path(path)
        self.identity_path, self.scenario_path = self.path / self.identity_name, self.path / "scenario.yaml"
        # The system lets go of the lock when the process ends, however it does.
        self._lock = FileLock(self.path / ".lock", timeout=0)

    def __enter__(self) -> Self:
        self.is_begun(self.path)  # nothing is left in a directory of something else, not even a lock
        self._make_folders(self.path)
        with errors_of_writing(self.kind, self.path):
            try:
                self._lock.acquire()
            except Timeout:
                raise InputError(
                    f"{self.path}: another run is at work there; wait for its end, or {ELSEWHERE}"
                ) from None
            except (OSError, NotImplementedError) as error:
                if isinstance(error, OSError) and not os.path.lexists(self._lock.lock_file):
                    raise  # the disk is full, or the like
                reason = getattr(error, "strerror", None) or error
                raise InputError(
                    f"{self.path}: its .lock cannot be opened ({reason}); move it away, or {ELSEWHERE}"
                ) from None
        return self

    def __exit__(self, *_: object) -> None:
        self._lock.release()

    @classmethod
    def is_begun(cls, path: str | Path) -> bool:
        """Return whether work has begun at `path`; for asking before a long computation.

        Raises `.InputError` if something else is there, or the directory cannot be written.
        """
        path = Path(path)
        with errors_of_writing(cls.kind, path):
            there = path.iterdir() if _exists(path) else ()
            entries = sorted(entry.name for entry in there if entry.name[0] != ".")
            nearest = next(folder for folder in (path, *path.absolute().parents) if _exists(folder))
            if not nearest.is_dir():
                raise NotADirectoryError(errno.ENOTDIR, os.strerror(errno.ENOTDIR))
            if not os.access(nearest, os.W_OK):
                raise PermissionError(errno.EACCES, os.strerror(errno.EACCES))
        if entries and cls.identity_name not in entries:
            raise InputError(f"{path} holds {entries[0]} and no {cls.kind}; choose an empty or a new directory (--out)")
        return bool(entries)

    def _check_same(self, old: Mapping[str, Any], new: Mapping[str, Any]) -> None:
        """Raise `.InputError` unless what is here, `old`, is what is wanted, `new`."""
        for key, was, wanted in differences(old, new):
            raise InputError(
                f"{self.path} holds a {self.kind} with another {key} ({quoted(was)}, not {quoted(wanted)}); {ELSEWHERE}"
            )

    def _set_aside(self, path: Path) -> Path:
        """Move a file out of the way, to `set_aside/`, and return where it is. Raises `.InputError` if the system refuses."""
        folder = self.path / "set_aside"
        self._make_folders(folder)
        taken = (folder / f"{path.stem}{f'-{n}' if n else ''}{path.suffix}" for n in count())
        aside = next(name for name in taken if not name.exists())
        with errors_of_writing(self.kind, self.path):
            path.rename(aside)
        return aside

    def _make_folders(self, *folders: Path) -> None:
        """Make what is not there. Raises `.InputError` if the system refuses."""
        with errors_of_writing(self.kind, self.path):
            for folder in folders:
                try:
                    folder.mkdir(parents=True, exist_ok=True)
                except FileExistsError:
                    raise InputError(f"{folder} is in the way of a folder; move it away, or {ELSEWHERE}") from None

    def _write(self, path: Path, content: bytes) -> None:
        """Write a file. Raises `.InputError` if the system refuses."""
        with self._writing(path) as temporary:
            temporary.write_bytes(content)

    @contextmanager
    def _writing(self, path: Path) -> Iterator[Path]:
        """Do as `replacing` does. Raises `.InputError` if the system refuses.

        The temporary file is in the directory itself, so that a folder of Parquet never holds anything else: polars skips nothing.
        """
        with errors_of_writing(self.kind, self.path), replacing(path, self.path) as temporary:
            yield temporary


@contextmanager
def errors_of_writing(kind: str, path: Path) -> Iterator[None]:
    """Raise `.InputError` where the system refuses to write a directory of that `kind` at `path`."""
    try:
        yield
    except OSError as error:
        raise InputError(
            f"{kind} {path}: cannot be written ({error.strerror or error}); "
            f"choose a directory (--out) that can, on a disk with room"
        ) from None


def _exists(path: Path) -> bool:
    """Return whether something is at `path`. Raises `OSError` if nothing can be there, since a name is none."""
    try:
        path.stat()
    except (FileNotFoundError, NotADirectoryError):
        return False
    except ValueError as error:  # a null byte
        raise OSError(errno.EINVAL, str(error)) from None
    return True


def differences(old: Mapping[str, Any], new: Mapping[str, Any]) -> Iterator[tuple[str, Any, Any]]:
    """Yield the name of each value that differs, such as `scenario.ball.mass`, and the two values.

    By hand: the paths that a package (`deepdiff`) gives would have to be reworded, which takes as many lines.
    """
    for key in {**new, **old}:
        was, wanted = old.get(key), new.get(key)
        if isinstance(was, dict) and isinstance(wanted, dict):
            yield from ((f"{key}.{inner}", *values) for inner, *values in differences(was, wanted))
        elif was != wanted:
            yield key, was, wanted
