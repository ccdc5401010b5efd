"""A campaign's directory: every cast of one robot and what was seen of it, so that a model can be made of it again.

campaign.json   what the campaign depends on, and the versions of the software that worked on it
log.parquet     a row a cast

The log is written whole, with checksums, and flushed to the disk after each cast. What is damaged is refused and left as it is.
"""

from __future__ import annotations

import json
import math
import os
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any, Literal

import numpy as np
import pyarrow as pa
from pydantic import BaseModel, ConfigDict, ValidationError

from wam_cast.cast import Cast
from wam_cast.errors import InputError, describe_validation
from wam_cast.storage.casts_part import PartError, read_table, write_part
from wam_cast.storage.manifest import current_versions
from wam_cast.storage.work_directory import ELSEWHERE, WorkDirectory, errors_of_writing
from wam_cast.text_file import read_text
from wam_cast.types import Position

Row = dict[str, Any]
"""A cast and what was seen of it, by the names of `SCHEMA`."""

SCHEMA = pa.schema(
    [
        ("number", pa.int64()),
        ("cup_x", pa.float64()),
        ("cup_y", pa.float64()),
        ("distance", pa.float64()),
        ("speed", pa.float64()),
        ("wait", pa.float64()),
        ("bearing", pa.float64()),
        ("predicted_x", pa.float64()),
        ("predicted_y", pa.float64()),
        ("predicted_std_along", pa.float64()),
        ("predicted_std_across", pa.float64()),
        ("is_feasible", pa.bool_()),
        ("reason", pa.string()),
        ("executed_distance", pa.float64()),
        ("executed_speed", pa.float64()),
        ("executed_wait", pa.float64()),
        ("landing_x", pa.float64()),
        ("landing_y", pa.float64()),
        ("landing_std", pa.float64()),
        ("miss", pa.float64()),
        ("is_caught", pa.bool_()),
        ("status", pa.string()),
        ("limits_hit", pa.list_(pa.string())),
    ]
)
"""The columns of a log; `.Campaign` says what they mean."""

EXECUTED = ("executed_distance", "executed_speed", "executed_wait")

MAY_BE_NAN = (*EXECUTED, "landing_x", "landing_y", "miss")
"""Where nobody saw the move, or the ball never came down."""

MAY_BE_MISSING = ("is_caught",)
"""Where nobody saw."""

MOST_CASTS = 10_000
"""Of a campaign."""


class _Manifest(BaseModel):
    """What is in `campaign.json`."""

    model_config = ConfigDict(frozen=True, extra="forbid")

    format: Literal[1] = 1
    settings: dict[str, Any]
    versions: tuple[dict[str, str], ...]


class CampaignDirectory(WorkDirectory):
    """A campaign's directory; `path` need not exist yet."""

    kind = "campaign"
    identity_name = "campaign.json"

    def __init__(self, path: str | Path) -> None:
        super().__init__(path)
        self.log_path = self.path / "log.parquet"

    def open(self, settings: Mapping[str, Any], cups: Sequence[Position]) -> list[Row]:
        """Begin a campaign here, or go on with the one that is here, and return its casts; within the context.

        Raises
        ------
        InputError
            If a campaign with other settings is here, its log is not what was written there, or the directory cannot be written.
        """
        try:
            wanted = json.loads(json.dumps({"cups": cups, **settings}))
        except (TypeError, ValueError) as error:
            raise InputError(f"settings: {error}; give texts, numbers, and lists and mappings of them") from None
        versions: tuple[dict[str, str], ...] = (current_versions(),)
        rows: list[Row] = []
        if self.is_begun(self.path):
            old = self._read_manifest()
            self._check_same(old.settings, wanted)
            versions = old.versions if versions[0] in old.versions else old.versions + versions
            rows = self.read_log(cups)
        manifest = _Manifest(settings=wanted, versions=versions)
        self._write(self.identity_path, f"{manifest.model_dump_json(indent=2)}\n".encode())
        return rows

    def _read_manifest(self) -> _Manifest:
        try:
            return _Manifest.model_validate_json(read_text(self.identity_path))
        except (OSError, UnicodeDecodeError, ValidationError) as error:
            what = (
                describe_validation(error) if isinstance(error, ValidationError) else getattr(error, "strerror", error)
            )
            raise InputError(f"{self.identity_path} cannot be used ({what}); restore it, or {ELSEWHERE}") from None

    def read_log(self, cups: Sequence[Position]) -> list[Row]:
        """Return the casts in the log, none if there is no log. Raises `.InputError` if it is not a log of casts for `cups`."""
        try:
            table = read_table(self.log_path, SCHEMA, MOST_CASTS)
            rows: list[Row] = [] if table is None else table.select(SCHEMA.names).to_pylist()
            for number, row in enumerate(rows, 1):
                _check_row(row, number, cups[(number - 1) % len(cups)])
        except PartError as error:
            raise InputError(f"{self.log_path} {error}; restore it, or {ELSEWHERE}") from None
        return rows

    def keep(self, rows: list[Row]) -> None:
        """Write the log. Raises `.InputError` if the system refuses; then what was there stays."""
        with self._writing(self.log_path) as temporary:
            write_part(temporary, pa.Table.from_pylist(rows, SCHEMA))
            _flush(temporary)
        with errors_of_writing(self.kind, self.path):
            _flush(self.path)


def _flush(path: Path) -> None:
    """Let what was written to a file, or the names in a folder, survive a loss of power."""
    descriptor = os.open(path, os.O_RDONLY)
    try:
        os.fsync(descriptor)
    finally:
        os.close(descriptor)


def _check_row(row: Row, number: int, cup: Position) -> None:
    """Raise `PartError` unless a row is what a campaign writes; what may be nan is so then, whatever missing is written as."""
    if row["number"] != number:
        raise PartError(f"column number: is {row['number']}, where {number} belongs")
    for field in SCHEMA:
        value, name = row[field.name], field.name
        if value is None and name in MAY_BE_NAN:
            row[name] = value = math.nan
        if value is None and name not in MAY_BE_MISSING:
            raise PartError(f"column {name}: has no value for cast {number}")
        if isinstance(value, float) and (math.isinf(value) or (math.isnan(value) and name not in MAY_BE_NAN)):
            raise PartError(f"column {name}: is {value} for cast {number}")
    try:
        Cast(row["distance"], row["speed"], row["wait"], row["bearing"])
    except InputError as error:
        raise PartError(f"holds a cast {number} that is none ({error})") from None
    if row["landing_std"] < 0:
        raise PartError(f"column landing_std: is {row['landing_std']:g} for cast {number}")
    if not np.allclose((row["cup_x"], row["cup_y"]), cup, rtol=0, atol=1e-9):
        raise PartError(f"columns cup_x, cup_y: are {row['cup_x']:g}, {row['cup_y']:g} for cast {number}, not {cup}")
