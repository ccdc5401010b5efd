"""A run's directory: what each phase found, so that an interrupted run goes on where it stopped.

settings.json           what the run depends on
scenario.yaml           the scenario
phases/NAME.json        what a finished phase found, and how long it took
casts/, noisy_casts/    datasets, which grow part by part
figures/, report.md, report.html, results.json
"""

from __future__ import annotations

import json
import time
from collections.abc import Callable
from pathlib import Path
from typing import TypeVar

from pydantic import ValidationError

from wam_cast.errors import InputError
from wam_cast.evaluation.experiment.results import Result
from wam_cast.evaluation.experiment.settings import Settings
from wam_cast.files import write_file

R = TypeVar("R", bound=Result)


class RunDirectory:
    """Where a run of the experiment is kept; made if it is not there.

    Raises
    ------
    InputError
        If something else is there, a run with other settings, or the directory cannot be written.
    """

    def __init__(self, path: str | Path, settings: Settings) -> None:
        self.path = Path(path)
        self._settings_path = self.path / "settings.json"
        self._open(settings)

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
        path = self._phase_path(name)
        if path.exists():
            try:
                return kind.model_validate(json.loads(path.read_bytes())["result"])
            except (OSError, ValueError, KeyError, TypeError, ValidationError):
                pass  # cut off, or of an older layout: computed again
        started = time.perf_counter()
        result = compute()
        content = {"wall_s": time.perf_counter() - started, "result": result.model_dump(mode="json")}
        write_file(path, json.dumps(content).encode())
        return result

    def wall_seconds(self) -> dict[str, float]:
        """Return how long each finished phase took [s]; of one that was interrupted, the last attempt."""
        found = sorted((self.path / "phases").glob("*.json"))
        return {path.stem: float(json.loads(path.read_bytes())["wall_s"]) for path in found}

    def _phase_path(self, name: str) -> Path:
        return self.path / "phases" / f"{name}.json"

    def _open(self, settings: Settings) -> None:
        identity = settings.identity
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
                write_file(self.path / "scenario.yaml", settings.own_scenario.to_yaml().encode())
                write_file(self._settings_path, (json.dumps(identity, indent=2) + "\n").encode())
            for folder in (self.path / "phases", self.figures):
                folder.mkdir(exist_ok=True)
        except OSError as error:
            raise InputError(
                f"{self.path}: cannot be written ({error.strerror or error}); choose a directory (--out) that can"
            ) from None

    def _check_same(self, identity: dict[str, object]) -> None:
        try:
            old = json.loads(self._settings_path.read_bytes())
            different = [key for key in identity if old.get(key) != json.loads(json.dumps(identity[key]))]
        except (ValueError, AttributeError):
            raise InputError(
                f"{self._settings_path} cannot be read; choose another directory (--out)"
            ) from None
        if different:
            key = different[0]
            was, wanted = (_short(values.get(key)) for values in (old, identity))
            raise InputError(
                f"{self.path} holds a run with another {key} ({was}, not {wanted}); choose another directory (--out)"
            )


def _short(value: object) -> str:
    text = json.dumps(value)
    return text if len(text) < 100 else f"{text[:97]}..."
