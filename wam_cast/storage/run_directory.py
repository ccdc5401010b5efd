"""A run's directory: what each phase found, so that an interrupted run goes on where it stopped.

settings.json           what the run depends on
scenario.yaml           the scenario
phases/NAME.json        what a finished phase found, with its checksum
wall.json               how long each phase took, all attempts together
set_aside/              phases that were damaged or edited, and were computed again
casts/, noisy_casts/    datasets, which grow part by part
figures/, report.md, report.html, results.json
"""

from __future__ import annotations

import hashlib
import json
import logging
import os
import re
import time
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path
from typing import Self, TypeVar

from pydantic import TypeAdapter

from wam_cast.errors import InputError
from wam_cast.scenario import Scenario
from wam_cast.storage.work_directory import ELSEWHERE, WorkDirectory
from wam_cast.text_file import LARGEST, read_bytes, read_text

_logger = logging.getLogger(__name__)

R = TypeVar("R")

LARGEST_PHASE = 100_000_000
"""Bytes that the result of a phase may have."""


class RunDirectory(WorkDirectory):
    """Where a run of an experiment is kept: a context manager, in which the directory is this run's alone.

    Parameters
    ----------
    path
        The directory.
    identity
        What must be the same for a run to go on where another one stopped; goes to JSON.
    scenario
        Stored beside the results, so that the run can be repeated.

    Raises
    ------
    InputError
        On entering, if something else is there, a run of another identity or one at work, or the directory cannot be written.
    """

    kind = "run of the experiment"
    identity_name = "settings.json"

    def __init__(self, path: str | Path, identity: Mapping[str, object], scenario: Scenario) -> None:
        super().__init__(path)
        self._identity, self._scenario = json.dumps(identity, indent=2), scenario
        self.casts, self.noisy_casts = self.path / "casts", self.path / "noisy_casts"
        self._phases, self._wall = self.path / "phases", self.path / "wall.json"

    def __enter__(self) -> Self:
        super().__enter__()
        try:
            self._open()
        except InputError:
            self._lock.release()
            raise
        return self

    def _open(self) -> None:
        """Begin a run, or see that the one here is the same."""
        if self.is_begun(self.path):
            try:
                old = TypeAdapter(dict[str, object]).validate_json(read_text(self.identity_path))
            except (OSError, ValueError, RecursionError):
                raise InputError(f"{self.identity_path} cannot be read; {ELSEWHERE}") from None
            self._check_same(old, json.loads(self._identity))
        else:
            self._write(self.identity_path, f"{self._identity}\n".encode())
        self._keep_scenario()
        self._make_folders(self._phases)

    def _keep_scenario(self) -> None:
        """Write the scenario; what is there and is not that, edited perhaps, is moved out of the way."""
        content = self._scenario.to_yaml().encode()
        try:
            if read_bytes(self.scenario_path, LARGEST) == content:
                return
            is_there = True
        except OSError:
            is_there = os.path.lexists(self.scenario_path)
        if is_there:
            aside = self._set_aside(self.scenario_path)
            _logger.warning("%s: scenario.yaml is not what was written there; it is now %s", self.path, aside)
        self._write(self.scenario_path, content)

    def phase(self, name: str, kind: type[R], compute: Callable[[], R]) -> R:
        """Return what phase `name` found: from its file, see `found`, or computed now and written there.

        Parameters
        ----------
        name
            Of the file too.
        kind
            What it finds: a pydantic model, a dataclass, or any other type that pydantic takes to JSON and back.
        compute
            Finds it.
        """
        result = self.found(name, kind)
        if result is None:
            with self.timed(name):
                result = compute()
            self.keep(name, kind, result)
        return result

    def found(self, name: str, kind: type[R]) -> R | None:
        """Return what a finished phase found, none if it is not finished.

        A file that is not what was written there, by its checksum, is moved to `set_aside/`, and does not count.
        """
        path = self._phases / f"{name}.json"
        try:
            return TypeAdapter(kind).validate_json(_unsealed(read_bytes(path, LARGEST_PHASE)))
        except FileNotFoundError:
            return None
        except (OSError, ValueError, RecursionError):
            aside = self._set_aside(path)
            _logger.warning(
                "%s: %s is not what was written there; it is now %s, and is computed again", self.path, path, aside
            )
            return None

    def keep(self, name: str, kind: type[R], result: R) -> None:
        """Write what a phase found. Raises `.InputError` if the system refuses."""
        self._write(self._phases / f"{name}.json", _sealed(TypeAdapter(kind).dump_json(result)))

    def folder(self, name: str) -> Path:
        """Return a folder of that name in the directory, which is there. Raises `.InputError` if the system refuses."""
        self._make_folders(self.path / name)
        return self.path / name

    @contextmanager
    def timed(self, name: str) -> Iterator[None]:
        """Add the time that the context takes to that of phase `name`, also when it is interrupted."""
        started = time.perf_counter()
        try:
            yield
        finally:
            seconds = self.wall_seconds()
            seconds[name] = seconds.get(name, 0.0) + time.perf_counter() - started
            self._write(self._wall, _sealed(json.dumps(seconds, indent=1).encode()))

    def wall_seconds(self) -> dict[str, float]:
        """Return how long each phase took [s], all attempts together but for those that were killed."""
        try:
            return TypeAdapter(dict[str, float]).validate_json(_unsealed(read_bytes(self._wall, LARGEST_PHASE)))
        except (OSError, ValueError, RecursionError):
            return {}


def _sealed(found: bytes) -> bytes:
    """Return JSON within JSON that has its checksum."""
    return b'{"sha256": "%s",\n"found": %s}\n' % (hashlib.sha256(found).hexdigest().encode(), found)


def _unsealed(content: bytes) -> bytes:
    """Return what `_sealed` was given; raises `ValueError` if it has changed since."""
    match = re.fullmatch(rb'\{"sha256": "(.{64})",\n"found": (.*)\}\n', content, re.DOTALL)
    if match is None or hashlib.sha256(match[2]).hexdigest().encode() != match[1]:
        raise ValueError("damaged or edited")
    return match[2]
