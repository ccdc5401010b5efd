"""Tables of recorded casts: what is written is read, and what can be of no robot is refused in one line."""

import re
from decimal import Decimal

import numpy as np
import pandas as pd
import pyarrow as pa
import pyarrow.parquet as pq
import pytest

import wam_cast as wc
from wam_cast.errors import InputError
from wam_cast.exchange import cast_table
from wam_cast.exchange.cast_table import COLUMNS


@pytest.fixture
def table():
    """Return a plausible table of ten samples at 100 Hz."""
    rng = np.random.default_rng(0)
    columns = {"time": 0.01 * np.arange(10)} | {name: rng.uniform(-1, 1, 10) for name in COLUMNS[1:]}
    return pd.DataFrame(columns)


def stored(table, tmp_path, suffix=".csv"):
    path = tmp_path / f"cast{suffix}"
    table.to_csv(path, index=False) if suffix == ".csv" else table.to_parquet(path)
    return path


@pytest.mark.parametrize("suffix", [".csv", ".parquet"])
def test_a_simulated_cast_is_read_back_bit_for_bit(recording, tmp_path, suffix):
    path = tmp_path / f"cast{suffix}"
    wc.write_recording(recording, path)
    found, n_q = wc.read_recording(path), recording.states.shape[1] // 2
    np.testing.assert_array_equal(found.times, recording.times)
    np.testing.assert_array_equal(found.q, recording.states[:, :7])
    np.testing.assert_array_equal(found.v, recording.states[:, n_q : n_q + 7])
    np.testing.assert_array_equal(found.torques, recording.torques)
    np.testing.assert_array_equal(found.p_WL, recording.p_WL)


def test_columns_may_come_in_any_order_and_some_be_left_out(table, tmp_path):
    shown = table[["ball_z", "q7", "q6", "time", *(f"q{i}" for i in range(1, 6)), "ball_x", "ball_y"]].copy()
    shown.loc[3:6, ["ball_x", "ball_y", "ball_z"]] = np.nan  # a slow camera
    found = wc.read_recording(stored(shown, tmp_path))
    np.testing.assert_array_equal(found.q, table[[f"q{i}" for i in range(1, 8)]])
    assert np.isnan(found.v).all()
    assert np.isnan(found.torques).all()
    assert np.isfinite(found.p_WL).all(axis=1).tolist() == [True] * 3 + [False] * 4 + [True] * 3
    assert found.shifted(0.5).times[0] == found.times[0] + 0.5


@pytest.mark.parametrize("seconds", [np.nan, -np.inf, "a", None])
def test_a_clock_is_shifted_by_a_finite_time(table, tmp_path, seconds):
    with pytest.raises(InputError, match=re.escape(f"seconds = {seconds!r} must be a finite number")):
        wc.read_recording(stored(table, tmp_path)).shifted(seconds)


@pytest.mark.parametrize("suffix", [".csv", ".parquet"])
@pytest.mark.parametrize(
    ("changes", "line"),
    [
        ({"time": pd.date_range("2026-01-02", periods=10, freq="D")}, "time, row 1: '2026-01-02"),
        ({"time": pd.timedelta_range("1s", periods=10, freq="s")}, "time, row 1: '0 days 00:00:01"),
        ({"q2": True}, "q2, row 1: 'True'"),
        ({"ball_x": [None, *9 * [False]]}, "ball_x, row 2: 'False'"),
    ],
)
def test_dates_and_truths_are_no_numbers(table, tmp_path, suffix, changes, line):
    with pytest.raises(InputError, match=rf"column {line}.*finite number"):
        wc.read_recording(stored(table.assign(**changes), tmp_path, suffix))


def test_numbers_of_any_kind_are_read(table, tmp_path):
    whole = table.assign(**{f"q{i}": np.arange(10) - 5 for i in range(1, 6)})
    kinds = whole.assign(
        q1=whole.q1.astype("float32"),
        q2=whole.q2.map(Decimal),
        q3=whole.q3.astype("Int8"),
        q4=whole.q4.map(str),
        q5=whole.q5.astype("category"),
    )
    found = wc.read_recording(stored(kinds, tmp_path, ".parquet"))
    np.testing.assert_array_equal(found.q, whole[[f"q{i}" for i in range(1, 8)]])


def in_degrees(table):
    return table.assign(q4=155.0)


