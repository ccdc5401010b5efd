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

import pyarrow as pa
from pydantic import BaseModel, ConfigDict, ValidationError

from wam_cast.adaptation.robot import LARGEST_STD
from wam_cast.cast import LARGEST, LONGEST_CAST, PARAMETERS
from wam_cast.errors import InputError, describe_validation, quoted
from wam_cast.scenario import Bounds
from wam_cast.storage.casts_part import PartError, concatenated, read_table, write_part
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

FARTHEST = 1000.0
"""At which a landing is believed or observed, and the largest standard deviation of what is believed [m]."""

LEAST = 1e-6
"""Distance and speed of a move [m], [m/s]."""

LONGEST_TEXT = 1000
"""Letters of a status, a reason or the name of a limit."""

SAME, ROUNDING = 1e-9, 1e-6
"""By how much the cup may differ from the campaign's, and `miss` from the landing's distance [m]."""

MISSED = ("short", "long", "side", "rim_bounce", "came_out", "never_crossed")
"""Statuses of a ball that does not lie in the cup; robots of your own may have others."""


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
        self._read = SCHEMA.empty_table()

    def open(self, settings: Mapping[str, Any], cups: Sequence[Position], bounds: Bounds) -> list[Row]:
        """Begin a campaign here, or go on with the one that is here, and return its casts; within the context.

        Casts are planned for `cups` in turn, within `bounds`.

        Raises
        ------
        InputError
            If a campaign with other settings is here, its log is not what was written there, or the directory cannot be written.
        """
        try:
            wanted = json.loads(json.dumps({"cups": cups, **settings}))
        except (TypeError, ValueError) as error:
            raise InputError(f"settings: {error}; give texts, numbers, and lists and mappings of them") from None
        self._cups, self._ranges = cups, _ranges(bounds)
        versions: tuple[dict[str, str], ...] = (current_versions(),)
        rows: list[Row] = []
        if self.is_begun(self.path):
            old = self._read_manifest()
            self._check_same(old.settings, wanted)
            versions = old.versions if versions[0] in old.versions else old.versions + versions
            rows = self._read_log()
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

    def _read_log(self) -> list[Row]:
        """Return the casts in the log, none if there is no log. Raises `.InputError` if it is not a log of this campaign."""
        try:
            table = read_table(self.log_path, SCHEMA, MOST_CASTS)
            self._read = self._read if table is None else table
            rows: list[Row] = self._read.select(SCHEMA.names).to_pylist()
            for number, row in enumerate(rows, 1):
                self._check(number, row)
        except PartError as error:
            raise InputError(f"{self.log_path}: {error}; restore it, or {ELSEWHERE}") from None
        return rows

    def keep(self, rows: list[Row]) -> None:
        """Write the log: the rows that were read as they were, with the columns that are not ours, and the new ones.

        Raises `.InputError` if the last row could not be read again, or the system refuses; then what was there stays.
        """
        try:
            if len(rows) > len(self._read):
                self._check(len(rows), rows[-1])
        except PartError as error:
            raise InputError(f"{self.log_path}: {error}; see what the robot answers") from None
        new = pa.Table.from_pylist(rows[len(self._read) :], SCHEMA)
        with self._writing(self.log_path) as temporary:
            write_part(temporary, concatenated([self._read, new]))
            _flush(temporary)
        with errors_of_writing(self.kind, self.path):
            _flush(self.path)

    def _check(self, number: int, row: Row) -> None:
        _check_row(row, number, self._cups[(number - 1) % len(self._cups)], self._ranges)


def _flush(path: Path) -> None:
    """Let what was written to a file, or the names in a folder, survive a loss of power."""
    descriptor = os.open(path, os.O_RDONLY)
    try:
        os.fsync(descriptor)
    finally:
        os.close(descriptor)


def _ranges(bounds: Bounds) -> dict[str, tuple[float, float]]:
    """Return the least and the largest value of each number of a row.

    A cast that was made may be far from one that was asked for, but not without limit: ten times what the bounds allow, or 10 m,
    10 m/s and 10 s, if that is more.
    """
    largest = {name: max(10.0, 10.0 * upper) for name, (_, upper) in bounds}
    return {
        "distance": (LEAST, largest["distance"]),
        "speed": (LEAST, largest["speed"]),
        "wait": (0.0, largest["wait"]),
        "bearing": (-LARGEST["bearing"], LARGEST["bearing"]),
        **dict.fromkeys(("predicted_x", "predicted_y", "landing_x", "landing_y"), (-FARTHEST, FARTHEST)),
        **dict.fromkeys(("predicted_std_along", "predicted_std_across"), (0.0, FARTHEST)),
        "landing_std": (0.0, LARGEST_STD),
        "executed_distance": (LEAST, LARGEST["distance"]),
        "executed_speed": (LEAST, LARGEST["speed"]),
        "executed_wait": (0.0, LONGEST_CAST),
    }


def _check_row(row: Row, number: int, cup: Position, ranges: Mapping[str, tuple[float, float]]) -> None:
    """Raise `PartError` unless a row is what a campaign writes; what may be nan is so then, whatever missing is written as."""

    def require(is_so: bool, name: str, wanted: str) -> None:
        if not is_so:
            raise PartError(f"column {name} of cast {number} is {quoted(row[name])}, where {wanted} belongs")

    require(row["number"] == number, "number", str(number))
    for name in SCHEMA.names:
        if row[name] is None and name in MAY_BE_NAN:
            row[name] = math.nan
        require(row[name] is not None or name in MAY_BE_MISSING, name, "a value")
    for name, value in zip(("cup_x", "cup_y"), cup, strict=True):
        require(abs(row[name] - value) <= SAME, name, f"{value:g}, as in the command,")
    for name, (least, largest) in ranges.items():
        is_unseen = name in MAY_BE_NAN and math.isnan(row[name])
        require(is_unseen or least <= row[name] <= largest, name, f"a number from {least:g} to {largest:g}")
    for name in EXECUTED:
        is_seen = not math.isnan(row[EXECUTED[0]])
        require(
            math.isnan(row[name]) is not is_seen, name, "a number" if is_seen else "nan, as in the others of the move,"
        )
    for names in (PARAMETERS, EXECUTED):
        distance, speed, wait = (row[name] for name in names)
        require(
            not distance / speed + wait > LONGEST_CAST,
            names[1],
            f"one by which the cast takes {LONGEST_CAST:g} s at most",
        )
    miss = math.dist((row["landing_x"], row["landing_y"]), cup)
    is_right = abs(row["miss"] - miss) <= ROUNDING or (math.isnan(miss) and math.isnan(row["miss"]))
    require(is_right, "miss", f"the distance from landing to cup, {miss:.6g},")
    for name in ("status", "reason"):
        require(_is_text(row[name]) and (row[name] or name != "status"), name, "a word of letters that can be printed")
    require(all(map(_is_text, row["limits_hit"])), "limits_hit", "a list of limits, such as ['joint 4 speed'],")
    if row["status"] == "caught" or row["status"] in MISSED:
        is_caught = row["status"] == "caught"
        require(row["is_caught"] in (None, is_caught), "is_caught", f"{is_caught}, as its status {row['status']} says,")


def _is_text(value: str | None) -> bool:
    return value is not None and len(value) <= LONGEST_TEXT and value.isprintable()
