"""A dataset on disk: a directory that any reader of Parquet understands, and that a run which was interrupted can go on with.

    scenario.yaml              the scenario
    manifest.json              `Manifest`: what the casts depend on, how many are wanted, what made them
    casts/part-00000.parquet   rows 0 to 49, and so on: the casts alone, so that the folder reads as one table

Every file is written under a hidden temporary name, which readers of Parquet skip, and then renamed: it is there in full or
not at all.
"""

from __future__ import annotations

import platform
from collections.abc import Callable
from importlib.metadata import version
from pathlib import Path
from typing import Any, Final, Literal

import pyarrow as pa
import pyarrow.parquet as pq
from pydantic import BaseModel, ConfigDict, NonNegativeInt, PositiveInt, ValidationError

from wam_cast.errors import InputError, describe_validation
from wam_cast.scenario import Scenario
from wam_cast.version import __version__

ROWS_PER_PART: Final = 50
"""Few enough that an interrupted run loses little."""

SCHEMA = pa.schema(
    [
        ("cast", pa.int64()),
        ("distance", pa.float64()),
        ("speed", pa.float64()),
        ("wait", pa.float64()),
        ("landing_along", pa.float64()),
        ("landing_across", pa.float64()),
        ("status", pa.string()),
        ("crossing_time", pa.float64()),
        ("entry_speed", pa.float64()),
        ("entry_angle", pa.float64()),
        ("is_slack", pa.bool_()),
        ("slack", pa.float64()),
        ("peak_load", pa.float64()),
        ("peak_speed", pa.float64()),
        ("peak_tracking_error", pa.float64()),
    ]
)
"""The columns of a dataset; `CastDataset` says what they mean."""


class Manifest(BaseModel):
    """What a dataset is.

    Attributes
    ----------
    format
        Version of the directory's layout.
    fingerprint
        Of the scenario, when the casts were made.
    seed, n_casts
        Which casts, and how many a finished run has.
    rows_per_part
        Rows of each part but the last.
    versions
        Of the software: an entry for each combination that worked on the dataset.
    """

    model_config = ConfigDict(frozen=True, extra="forbid")

    format: Literal[1] = 1
    fingerprint: str
    seed: NonNegativeInt
    n_casts: PositiveInt
    rows_per_part: Literal[50] = ROWS_PER_PART
    versions: tuple[dict[str, str], ...]


def part_rows(n_casts: int) -> list[range]:
    """Return the rows of each part of a dataset of `n_casts`."""
    return [range(start, min(start + ROWS_PER_PART, n_casts)) for start in range(0, n_casts, ROWS_PER_PART)]


def current_versions() -> dict[str, str]:
    """Return the versions of what a cast is made with."""
    packages = {package: version(package) for package in ("drake", "numpy")}
    return {"wam_cast": __version__, "python": platform.python_version()} | packages


