"""The casts of a dataset are one table for other readers, by one path, at any time."""

import pandas as pd
import polars as pl
import pyarrow.dataset as ds
import pytest

from wam_cast.learning.reference import reference_dataset
from wam_cast.storage import dataset_directory
from wam_cast.storage.dataset_directory import DatasetDirectory

READERS = {
    "pandas": pd.read_parquet,
    "polars": lambda path: pl.read_parquet(path).to_pandas(),
    "pyarrow": lambda path: ds.dataset(path).to_table().to_pandas(),
}


@pytest.fixture
def stored(tmp_path):
    """Return a directory with the first 120 casts of the reference dataset, in parts."""
    frame = reference_dataset().frame.head(120)
    directory = DatasetDirectory(tmp_path)
    (tmp_path / "casts").mkdir()
    for name in ("manifest.json", "scenario.yaml", ".lock"):
        (tmp_path / name).write_text("{}")
    for part, rows in enumerate(dataset_directory.part_rows(120)):
        directory.write_part(part, dataset_directory.pa.Table.from_pandas(frame.iloc[rows.start : rows.stop]))
    return directory, frame


@pytest.mark.parametrize("read", READERS.values(), ids=READERS)
def test_the_folder_of_casts_is_one_table_in_order(stored, read):
    directory, frame = stored
    found = read(directory.path / "casts")
    pd.testing.assert_frame_equal(found[list(frame)].astype(frame.dtypes), frame)


@pytest.mark.parametrize("read", READERS.values(), ids=READERS)
def test_it_is_so_while_a_part_is_written_and_after_that_was_killed(stored, monkeypatch, read):
    directory, _ = stored
    seen = []

    def half(path, table):
        path.write_bytes(b"half a part")
        seen.append(len(read(directory.path / "casts")))
        raise KeyboardInterrupt

    monkeypatch.setattr(dataset_directory, "write_part", half)
    monkeypatch.setattr("pathlib.Path.unlink", lambda *_, **__: None)  # a kill leaves the temporary file where it is
    with pytest.raises(KeyboardInterrupt):
        directory.write_part(3, None)
    assert any(path.name.endswith(".tmp") for path in directory.path.iterdir())
    assert [*seen, len(read(directory.path / "casts"))] == [120, 120]
