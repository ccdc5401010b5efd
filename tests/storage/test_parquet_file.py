"""Parquet that anybody may have written: read as pyarrow reads it, or refused before it fills the memory."""

import os
import subprocess
import sys
from pathlib import Path

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
import pytest

from wam_cast.storage.parquet_file import RefusedError, UnreadableError, read_parquet

MOST_ROWS, LARGEST = 50, 1_000_000
WORD = "x" * 100_000

KINDS = {
    "numbers": pa.array(np.arange(50.0)),
    "missing": pa.array([None, 1] * 25),
    "truths": pa.array([True, None] * 25),
    "texts": pa.array(["a", "bc"] * 25),
    "long texts": pa.array(["a", None] * 25, pa.large_string()),
    "bytes": pa.array([b"a", b"\xff"] * 25),
    "categories": pa.array(["a", "bc"] * 25).dictionary_encode(),
    "lists": pa.array([[1, 2, None], [], None, [3], [4]] * 10),
    "lists of texts": pa.array([["joint 4 speed", None], [], None, ["a"], ["b"]] * 10),
    "maps": pa.array([[("k", "v")], []] * 25, pa.map_(pa.string(), pa.string())),
    "structs": pa.array([{"a": "x", "b": [1, 2]}, None] * 25),
    "pairs": pa.array([[1.0, 2.0]] * 50, pa.list_(pa.float64(), 2)),
    "dates": pa.array(np.arange(50).astype("datetime64[D]")),
    "words of eight bytes": pa.array([b"12345678"] * 50, pa.binary(8)),
}
"""Columns of all kinds, which are read as they are."""

BOMBS = {
    "lists of zeros": pa.array([np.zeros(10_000, dtype=int)] * 50),
    "texts": pa.array([WORD] * 50),
    "long texts": pa.array([WORD] * 50, pa.large_string()),
    "bytes": pa.array([WORD.encode()] * 50),
    "bytes of one length": pa.array([bytes(100_000)] * 50, pa.binary(100_000)),
    "categories": pa.array([WORD] * 50).dictionary_encode(),
    "lists of texts": pa.array([[WORD] * 50] + [[]] * 49),
    "maps": pa.array([[("k", WORD)]] * 50, pa.map_(pa.string(), pa.string())),
    "structs": pa.array([{"a": WORD}] * 50),
}
"""Columns of which a file of a few kilobytes is megabytes."""


def written(tmp_path, column, **options):
    path = tmp_path / "table.parquet"
    pq.write_table(pa.table({"mine": column}), path, compression="zstd", write_page_checksum=True, **options)
    return path


@pytest.mark.parametrize("kind", KINDS)
def test_what_may_be_is_read_as_pyarrow_reads_it(tmp_path, kind):
    path = written(tmp_path, KINDS[kind], row_group_size=20)
    found = read_parquet(path, MOST_ROWS, LARGEST)
    assert found.equals(pq.read_table(path).replace_schema_metadata())


@pytest.mark.parametrize("kind", BOMBS)
def test_what_unpacks_to_too_much_is_never_unpacked(tmp_path, kind):
    path = written(tmp_path, BOMBS[kind])
    assert path.stat().st_size < 0.01 * BOMBS[kind].nbytes or kind == "categories"
    pool = pa.default_memory_pool()
    before, kept = pool.bytes_allocated(), []
    with pytest.raises(RefusedError, match="unpacks to more than 1000000 bytes"):
        kept.append(read_parquet(path, MOST_ROWS, LARGEST))
    assert pool.bytes_allocated() - before < LARGEST


def test_texts_stored_by_what_they_have_in_common_are_bounded(tmp_path):
    options = {"use_dictionary": False, "column_encoding": {"mine": "DELTA_BYTE_ARRAY"}}
    assert read_parquet(written(tmp_path, KINDS["texts"], **options), MOST_ROWS, LARGEST).num_rows == 50
    with pytest.raises(RefusedError, match="unpacks to more"):
        read_parquet(written(tmp_path, BOMBS["texts"], **options), MOST_ROWS, LARGEST)