class DatasetDirectory:
    """A dataset's directory; `path` need not exist yet."""

    def __init__(self, path: str | Path) -> None:
        self.path = Path(path)

    def open(self, scenario: Scenario, seed: int, n_casts: int) -> Manifest:
        """Begin a dataset here, or go on with the one that is here, and return its manifest.

        A dataset may grow: `n_casts` can be more than before.

        Raises
        ------
        InputError
            If something else is here, or the directory cannot be written.
        """
        entries, versions = self._visible_entries(), current_versions()
        if "manifest.json" in entries:
            old = self.read_manifest()
            self._check_same(old, scenario, seed, n_casts)
            history = old.versions if versions in old.versions else (*old.versions, versions)
            manifest = old.model_copy(update={"n_casts": n_casts, "versions": history})
        elif entries:
            raise InputError(
                f"{self.path} holds {entries[0]} and no dataset; choose an empty or a new directory (--out)"
            )
        else:
            manifest = Manifest(
                fingerprint=scenario.fingerprint, seed=seed, n_casts=n_casts, versions=(versions,)
            )
        self._prepare(manifest, scenario)
        return manifest

    def read_manifest(self) -> Manifest:
        """Return the manifest. Raises `InputError` if there is none, or none that this version understands."""
        try:
            return Manifest.model_validate_json(self._manifest_path.read_bytes())
        except OSError as error:
            raise InputError(
                f"{self.path} is not a dataset (manifest.json: {error.strerror}); "
                f"name a directory that `wam-cast generate --out` has made"
            ) from None
        except ValidationError as error:
            raise InputError(
                f"dataset {self.path}: manifest.json cannot be used ({describe_validation(error)}); "
                f"generate the dataset again into another directory"
            ) from None

    def read_scenario(self) -> Scenario:
        """Return the scenario. Raises `InputError` if it cannot be read."""
        return Scenario.from_yaml(self.scenario_path)

    def read_parts(self, n_casts: int) -> list[pa.Table | None]:
        """Return the parts of a dataset of `n_casts`; None for those that are missing, unreadable, or not complete."""
        return [self._read_part(part, len(rows)) for part, rows in enumerate(part_rows(n_casts))]

    def _read_part(self, part: int, n_rows: int) -> pa.Table | None:
        try:
            with pq.ParquetFile(self._part_path(part)) as file:
                table = file.read()
        except (OSError, pa.ArrowException):
            return None
        return table if table.schema.equals(SCHEMA) and table.num_rows == n_rows else None

    def write_part(self, part: int, table: pa.Table) -> None:
        """Write a part. Raises `InputError` if that fails."""
        self._write(self._part_path(part), lambda path: pq.write_table(table, path))

    def _prepare(self, manifest: Manifest, scenario: Scenario) -> None:
        text = manifest.model_dump_json(indent=2) + "\n"
        try:
            self.path.mkdir(parents=True, exist_ok=True)
            self._write(self._manifest_path, lambda path: path.write_text(text, encoding="utf-8"))
            if not self.scenario_path.exists():
                yaml = scenario.to_yaml()
                self._write(self.scenario_path, lambda path: path.write_text(yaml, encoding="utf-8"))
            self._casts_path.mkdir(exist_ok=True)
            for folder in (self.path, self._casts_path):
                for stale in folder.glob(".*.tmp"):
                    stale.unlink()
        except OSError as error:
            raise self._unwritable(error) from None

    def _check_same(self, old: Manifest, scenario: Scenario, seed: int, n_casts: int) -> None:
        here = f"dataset {self.path}: "
        elsewhere = "choose another directory (--out)"
        if old.fingerprint != scenario.fingerprint:
            raise InputError(
                f"{here}its casts are of the scenario {old.fingerprint}, those asked for of {scenario.fingerprint}; {elsewhere}"
            )
        if old.seed != seed:
            raise InputError(
                f"{here}its casts are of seed {old.seed}, those asked for of seed {seed}; {elsewhere}"
            )
        if old.n_casts > n_casts:
            raise InputError(
                f"{here}it is one of {old.n_casts} casts, more than the {n_casts} asked for; ask for as many, or {elsewhere}"
            )

    def _visible_entries(self) -> list[str]:
        try:
            return sorted(entry.name for entry in self.path.iterdir() if not entry.name.startswith("."))
        except FileNotFoundError:
            return []
        except OSError as error:
            raise self._unwritable(error) from None

    def _write(self, path: Path, write: Callable[[Path], Any]) -> None:
        temporary = path.with_name(f".{path.name}.tmp")
        try:
            write(temporary)
            temporary.replace(path)
        except OSError as error:
            temporary.unlink(missing_ok=True)
            raise self._unwritable(error) from None

    def _unwritable(self, error: OSError) -> InputError:
        return InputError(
            f"dataset {self.path}: cannot be written ({error.strerror or error}); "
            f"choose a directory (--out) that can, on a disk with room"
        )

    @property
    def _manifest_path(self) -> Path:
        return self.path / "manifest.json"

    @property
    def scenario_path(self) -> Path:
        """Where the scenario is."""
        return self.path / "scenario.yaml"

    @property
    def _casts_path(self) -> Path:
        return self.path / "casts"

    def _part_path(self, part: int) -> Path:
        return self._casts_path / f"part-{part:05d}.parquet"