@pytest.mark.parametrize(
    ("spoil", "line"),
    [
        (lambda t: t.drop(columns="q3"), "column q3 is missing"),
        (lambda t: t.drop(columns="v3"), "column v3 is missing"),
        (lambda t: t.drop(columns="time"), "column time is missing"),
        (lambda t: t.rename(columns={"ball_x": "ball_X"}), "column 'ball_X' is unknown; allowed are time, q1 to q7"),
        (in_degrees, "column q4, row 1: 155 rad, of at most 7 rad; are these degrees?"),
        (lambda t: t.assign(v2=100.0), "column v2, row 1: 100 rad/s"),
        (lambda t: t.assign(torque1=-2000.0), "column torque1, row 1: -2000 N m"),
        (lambda t: t.assign(ball_z=120.0), "are these millimetres?"),
        (lambda t: t.assign(time=1e3 * t.time), "steps of 10 s; it is in seconds, are these milliseconds?"),
        (
            lambda t: t.assign(time=t.time.where(t.index != 5, 0.0)),
            "column time, row 6: 0 s after 0.04 s; it must rise",
        ),
        (lambda t: t.assign(time=0.1), "it must rise from row to row"),
        (
            lambda t: t.assign(q1=t.q1.astype(object).where(t.index != 2, "x")),
            "column q1, row 3: 'x' is no finite number",
        ),
        (lambda t: t.assign(q1=t.q1.where(t.index != 2)), "column q1, row 3: is empty"),
        (lambda t: t.assign(ball_x=np.inf), "column ball_x, row 1: 'inf' is no finite number"),
        (lambda t: t.iloc[:1], "1 rows; a cast has two or more"),
        (lambda t: t.iloc[:0], "0 rows"),
    ],
)
def test_what_no_robot_recorded_is_one_line(table, tmp_path, spoil, line):
    path = stored(spoil(table), tmp_path)
    with pytest.raises(InputError) as caught:
        wc.read_recording(path)
    assert line in str(caught.value)
    assert str(caught.value).startswith(f"recording {path}: ")
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize("name", ["missing.csv", "folder.csv", "empty.csv", "binary.csv", "text.parquet", "cast.txt"])
def test_what_is_no_table_is_one_line(tmp_path, name):
    (tmp_path / "folder.csv").mkdir()
    (tmp_path / "empty.csv").write_text("")
    (tmp_path / "binary.csv").write_bytes(bytes(range(256)))
    (tmp_path / "text.parquet").write_text("time,q1\n")
    with pytest.raises(InputError, match=r"recording .*: ") as caught:
        wc.read_recording(tmp_path / name)
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize(
    "metadata",
    [
        '{"index_columns": ["nope"], "columns": []}',
        "{}",
        "[1]",
        '{"index_columns": [], "columns": [{"name": "q1", "field_name": "q1", "numpy_type": "nonsense"}]}',
        "[" * 100_000,
        "\0",
    ],
    ids=range(6),
)
def test_what_pandas_noted_in_a_file_does_not_count(table, tmp_path, metadata):
    path = tmp_path / "cast.parquet"
    columns = pa.Table.from_pandas(table, preserve_index=False)
    pq.write_table(columns.replace_schema_metadata({"pandas": metadata}), path)
    np.testing.assert_array_equal(wc.read_recording(path).q, table[[f"q{i}" for i in range(1, 8)]])


@pytest.mark.parametrize(
    "indexed",
    [lambda t: t.set_axis(np.arange(10) ** 2), lambda t: t.set_index("time"), lambda t: t.set_index(["q1", "time"])],
    ids=["chosen rows", "by time", "by two"],
)
def test_an_index_is_a_column_if_it_has_a_name(table, tmp_path, indexed):
    found = wc.read_recording(stored(indexed(table), tmp_path, ".parquet"))
    np.testing.assert_array_equal(found.times, table["time"])
    np.testing.assert_array_equal(found.q, table[[f"q{i}" for i in range(1, 8)]])


def zeros(path, names, n):
    column = pa.array(np.zeros(n))
    pq.write_table(pa.table(dict.fromkeys(names, column)), path, compression="zstd")


LISTS = [np.zeros(1_000_000, dtype=int)] * 2 + [[]] * 8


def test_a_file_that_unpacks_to_more_than_a_cast_is_not_unpacked(table, tmp_path, monkeypatch):
    path, wide = tmp_path / "long.parquet", tmp_path / "wide.parquet"
    zeros(path, ("time", "q1"), 2_000_000)
    pq.write_table(pa.table({"time": table["time"]} | {f"q{i}": LISTS for i in range(1, 8)}), wide, compression="zstd")
    lines = tmp_path / "long.csv"
    lines.write_bytes(b"time\n" + b"0\n" * 1_000_000)
    columns = tmp_path / "wide.csv"
    columns.write_bytes(b"q1," * 1_000_000 + b"time\n")
    monkeypatch.setattr(cast_table, "LARGEST_TABLE", 10_000_000)
    for file, words in {
        path: "holds 2000000 rows, of at most 500000",
        wide: "unpacks to more than 10000000 bytes",
        lines: "holds 1000001 lines, of at most 500001",
        columns: "holds 1000001 columns, of at most 25",
    }.items():
        with pytest.raises(InputError) as caught:
            wc.read_recording(file)
        assert str(caught.value) == f"recording {file}: {words}; choose the rows and columns of one cast"


def test_what_is_no_column_is_said_before_anything_is_read(tmp_path, monkeypatch):
    path = tmp_path / "cast.parquet"
    zeros(path, ("time", "mine"), 10)
    monkeypatch.setattr(pq.ParquetFile, "read_row_group", None)
    with pytest.raises(InputError, match="column 'mine' is unknown"):
        wc.read_recording(path)


def test_a_table_is_written_whole_or_not_at_all(recording, tmp_path):
    with pytest.raises(InputError, match=r"\.csv or \.parquet"):
        wc.write_recording(recording, tmp_path / "cast.xlsx")
    with pytest.raises(InputError, match="cannot write"):
        wc.write_recording(recording, tmp_path / "nowhere" / "cast.csv")
    assert not list(tmp_path.iterdir())
