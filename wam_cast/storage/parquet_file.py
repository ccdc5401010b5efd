"""Parquet files that anybody may have written: read only if what they unpack to is no more than it may be.

A file of some kilobytes can unpack to many gigabytes: a value that is repeated, in rows, in lists or in a dictionary, takes no room
in it. All counts are known before anything is unpacked, and texts stay in their dictionaries until their length is known.
"""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import pyarrow as pa
import pyarrow.compute as pc
import pyarrow.parquet as pq

from wam_cast.storage.parquet_footer import Chunk, read_chunks
from wam_cast.text_file import check_regular

LEAST_WIDTH = 8
"""Bytes that a value takes, unpacked, or less."""

TEXT = "BYTE_ARRAY"
"""What Parquet calls texts and bytes of any length."""

FRONT_CODED = 7
"""DELTA_BYTE_ARRAY: texts that are stored without what they begin with in common: each may be as long as all of them together."""


class RefusedError(ValueError):
    """It holds more rows or unpacks to more than it may, or is packed in a way that is not read here; the line says what."""


class UnreadableError(ValueError):
    """It is no Parquet, is cut off, or fails its checksums; the line says why."""


def read_parquet(
    path: Path, most_rows: int, largest: int, check_columns: Callable[[list[str]], None] = lambda _names: None
) -> pa.Table:
    """Return what is in a file of at most `most_rows` that unpacks to `largest` bytes at most.

    In one thread: pools of threads take longer to start than a small file to read, and may outlive a process that ends. What
    pandas adds to say what an index was is left out.

    Parameters
    ----------
    path, most_rows, largest
        Where the file is, and what it may hold.
    check_columns
        Is called with the names of the columns before any is read, to raise what it likes.

    Raises
    ------
    FileNotFoundError
        If there is no file.
    UnreadableError
        If it is no Parquet file, or one that was damaged.
    RefusedError
        If it holds more than it may, or columns that pyarrow does not read.
    """
    try:
        check_regular(path)
        _check_size(path, largest)
        with path.open("rb") as content, pq.ParquetFile(content, pre_buffer=False) as file:
            check_columns(file.schema_arrow.names)
            groups = read_chunks(content, len(file.schema))
            packed = _packed_texts(file.schema, groups)
            _check_counts(file, groups, packed, most_rows, largest)
            texts = [file.schema.column(i).path for i in packed]
            options = {"metadata": file.metadata, "pre_buffer": False, "page_checksum_verification": True}
            with pq.ParquetFile(content, read_dictionary=texts, **options) as in_dictionaries:
                return _read_groups(in_dictionaries, file.schema_arrow, largest)
    except FileNotFoundError:
        raise
    except pa.ArrowNotImplementedError as error:
        raise RefusedError(f"holds columns that are not read here ({_shortened(error)})") from None
    except (OSError, UnicodeError, pa.ArrowException) as error:
        raise UnreadableError(f"cannot be read ({_shortened(getattr(error, 'strerror', None) or error)})") from None


def _shortened(reason: object) -> str:
    return " ".join(str(reason).split())[:200]


def _read_groups(file: pq.ParquetFile, schema: pa.Schema, largest: int) -> pa.Table:
    """Return all rows, each column of its type in `schema`: each group of rows has dictionaries of its own."""
    tables, size = [pa.table([pa.array([], of) for of in schema.types], names=schema.names)], 0
    for i in range(file.metadata.num_row_groups):
        group = file.read_row_group(i, use_threads=False)
        size += sum(_unpacked_size(chunk) for column in group.columns for chunk in column.chunks)
        if size > largest:
            raise RefusedError(f"unpacks to more than {largest} bytes")
        columns = [column.cast(of) for column, of in zip(group.columns, schema.types, strict=True)]
        tables.append(pa.table(columns, names=schema.names))
    table = pa.concat_tables(tables)
    table.validate(full=True)  # texts of no letters too
    return table


def _packed_texts(schema: pq.ParquetSchema, groups: list[list[Chunk]]) -> set[int]:
    """Return which columns hold texts or bytes that may stay in their dictionaries until their length is known."""
    texts = {i for i in range(len(schema)) if schema.column(i).physical_type == TEXT}
    return {i for i in texts if not any(FRONT_CODED in group[i].encodings for group in groups)}


def _check_size(path: Path, largest: int) -> None:
    if path.stat().st_size > largest:
        raise RefusedError(f"is larger than {largest} bytes")


def _check_counts(
    file: pq.ParquetFile, groups: list[list[Chunk]], packed: set[int], most_rows: int, largest: int
) -> None:
    """Raise `RefusedError` if the file says that it holds more than it may; texts in dictionaries are not counted yet."""
    if file.metadata.num_rows > most_rows:
        raise RefusedError(f"holds {file.metadata.num_rows} rows, of at most {most_rows}")
    columns = [file.schema.column(i) for i in range(len(file.schema))]
    widths = [max(LEAST_WIDTH, column.length) for column in columns]
    alone = {i for i, column in enumerate(columns) if column.physical_type == TEXT} - packed
    size = 0
    for group in groups:
        for i, chunk in enumerate(group):
            size += chunk.n_bytes + chunk.n_values * (chunk.n_bytes if i in alone else widths[i])
    if size > 2 * largest:  # packed and unpacked
        raise RefusedError(f"unpacks to more than {largest} bytes")


def _unpacked_size(array: pa.Array) -> int:
    """Return how many bytes an array takes once its texts stand outside of their dictionaries, each as often as it occurs."""
    if pa.types.is_dictionary(array.type):
        if not _has_length(array.dictionary.type):
            return int(array.nbytes)
        lengths = pc.binary_length(array.dictionary).cast(pa.int64())
        return int(array.nbytes) + (pc.sum(lengths.take(array.indices)).as_py() or 0)
    if pa.types.is_map(array.type):
        return _unpacked_size(array.keys) + _unpacked_size(array.items)
    if pa.types.is_struct(array.type):
        return sum(_unpacked_size(field) for field in array.flatten())
    if pa.types.is_list(array.type) or pa.types.is_large_list(array.type) or pa.types.is_fixed_size_list(array.type):
        return LEAST_WIDTH * len(array) + _unpacked_size(array.values)
    return int(array.nbytes)


def _has_length(of: pa.DataType) -> bool:
    kinds = (pa.types.is_string, pa.types.is_large_string, pa.types.is_binary, pa.types.is_large_binary)
    return any(is_one(of) for is_one in kinds)
