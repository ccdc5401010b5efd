"""A dataset on disk: a directory that any reader of Parquet understands, and that a run which was interrupted can go on with.

::

    scenario.yaml              the scenario
    manifest.json              `Manifest`: what the casts depend on, how many are wanted, what made them; with checksums
    casts/part-00000.parquet   rows 0 to 49, and so on: nothing else, so that every reader takes the folder for one table
    set_aside/                 parts that were not what they must be, and were simulated again; so with scenario.yaml

Every file is there in full or not at all. One process at a time works here.
"""

from __future__ import annotations

import json
import logging
import os
from collections.abc import Callable
from pathlib import Path

import pyarrow as pa
from pydantic import ValidationError

from wam_cast.errors import InputError, describe_validation, quoted
from wam_cast.scenario import Scenario
from wam_cast.storage.casts_part import PartError, read_part, write_part
from wam_cast.storage.manifest import FORMAT, ROWS_PER_PART, Engine, Manifest, current_versions
from wam_cast.storage.work_directory import ELSEWHERE, WorkDirectory, differences, errors_of_writing
from wam_cast.text_file import read_text
from wam_cast.types import Array

_logger = logging.getLogger(__name__)

MEND_PARTS = "restore it, or simulate it anew with `wam-cast generate --force`, which moves what is there to set_aside/"


def part_rows(n_casts: int) -> list[range]:
    """Return the rows of each part of a dataset of `n_casts`."""
    return [range(start, min(start + ROWS_PER_PART, n_casts)) for start in range(0, n_casts, ROWS_PER_PART)]


