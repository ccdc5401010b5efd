"""What a footer says: the same as pyarrow reads, and never the end of the process."""

import io

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
import pytest
from hypothesis import given
from hypothesis import strategies as st

from wam_cast.storage.parquet_footer import read_chunks

TABLE = pa.table({"a": np.arange(30.0), "b": [["x", None], []] * 15, "c": [{"d": 1, "e": "word"}] * 30})
N_COLUMNS = 4


def written(**options):
    file = io.BytesIO()
    pq.write_table(TABLE, file, **options)
    return file.getvalue()


WHOLE = written(row_group_size=7)


@pytest.mark.parametrize(
    "options",
    [
        {"row_group_size": 1},
        {"version": "1.0", "write_statistics": False},
        {"use_dictionary": False, "data_page_version": "2.0", "store_schema": False},
        {"write_page_index": True, "compression": "zstd"},
        {"use_dictionary": ["a"], "column_encoding": {"c.e": "DELTA_BYTE_ARRAY"}},
    ],
    ids=str,
)
def test_chunks_are_those_of_pyarrow(options):
    content = written(**options)
    metadata = pq.read_metadata(io.BytesIO(content))
    found = read_chunks(io.BytesIO(content), N_COLUMNS)
    assert len(found) == metadata.num_row_groups
    for i, group in enumerate(found):
        for j, chunk in enumerate(group):
            column = metadata.row_group(i).column(j)
            assert chunk[:2] == (column.num_values, column.total_uncompressed_size)
            assert (7 in chunk.encodings) == ("DELTA_BYTE_ARRAY" in column.encodings)


def test_a_table_without_rows_has_no_values():
    file = io.BytesIO()
    pq.write_table(TABLE.slice(0, 0), file)
    assert not sum(chunk.n_values for group in read_chunks(file, N_COLUMNS) for chunk in group)


@given(place=st.integers(1, len(WHOLE)), byte=st.integers(0, 255))
def test_a_damaged_footer_is_one_error(place, byte):
    damaged = bytearray(WHOLE)
    damaged[-place] = byte
    try:
        groups = read_chunks(io.BytesIO(damaged), N_COLUMNS)
        assert all(min(chunk.n_values, chunk.n_bytes) >= 0 for group in groups for chunk in group)
    except OSError as error:
        assert "footer" in str(error) or "columns" in str(error)


@pytest.mark.parametrize(
    "footer", [b"", b"\x19" * 100_000, b"\x1c" * 100_000, b"\x48" + b"\xff" * 20, b"\x00"], ids=range(5)
)
def test_a_footer_of_nothing_is_one_error(footer):
    for content in (footer, footer + len(footer).to_bytes(4, "little") + b"PAR1"):
        with pytest.raises(OSError, match="footer"):
            read_chunks(io.BytesIO(content), N_COLUMNS)
    with pytest.raises(OSError, match="not all columns"):
        read_chunks(io.BytesIO(WHOLE), N_COLUMNS + 1)
