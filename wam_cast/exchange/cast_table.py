"""Casts as tables: what a real robot recorded read in, and what was simulated written out in the same columns.

A table is a CSV file with one line of column names, or a Parquet file, a row a sample, of at most 500,000:

- `time` [s]: from the start of the turn toward the cup, or of the cast where there is none; it rises from row to row
- `q1` to `q7` [rad]: joint angles
- `v1` to `v7` [rad/s]: joint velocities; may be left out
- `torque1` to `torque7` [N m]: of the motors; may be left out
- `ball_x`, `ball_y`, `ball_z` [m]: p_WL of the ball's centre in the world frame; may be left out, and empty in rows without a sight
  of the ball

Signs and zeros of the joints are those of the arm's model file.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from pathlib import Path
from typing import NamedTuple

import numpy as np
import pandas as pd
import pyarrow as pa
from pandas.api.types import is_bool_dtype, is_numeric_dtype
from pyarrow import csv

from wam_cast.errors import InputError, is_finite, quoted
from wam_cast.robot.plant import N_ARM
from wam_cast.simulation.recording import CastRecording
from wam_cast.storage.atomic import write_file
from wam_cast.storage.parquet_file import RefusedError, UnreadableError, read_parquet
from wam_cast.text_file import read_bytes
from wam_cast.types import Array, checks_types

SUFFIXES = (".csv", ".parquet")

MOST_SAMPLES = 500_000
"""Of a cast: more than of five minutes at 1 kHz."""

LARGEST_TABLE = 256_000_000
"""Bytes that a file may have, and unpack to."""

INDEX = "__index_level_"
"""What the column of an index begins with to which pandas gave no name."""

LONGEST_STEP = 0.2
"""Between two samples at the median [s]; a clock in milliseconds has longer ones."""


class Group(NamedTuple):
    """Columns that are there together.

    Attributes
    ----------
    columns
        Their names.
    unit, largest
        Of their values: no robot's is larger.
    suspicion
        What a larger one is a sign of.
    """

    columns: tuple[str, ...]
    unit: str
    largest: float
    suspicion: str


def _of_joints(name: str) -> tuple[str, ...]:
    return tuple(f"{name}{i}" for i in range(1, N_ARM + 1))


GROUPS = {
    "q": Group(_of_joints("q"), "rad", 7.0, "degrees"),
    "v": Group(_of_joints("v"), "rad/s", 60.0, "degrees a second"),
    "torques": Group(_of_joints("torque"), "N m", 500.0, "millinewtonmetres"),
    "p_WL": Group(("ball_x", "ball_y", "ball_z"), "m", 10.0, "millimetres"),
}
"""By the names of `MeasuredCast`."""

COLUMNS = ("time", *(column for group in GROUPS.values() for column in group.columns))


@dataclass(frozen=True, eq=False)
class MeasuredCast:
    """A cast as it was recorded on a robot.

    Attributes
    ----------
    times
        [s], shape (n,), rising.
    q, v, torques
        Joint angles [rad], velocities [rad/s] and motor torques [N m], shape (n, 7) each; nan if they were not recorded.
    p_WL
        The ball's centre in the world frame [m], shape (n, 3); nan where it was not seen.
    """

    times: Array
    q: Array
    v: Array
    torques: Array
    p_WL: Array

    def shifted(self, seconds: float) -> MeasuredCast:
        """Return the same cast with `seconds` added to its times, for a clock that did not start with the cast.

        Raises `.InputError` if that is no finite number.
        """
        if not is_finite(seconds):
            raise InputError(f"seconds = {quoted(seconds)} must be a finite number, of seconds to add to the times")
        return replace(self, times=self.times + seconds)


@checks_types
def read_recording(path: str | Path) -> MeasuredCast:
    """Read a cast that was recorded on a robot from a table; see this module for its columns.

    Raises
    ------
    InputError
        If there is no such file, it holds more than a cast does, a column is missing or unknown, a value is no number or can be of
        no robot in its unit, or time does not rise.
    """
    path = Path(path)
    _check_suffix(path)
    try:
        return _measured(_read(path))
    except InputError as error:
        raise InputError(f"recording {path}: {error}") from None


@checks_types
def write_recording(recording: CastRecording, path: str | Path) -> None:
    """Write a simulated cast as such a table, CSV or Parquet by the suffix of `path`; what was there before is replaced.

    Raises
    ------
    InputError
        If the suffix is another one, or the file cannot be written; then nothing is.
    """
    path, n_q = Path(path), recording.states.shape[1] // 2
    _check_suffix(path)
    values = {
        "q": recording.states[:, :N_ARM],
        "v": recording.states[:, n_q : n_q + N_ARM],
        "torques": recording.torques,
        "p_WL": recording.p_WL,
    }
    columns = {"time": recording.times}
    for name, group in GROUPS.items():
        columns |= dict(zip(group.columns, values[name].T, strict=True))
    frame = pd.DataFrame(columns)
    write_file(
        path, frame.to_csv(index=False).encode() if path.suffix.lower() == ".csv" else frame.to_parquet(index=False)
    )


def _check_suffix(path: Path) -> None:
    if path.suffix.lower() not in SUFFIXES:
        raise InputError(f"recording {path}: a table is {' or '.join(SUFFIXES)}; choose a name that ends so")


def _read(path: Path) -> pd.DataFrame:
    try:
        return _read_csv(path) if path.suffix.lower() == ".csv" else _read_parquet(path)
    except InputError:
        raise
    except RefusedError as error:
        raise InputError(f"{error}; choose the rows and columns of one cast") from None
    except UnreadableError as error:
        raise InputError(str(error)) from None
    except (OSError, ValueError, OverflowError, pa.ArrowException) as error:
        reason = getattr(error, "strerror", None) or error
        raise InputError(f"cannot be read ({' '.join(str(reason).split())[:200]})") from None


def _read_parquet(path: Path) -> pd.DataFrame:
    table = read_parquet(path, MOST_SAMPLES, LARGEST_TABLE, _check_columns)
    samples = table.select([i for i, name in enumerate(table.column_names) if not name.startswith(INDEX)])
    frame: pd.DataFrame = samples.to_pandas(use_threads=False)
    return frame


def _read_csv(path: Path) -> pd.DataFrame:
    content = read_bytes(path, LARGEST_TABLE)
    n_lines = max(content.count(b"\n"), content.count(b"\r"))
    if n_lines > MOST_SAMPLES + 1:
        raise RefusedError(f"holds {n_lines} lines, of at most {MOST_SAMPLES + 1}")
    n_columns = content.partition(b"\n")[0].count(b",") + 1
    if n_columns > 2 * len(COLUMNS):
        raise RefusedError(f"holds {n_columns} columns, of at most {len(COLUMNS)}")
    # pandas parses floats exactly in some versions alone
    table = csv.read_csv(pa.BufferReader(content), csv.ReadOptions(use_threads=False))
    frame: pd.DataFrame = table.to_pandas(use_threads=False)
    frame = frame.rename(columns=str.strip)
    _check_columns(list(frame.columns))
    return frame


def _check_columns(names: list[str]) -> None:
    unknown = [name for name in names if name not in COLUMNS and not name.startswith(INDEX)]
    if unknown:
        raise InputError(
            f"column {quoted(unknown[0])} is unknown; allowed are time, q1 to q7, v1 to v7, torque1 to torque7, ball_x, ball_y "
            "and ball_z"
        )


def _measured(frame: pd.DataFrame) -> MeasuredCast:
    if not frame.columns.is_unique:
        raise InputError(f"column {frame.columns[frame.columns.duplicated()][0]} is there twice")
    times = _numbers(frame, ("time",), may_miss=False)[:, 0]
    values = {
        name: _numbers(frame, group.columns, may_miss=name == "p_WL")
        if name == "q" or not set(group.columns).isdisjoint(frame.columns)
        else np.full((len(times), len(group.columns)), np.nan)
        for name, group in GROUPS.items()
    }
    _check_times(times)
    for name, group in GROUPS.items():
        _check_unit(group, values[name])
    return MeasuredCast(times, **values)


def _numbers(frame: pd.DataFrame, columns: tuple[str, ...], *, may_miss: bool) -> Array:
    """Return columns as numbers, shape (n, k)."""
    numbers = np.empty((len(frame), len(columns)))
    for i, name in enumerate(columns):
        if name not in frame.columns:
            raise InputError(f"column {name} is missing")
        given = frame[name]
        if not is_numeric_dtype(given) or is_bool_dtype(given):
            # Truths and dates would become numbers, their words do not.
            given = given.astype(object).map(str, na_action="ignore")
        column = pd.to_numeric(given, errors="coerce").to_numpy(dtype=float, na_value=np.nan)
        is_wrong = np.isinf(column) | (np.isnan(column) & ~(given.isna().to_numpy() & may_miss))
        if is_wrong.any():
            row = int(np.argmax(is_wrong))
            value = given.iloc[row]
            found = "is empty" if pd.isna(value) else f"{quoted(str(value))} is no finite number"
            raise InputError(f"column {name}, row {row + 1}: {found}")
        numbers[:, i] = column
    return numbers


def _check_times(times: Array) -> None:
    if len(times) < 2:
        raise InputError(f"{len(times)} rows; a cast has two or more")
    steps = np.diff(times)
    if not np.all(steps > 0):
        row = int(np.argmax(~(steps > 0)))
        raise InputError(
            f"column time, row {row + 2}: {times[row + 1]:g} s after {times[row]:g} s; it must rise from row to row"
        )
    if np.median(steps) > LONGEST_STEP:
        raise InputError(f"column time: steps of {np.median(steps):g} s; it is in seconds, are these milliseconds?")


def _check_unit(group: Group, values: Array) -> None:
    too_large = np.abs(values) > group.largest  # nan is not
    if too_large.any():
        row, i = (int(index) for index in np.argwhere(too_large)[0])
        raise InputError(
            f"column {group.columns[i]}, row {row + 1}: {values[row, i]:g} {group.unit}, of at most {group.largest:g} "
            f"{group.unit}; are these {group.suspicion}?"
        )
