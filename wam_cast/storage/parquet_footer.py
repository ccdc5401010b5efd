"""What a Parquet file says that it holds, chunk by chunk.

By hand, since pyarrow ends the whole process where it is asked for the chunks of some damaged footers. A footer is a struct of
Thrift's compact protocol (`apache/thrift`, `doc/specs/thrift-compact-protocol.md`), its fields are numbered in
`apache/parquet-format`, `src/main/thrift/parquet.thrift`.
"""

from __future__ import annotations

import io
from typing import Any, BinaryIO, NamedTuple

MAGIC, LARGEST_FOOTER = b"PAR1", 4_000_000

ROW_GROUPS, COLUMNS, META_DATA, ENCODINGS, N_VALUES, N_BYTES = 4, 1, 3, 2, 5, 6
"""Numbers of fields: of a file, of a group of rows, of a column's chunk, and three of its metadata."""


class Chunk(NamedTuple):
    """A column within a group of rows."""

    n_values: int
    """Rows, or what their lists hold."""
    n_bytes: int
    """Of its pages, before they were compressed."""
    encodings: list[int]


def read_chunks(file: BinaryIO, n_columns: int) -> list[list[Chunk]]:
    """Return the chunks of each group of rows, one a column. Raises `OSError` if that is no Parquet, or damaged."""
    size = file.seek(0, io.SEEK_END)
    file.seek(max(0, size - 8))
    tail = file.read(8)
    length = int.from_bytes(tail[:4], "little")
    if tail[4:] != MAGIC or length > min(size - 8, LARGEST_FOOTER):
        raise OSError("it has no Parquet footer, or one that is too large")
    file.seek(size - 8 - length)
    try:
        groups = _Compact(file.read(length)).struct()[ROW_GROUPS]
        chunks = [[_chunk(column[META_DATA]) for column in group[COLUMNS]] for group in groups]
    except (LookupError, TypeError, ValueError, RecursionError):
        raise OSError("its Parquet footer is damaged") from None
    if any(len(group) != n_columns for group in chunks):
        raise OSError("a group of its rows has not all columns")
    return chunks


def _chunk(fields: dict[int, Any]) -> Chunk:
    n_values, n_bytes = fields[N_VALUES], fields[N_BYTES]
    if min(n_values, n_bytes) < 0:
        raise ValueError
    return Chunk(n_values, n_bytes, list(fields[ENCODINGS]))


class _Compact:
    """Reads values one after the other; raises `LookupError` beyond the end and for what is none."""

    def __init__(self, content: bytes) -> None:
        self._content, self._place = content, 0

    def struct(self) -> dict[int, Any]:
        """Return the fields of a struct by their numbers."""
        fields: dict[int, Any] = {}
        number = 0
        while (header := self._byte()) != 0:
            number = number + (header >> 4) if header >> 4 else self._integer()
            kind = header & 15
            fields[number] = kind == 1 if kind in (1, 2) else self._value(kind)
        return fields

    def _value(self, kind: int) -> Any:
        """Return a value of a kind: 1 and 2 truths, 3 a byte, 4 to 6 integers, 7 a float, 8 bytes, 9 and 10 lists, 12 a struct."""
        if kind in (1, 2, 3):
            return self._byte()
        if kind in (4, 5, 6):
            return self._integer()
        if kind == 7:
            return self._bytes(8)
        if kind == 8:
            return self._bytes(self._varint())
        if kind in (9, 10):
            header = self._byte()
            n = self._varint() if header >> 4 == 15 else header >> 4
            return [self._value(header & 15) for _ in range(n)]
        if kind == 12:
            return self.struct()
        raise LookupError  # no footer has maps

    def _byte(self) -> int:
        self._place += 1
        return self._content[self._place - 1]

    def _bytes(self, n: int) -> bytes:
        self._place += n
        if self._place > len(self._content):
            raise LookupError
        return self._content[self._place - n : self._place]

    def _varint(self) -> int:
        value = shift = 0
        while True:
            byte = self._byte()
            value |= (byte & 127) << shift
            shift += 7
            if byte < 128:
                return value
            if shift > 63:
                raise LookupError

    def _integer(self) -> int:
        value = self._varint()
        return (value >> 1) ^ -(value & 1)
