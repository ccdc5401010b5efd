"""A run's directory: what each phase found, so that an interrupted run goes on where it stopped.

settings.json           what the run depends on
scenario.yaml           the scenario
phases/NAME.json        what a finished phase found
wall.json               how long each phase took, all attempts together
casts/, noisy_casts/    datasets, which grow part by part
figures/, report.md, report.html, results.json
"""

from __future__ import annotations

import fcntl
import json
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import IO, Any, Self, TypeVar

from pydantic import BaseModel, ValidationError

from wam_cast.errors import InputError
from wam_cast.experiments.paper.settings import Settings
from wam_cast.storage.atomic import write_file

R = TypeVar("R", bound=BaseModel)


class RunDirectory:
    """Where a run of the experiment is kept; made if it is not there.

    As a context manager it keeps other runs out.

    Raises
    ------
    InputError
        If something else is there, a run with other settings, or the directory cannot be written.
    """

    def __init__(self, path: str | Path, settings: Settings) -> None:
        self.path = Path(path)
        self._lock: IO[str] | None = None
        self._open(settings)

    def __enter__(self) -> Self:
        # The system lets go of the lock when the process ends, however it does.
        self._lock = (self.path / ".lock").open("w")
        try:
            fcntl.flock(self._lock, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except OSError:
            self._lock.close()
            raise InputError(
                f"{self.path}: another run is at work there; wait for its end, or choose another directory (--out)"
            ) from None
        return self

    def __exit__(self, *_: object) -> None:
        if self._lock is not None:
            self._lock.close()

    @property
    def casts(self) -> Path:
        """Of the dataset."""
        return self.path / "casts"

    @property
    def noisy_casts(self) -> Path:
        """Of the dataset with noise."""
        return self.path / "noisy_casts"

    @property
    def figures(self) -> Path:
        """Of the report's figures."""
        return self.path / "figures"

    def phase(self, name: str, kind: type[R], compute: Callable[[], R]) -> R:
        """Return what phase `name` found: from its file, or computed now and written there."""
        path = self.path / "phases" / f"{name}.json"
        if path.exists():
            try:
                return kind.model_validate_json(path.read_bytes())
            except (OSError, ValidationError):
                pass  # cut off: computed again
        with self.timed(name):
            result = compute()
        write_file(path, result.model_dump_json().encode())
        return result

    @contextmanager
    def timed(self, name: str) -> Iterator[None]:
        """Add the time that the context takes to that of phase `name`, also when it is interrupted."""
        started = time.perf_counter()
        try:
            yield
        finally:
            seconds = self.wall_seconds()
            seconds[name] = seconds.get(name, 0.0) + time.perf_counter() - started
            write_file(self.path / "wall.json", json.dumps(seconds, indent=1).encode())

    def wall_seconds(self) -> dict[str, float]:
        """Return how long each phase took [s], all attempts together but for those that were killed."""
        try:
            return {str(k): float(v) for k, v in json.loads((self.path / "wall.json").read_bytes()).items()}
        except (OSError, ValueError, AttributeError):
            return {}

    def _open(self, settings: Settings) -> None:
        identity = json.loads(json.dumps(settings.identity))
        try:
            self.path.mkdir(parents=True, exist_ok=True)
            entries = sorted(p.name for p in self.path.iterdir() if not p.name.startswith("."))
            if "settings.json" in entries:
                self._check_same(identity)
            elif entries:
                raise InputError(
                    f"{self.path} holds {entries[0]} and no run of the experiment; choose an empty or a new directory (--out)"
                )
            else:
                write_file(self.path / "settings.json", (json.dumps(identity, indent=2) + "\n").encode())
            write_file(self.path / "scenario.yaml", settings.own_scenario.to_yaml().encode())
            for folder in (self.path / "phases", self.figures):
                folder.mkdir(exist_ok=True)
        except OSError as error:
            raise InputError(
                f"{self.path}: cannot be written ({error.strerror or error}); choose a directory (--out) that can"
            ) from None

    def _check_same(self, identity: dict[str, Any]) -> None:
        path = self.path / "settings.json"
        try:
            old = json.loads(path.read_bytes())
        except ValueError:
            old = None
        if not isinstance(old, dict):
            raise InputError(f"{path} cannot be read; choose another directory (--out)")
        difference = _first_difference(old, identity)
        if difference is not None:
            key, was, wanted = difference
            raise InputError(
                f"{self.path} holds a run with another {key} ({was!r}, not {wanted!r}); choose another directory (--out)"
            )


def _first_difference(old: dict[str, Any], new: dict[str, Any]) -> tuple[str, Any, Any] | None:
    """Return the name of the first value that differs, such as `scenario.ball.mass`, and the two values; or none."""
    for key in [*new, *(key for key in old if key not in new)]:
        was, wanted = old.get(key), new.get(key)
        if isinstance(was, dict) and isinstance(wanted, dict):
            inner = _first_difference(was, wanted)
            if inner is not None:
                return f"{key}.{inner[0]}", *inner[1:]
        elif was != wanted:
            return key, was, wanted
    return None