class DatasetDirectory(WorkDirectory):
    """A dataset's directory; `path` need not exist yet."""

    kind = "dataset"
    identity_name = "manifest.json"

    def __init__(self, path: str | Path) -> None:
        super().__init__(path)
        self._casts_path = self.path / "casts"

    def open(self, scenario: Scenario, seed: int, n_casts: int, controller: str, engine: Engine) -> None:
        """Begin a dataset here, or go on with the one that is here; within the context that keeps others out.

        A dataset may grow: `n_casts` can be more than before.

        Raises
        ------
        InputError
            If something else is here, or the directory cannot be written.
        """
        versions: tuple[dict[str, str], ...] = (current_versions(),)
        stored: Scenario | None = None
        if self.is_begun(self.path):
            old = self.read_manifest()
            self._check_same(
                {"scenario": old.fingerprint, "controller": old.controller, "engine": old.engine, "seed": old.seed},
                {"scenario": scenario.fingerprint, "controller": controller, "engine": engine, "seed": seed},
            )
            if old.n_casts > n_casts:
                raise InputError(
                    f"{self.path} holds a dataset of {old.n_casts} casts, more than the {n_casts} asked for; "
                    f"ask for as many, or {ELSEWHERE}"
                )
            versions = old.versions if versions[0] in old.versions else old.versions + versions
            stored = self._stored_scenario(old)
        manifest = Manifest(
            fingerprint=scenario.fingerprint,
            controller=controller,
            engine=engine,
            seed=seed,
            n_casts=n_casts,
            versions=versions,
            scenario=(stored or scenario).model_dump(mode="json"),
        )
        self._write(self.identity_path, f"{manifest.sealed().model_dump_json(indent=2)}\n".encode())
        if stored is None:
            self._write(self.scenario_path, scenario.to_yaml().encode())
        self._make_folders(self._casts_path)
        with errors_of_writing(self.kind, self.path):
            for folder in (self.path, self._casts_path):
                for stale in folder.glob(".*.tmp"):  # of a run that was killed
                    stale.unlink()

    def _stored_scenario(self, manifest: Manifest) -> Scenario | None:
        """Return what is in `scenario.yaml`; if it is not what was written there, it is moved out of the way."""
        if not self.scenario_path.exists():
            return None
        try:
            scenario = self.read_scenario(manifest)
            if scenario.fingerprint == manifest.fingerprint:
                return scenario
            reason = "not the scenario of its casts"
        except InputError as error:
            reason = str(error)
        aside = self._set_aside(self.scenario_path)
        _logger.warning("dataset %s: scenario.yaml: %s; it is now %s, and is written anew", self.path, reason, aside)
        return None

    def read_scenario(self, manifest: Manifest) -> Scenario:
        """Return the scenario that is stored. Raises `.InputError` if it cannot be read, or is not what was written."""
        scenario = Scenario.from_yaml(self.scenario_path)
        if manifest.scenario is not None:
            values = manifest.scenario.copy()
            if isinstance(arm := values.get("arm"), dict):
                values["arm"] = arm | {"urdf": scenario.arm.urdf}  # which may lie elsewhere now
            written = Scenario.from_dict(values)
            for key, was, found in differences(written.model_dump(mode="json"), scenario.model_dump(mode="json")):
                raise InputError(
                    f"{self.scenario_path}: {key} is {quoted(found)}, and was {quoted(was)} when it was written; restore it"
                )
        return scenario

    def read_manifest(self) -> Manifest:
        """Return the manifest. Raises `.InputError` if there is none, or none that this version understands."""
        try:
            text = read_text(self.identity_path)
            self._check_format(text)
            manifest = Manifest.model_validate_json(text)
        except OSError as error:
            raise InputError(
                f"{self.path} is not a dataset (manifest.json: {error.strerror}); "
                f"name a directory that `wam-cast generate --out` has made"
            ) from None
        except (ValidationError, UnicodeDecodeError) as error:
            what = describe_validation(error) if isinstance(error, ValidationError) else error.reason
            raise InputError(
                f"dataset {self.path}: manifest.json cannot be used ({what}); generate the dataset again into another directory"
            ) from None
        for name in manifest.changed_fields():
            found = quoted(getattr(manifest, name, None))
            raise InputError(
                f"dataset {self.path}: manifest.json was changed since it was written: {name} = {found} does not match its "
                "checksum; restore it, or generate the dataset again into another directory"
            )
        return manifest

    def _check_format(self, manifest: str) -> None:
        """Raise `.InputError` with the command that makes the dataset anew if it is of another format."""
        try:
            values = json.loads(manifest)
            found, n_casts, seed = values["format"], values["n_casts"], values["seed"]
        except (ValueError, LookupError, TypeError, RecursionError):
            return  # no manifest at all: pydantic says what is wrong with it
        if found != FORMAT and type(n_casts) is type(seed) is int:
            raise InputError(
                f"dataset {self.path}: of format {quoted(found)}, this version reads {FORMAT}; make it anew with `wam-cast "
                f"generate --casts {n_casts} --seed {seed} --out DIR`, with its --scenario if it has one"
            )

    def check_not_own(self, file: Path) -> None:
        """Raise `.InputError` if `file` is one of the dataset's own, which something else would overwrite."""
        real = Path(os.path.realpath(file))
        own = {Path(os.path.realpath(path)) for path in (self.identity_path, self.scenario_path, self._casts_path)}
        if own & {real, real.parent}:
            raise InputError(f"cannot write {file}: it belongs to the dataset {self.path}; name another file")

    def read_parts(
        self, n_casts: int, draw: Callable[[int], Array], *, set_aside: tuple[type[PartError], ...] = ()
    ) -> list[pa.Table | None]:
        """Return the parts of a dataset of `n_casts`, whole or only begun; None for those that are not there.

        `draw` gives the parameters of a row. Parts that fail with an error among `set_aside` are moved out of the way.

        Raises
        ------
        InputError
            If a part is not what it must be.
        """
        parts = part_rows(n_casts)
        own = {self._part_path(part) for part in range(len(parts))}
        for stray in sorted(set(self._casts_path.glob("part-*.parquet")) - own):
            raise InputError(
                f"dataset {self.path}: casts/{stray.name} is there, which no dataset of {n_casts} casts has; ask for more casts, "
                "or move it away"
            )
        tables = []
        for part, rows in enumerate(parts):
            path = self._part_path(part)
            try:
                table = read_part(path, rows, draw)
            except PartError as error:
                if not isinstance(error, set_aside):
                    raise InputError(f"dataset {self.path}: casts/{path.name} {error}; {MEND_PARTS}") from None
                table = None
                aside = self._set_aside(path)
                _logger.warning("dataset %s: casts/%s %s; it is now %s", self.path, path.name, error, aside)
            tables.append(table)
        return tables

    def write_part(self, part: int, table: pa.Table) -> None:
        """Write a part. Raises `.InputError` if that fails."""
        with self._writing(self._part_path(part)) as temporary:
            write_part(temporary, table)

    def _part_path(self, part: int) -> Path:
        return self._casts_path / f"part-{part:05d}.parquet"
