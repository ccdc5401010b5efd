"""A part of a dataset: a Parquet file of casts, read only if it holds what seed and row say that it must."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq

from wam_cast.cast import PARAMETERS
from wam_cast.errors import quoted
from wam_cast.storage.cast_values import RANGES, STATUSES, first_wrong
from wam_cast.storage.parquet_file import RefusedError, UnreadableError, read_parquet
from wam_cast.types import Array

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
        ("peak_torque_utilization", pa.float64()),
        ("peak_velocity_utilization", pa.float64()),
        ("peak_tracking_error", pa.float64()),
    ]
)
"""The columns of a dataset; `.CastDataset` says what they mean."""

NEVER_MISSING = ("cast", *PARAMETERS, "status", "is_slack")

LARGEST_PART = 16_000_000
"""Bytes that a part may unpack to, whatever columns others have added."""


class PartError(ValueError):
    """A part that cannot be taken; the line says what is wrong with it."""


class UnreadablePartError(PartError):
    """It is no Parquet, is cut off, or fails its checksums."""


def read_part(path: Path, rows: range, draw: Callable[[int], Array]) -> pa.Table | None:
    """Return the casts in a file, the first of `rows` or all of them; None if there is no file.

    The columns of `SCHEMA` come first, columns that are not ours follow. `draw` gives the parameters of a row [m, m/s, s], (3,).
    Raises `PartError`, as `read_table` does.
    """
    table = read_table(path, SCHEMA, len(rows))
    if table is not None:
        _check_values(table)
        _check_casts(table, rows, draw)
    return table


def read_table(path: Path, schema: pa.Schema, most_rows: int) -> pa.Table | None:
    """Return what is in a file; None if there is no file.

    The columns of `schema` come first, whatever their order and equivalent type in the file; other columns follow.

    Raises
    ------
    UnreadablePartError
        If it is no Parquet file, or one that was damaged.
    PartError
        If it can be read, but has not these columns, or more rows or bytes than it may have.
    """
    try:
        table = read_parquet(path, most_rows, LARGEST_PART)
    except FileNotFoundError:
        return None
    except UnreadableError as error:
        raise UnreadablePartError(str(error)) from None
    except RefusedError as error:
        raise PartError(str(error)) from None
    return _conform(table, schema)


def write_part(path: Path, table: pa.Table) -> None:
    """Write casts with checksums, by which damage is noticed."""
    with path.open("wb") as file:  # pyarrow itself takes no paths that are no UTF-8
        pq.write_table(table, file, write_page_checksum=True)


def concatenated(tables: list[pa.Table]) -> pa.Table:
    """Return the rows of all tables; where one lacks a column that is not ours, its rows have no value there."""
    return pa.concat_tables(tables, promote_options="permissive")


def _conform(table: pa.Table, schema: pa.Schema) -> pa.Table:
    """Return the table with the columns of `schema` first, each of its type."""
    columns: dict[str, pa.ChunkedArray] = {}
    counts = Counter(table.column_names)
    for field in schema:
        if counts[field.name] != 1:
            raise PartError(f"has {counts[field.name]} columns {field.name}, where one belongs")
        column = table[field.name]
        try:
            columns[field.name] = column.cast(field.type)
        except pa.ArrowException:
            raise PartError(f"column {field.name}: is of type {column.type}, where {field.type} belongs") from None
    others = [name for name in counts if name not in columns]
    for name in others:
        if counts[name] > 1:
            raise PartError(f"has {counts[name]} columns {quoted(name)}, where one of a name can be kept")
    return pa.table(columns | {name: table[name] for name in others})


def _check_values(table: pa.Table) -> None:
    for name in NEVER_MISSING:
        if table[name].null_count:
            raise PartError(f"column {name}: {table[name].null_count} values are missing")
    unknown = set(table["status"].to_pylist()) - set(STATUSES)
    if unknown:
        raise PartError(f"column status: holds {min(unknown)[:40]!r}, where one of {', '.join(STATUSES)} belongs")
    # Missing numbers, as pandas writes them, become nan.
    numbers = {name: table[name].to_numpy() for name in RANGES}
    wrong = first_wrong(numbers, np.array(table["status"].to_pylist(), dtype=object))
    if wrong is not None:
        value, cast = numbers[wrong.column][wrong.row], table["cast"][wrong.row]
        raise PartError(f"column {wrong.column}: is {value} for cast {cast}; it must be {wrong.rule}")


def _check_casts(table: pa.Table, rows: range, draw: Callable[[int], Array]) -> None:
    """Check that these are the casts that seed and rows determine."""
    numbers = table["cast"].to_numpy()
    expected = np.array(rows[: len(numbers)], dtype=np.int64)
    if not np.array_equal(numbers, expected):
        row = int(np.argmax(numbers != expected))
        raise PartError(f"column cast: is {numbers[row]}, where {expected[row]} belongs")
    drawn = np.array([draw(int(row)) for row in expected]).reshape(-1, len(PARAMETERS))
    for name, values in zip(PARAMETERS, drawn.T, strict=True):
        wrong = ~np.isclose(table[name].to_numpy(), values, rtol=1e-9, atol=0)
        if wrong.any():
            row = int(np.argmax(wrong))
            raise PartError(
                f"column {name}: is {table[name][row]} for cast {expected[row]}, where the seed draws {values[row]}"
            )