def test_counts_are_checked_before_anything_is_read(tmp_path, monkeypatch):
    def read(*_args, **_options):
        raise AssertionError("was read")

    path = written(tmp_path, BOMBS["lists of zeros"], row_group_size=1)
    monkeypatch.setattr(pq.ParquetFile, "read_row_group", read)
    with pytest.raises(RefusedError, match="unpacks to more"):
        read_parquet(path, MOST_ROWS, LARGEST)
    with pytest.raises(RefusedError, match="holds 50 rows, of at most 49"):
        read_parquet(path, 49, LARGEST)
    with pytest.raises(RefusedError, match="is larger than 100 bytes"):
        read_parquet(path, MOST_ROWS, 100)
    with pytest.raises(KeyError, match="mine"):
        read_parquet(written(tmp_path, KINDS["numbers"]), MOST_ROWS, LARGEST, lambda names: {}[names[0]])


@pytest.mark.parametrize("content", [b"", b"PAR1", b"PAR1" * 100])
def test_what_is_no_parquet_is_unreadable(tmp_path, content):
    path = tmp_path / "table.parquet"
    path.write_bytes(content)
    with pytest.raises(UnreadableError, match="cannot be read"):
        read_parquet(path, MOST_ROWS, LARGEST)
    with pytest.raises(FileNotFoundError):
        read_parquet(tmp_path / "none", MOST_ROWS, LARGEST)


def test_a_text_of_no_letters_is_unreadable(tmp_path):
    wrong = pa.StringArray.from_buffers(2, pa.array([b"a", b"\xff"]).buffers()[1], pa.py_buffer(b"a\xff"))
    with pytest.raises(UnreadableError, match="cannot be read"):
        read_parquet(written(tmp_path, wrong), MOST_ROWS, LARGEST)


@pytest.mark.skipif(not hasattr(os, "mkfifo"), reason="this system has no named pipes")
def test_what_is_no_file_is_said_in_words(tmp_path):
    os.mkfifo(tmp_path / "pipe")
    for name, words in {"pipe": "not a regular file", ".": "Is a directory"}.items():
        with pytest.raises(UnreadableError) as caught:
            read_parquet(tmp_path / name, MOST_ROWS, LARGEST)
        assert str(caught.value) == f"cannot be read ({words})"


PEAK = """
import resource, sys
from pathlib import Path
import wam_cast.storage.parquet_file as file
before = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
try:
    file.read_parquet(Path(sys.argv[1]), 50, 16_000_000)
except file.RefusedError:
    print(resource.getrusage(resource.RUSAGE_SELF).ru_maxrss - before)
"""


@pytest.mark.slow
@pytest.mark.skipif(sys.platform != "linux", reason="other systems count memory in other units")
@pytest.mark.parametrize("shape", ["rows", "lists"])
def test_half_a_gigabyte_of_one_text_takes_no_more_than_the_file_says(tmp_path, shape):
    texts = pa.DictionaryArray.from_arrays(pa.array([0] * 50, pa.int32()), ["x" * 10_000_000])
    if shape == "lists":
        texts = pa.ListArray.from_arrays([*range(51)], texts)
    path = written(tmp_path, texts, store_schema=False)
    result = subprocess.run([sys.executable, "-c", PEAK, path], capture_output=True, text=True, check=True)
    assert int(result.stdout) < 100_000  # kilobytes


COUNT = """
import os, sys
from pathlib import Path
import wam_cast.storage.parquet_file as file
before = len(os.listdir("/proc/self/task"))
table = file.read_parquet(Path(sys.argv[1]), 50, 10**6)
table.to_pandas(use_threads=False)
print(len(os.listdir("/proc/self/task")) - before)
"""


@pytest.mark.slow
@pytest.mark.skipif(not Path("/proc/self/task").is_dir(), reason="this system does not list a process's threads")
def test_no_thread_is_started_that_could_outlive_a_process(tmp_path):
    path = written(tmp_path, KINDS["numbers"])
    result = subprocess.run([sys.executable, "-c", COUNT, path], capture_output=True, text=True, check=True)
    assert result.stdout.strip() == "0"
