"""What a part of a dataset is checked against: a file is taken only if it holds the casts that seed and rows determine."""

import json
import os
import random
import shutil
import subprocess
import sys
import threading
import time

import numpy as np
import pandas as pd
import pyarrow as pa
import pyarrow.parquet as pq
import pytest

from wam_cast.errors import InputError
from wam_cast.generation.sampling import sample_cast
from wam_cast.learning import dataset
from wam_cast.learning.dataset import CastDataset, generate_dataset
from wam_cast.scenario import Scenario
from wam_cast.storage.cast_values import LANDED
from wam_cast.storage.casts_part import SCHEMA

SCENARIO, N = Scenario(), 120


def fake_row(scenario, seed, row):
    """A row without physics."""
    cast = sample_cast(scenario, seed, row)
    values = dict.fromkeys(SCHEMA.names, 0.1 + 0.001 * row)
    own = {"cast": row, "distance": cast.distance, "speed": cast.speed, "wait": cast.wait}
    return values | own | {"status": "landed", "is_slack": True} | dict.fromkeys(LANDED, 0.3 + 0.01 * row)


@pytest.fixture(scope="module")
def made(tmp_path_factory):
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(dataset, "simulate_row", fake_row)
        return {seed: make(tmp_path_factory.mktemp(f"seed{seed}"), seed) for seed in (5, 6)}


def make(directory, seed, **options):
    from concurrent.futures import ThreadPoolExecutor

    with ThreadPoolExecutor(1) as executor:
        generate_dataset(SCENARIO, N, seed, executor=executor, directory=directory, **options)
    return directory


@pytest.fixture
def stored(made, tmp_path, monkeypatch):
    """Return a dataset of seed 5, to be spoilt."""
    monkeypatch.setattr(dataset, "simulate_row", fake_row)
    return shutil.copytree(made[5], tmp_path / "d")


def part(directory, number):
    return directory / "casts" / f"part-{number:05d}.parquet"


def change(directory, number=0, **columns):
    """Replace values of a part: column by row and value."""
    frame = pq.read_table(part(directory, number)).to_pandas()
    for name, (row, value) in columns.items():
        frame[name] = frame[name].astype(object) if isinstance(value, str) else frame[name]
        frame.loc[row, name] = value
    pq.write_table(pa.Table.from_pandas(frame, SCHEMA, preserve_index=False), part(directory, number))


def swap(directory):
    first, second = part(directory, 0), part(directory, 1)
    first.rename(directory / "kept")
    second.rename(first)
    (directory / "kept").rename(second)


def rewrite(**changes):
    """Return what changes a manifest that has no checksums, as older ones."""

    def spoil(directory):
        path = directory / "manifest.json"
        values = json.loads(path.read_text()) | changes
        del values["checksums"]
        path.write_text(json.dumps(values))

    return spoil


def twice(directory):
    table = pq.read_table(part(directory, 2))
    pq.write_table(pa.concat_tables([table.slice(0, 19), table.slice(0, 1)]), part(directory, 2))


def bomb(directory):
    columns = {field.name: pa.nulls(2_000_000, field.type) for field in SCHEMA}
    pq.write_table(pa.table(columns), part(directory, 0))


def long_lists(directory):
    table = pq.read_table(part(directory, 0))
    lists = pa.array([np.zeros(100_000, dtype=int)] * len(table))
    pq.write_table(table.append_column("mine", lists), part(directory, 0), row_group_size=1, compression="zstd")


WRONG = {
    "parts swapped": (swap, r"part-00000.parquet column cast: is 50, where 0 belongs"),
    "a part copied over another": (
        lambda d: shutil.copy(part(d, 0), part(d, 1)),
        "part-00001.parquet column cast: is 0",
    ),
    "a manifest with another seed": (rewrite(seed=7), "column distance: is .* where the seed draws"),
    "a manifest with fewer casts": (rewrite(n_casts=70), r"part-00002.parquet is there, which no dataset of 70"),
    "a manifest with a few casts less": (rewrite(n_casts=110), "holds 20 rows, of at most 10"),
    "absurdly many casts": (rewrite(n_casts=10**9), "n_casts: input should be less than"),
    "more casts than any integer": (rewrite(n_casts=10**30), "n_casts: input should be"),
    "a parameter that is nan": (lambda d: change(d, speed=(3, np.nan)), "column speed: 1 values are missing"),
    "another parameter": (lambda d: change(d, speed=(3, 0.5)), "column speed: is 0.5 for cast 3"),
    "a landing that is nan": (
        lambda d: change(d, landing_along=(3, np.nan)),
        "column landing_along: is nan for cast 3",
    ),
    "a landing that is infinite": (
        lambda d: change(d, landing_along=(3, np.inf)),
        "column landing_along: is inf for cast 3",
    ),
    "a landing beyond any arm": (
        lambda d: change(d, landing_along=(3, 1e300)),
        r"column landing_along: is 1e\+300 for cast 3; it must be a number from -10000 to 10000",
    ),
    "a negative utilization": (
        lambda d: change(d, peak_torque_utilization=(3, -5.0)),
        r"column peak_torque_utilization: is -5.0 for cast 3; it must be a number from 0 to 1e\+06",
    ),
    "a landing without a utilization": (
        lambda d: change(d, peak_torque_utilization=(3, np.nan)),
        "column peak_torque_utilization: is nan for cast 3; it must be a number .*, of a cast that landed",
    ),
    "a landing of a simulation that diverged": (
        lambda d: change(d, status=(3, "diverged")),
        "column landing_along: is .* for cast 3; it must be nan, of a cast that did not land",
    ),
    "half a landing of a cast that met a limit": (
        lambda d: change(d, status=(3, "limit_hit"), slack=(3, np.nan)),
        "column slack: is nan for cast 3",
    ),
    "a column of others that unpacks to gigabytes": (long_lists, "unpacks to more than 16000000 bytes"),
    "an unknown status": (lambda d: change(d, status=(3, "fell")), "column status: holds 'fell', where one of landed"),
    "a row twice": (twice, "column cast: is 100, where 119 belongs"),
    "a part that unpacks to millions of rows": (bomb, "holds 2000000 rows, of at most 50"),
}


@pytest.mark.parametrize("name", WRONG)
def test_what_is_wrong_is_named_and_never_taken_nor_overwritten(stored, name):
    spoil, message = WRONG[name]
    spoil(stored)
    before = part(stored, 0).read_bytes(), part(stored, 1).read_bytes()
    uses = [lambda: CastDataset.load(stored)]
    if "manifest with" not in name:  # else what is generated then is another dataset
        uses.append(lambda: make(stored, 5))
    for use in uses:
        with pytest.raises(InputError, match=message) as error:
            use()
        assert "\n" not in str(error.value)
    assert (part(stored, 0).read_bytes(), part(stored, 1).read_bytes()) == before


def test_a_part_of_another_seed_is_not_taken(stored, made):
    shutil.copy(part(made[6], 1), part(stored, 1))
    with pytest.raises(
        InputError, match=r"part-00001.parquet column distance: is .* for cast 50, where the seed draws"
    ):
        CastDataset.load(stored)


def test_by_force_it_is_simulated_anew_and_what_was_there_is_kept(stored, made):
    change(stored, speed=(3, 0.5))
    spoilt = part(stored, 0).read_bytes()
    make(stored, 5, force=True)
    assert part(stored, 0).read_bytes() == part(made[5], 0).read_bytes()
    assert (stored / "set_aside" / "part-00000.parquet").read_bytes() == spoilt
    change(stored, speed=(3, 0.5))
    make(stored, 5, force=True)
    assert {path.name for path in (stored / "set_aside").iterdir()} == {"part-00000.parquet", "part-00000-1.parquet"}


@pytest.mark.slow
def test_no_flipped_bit_is_taken(stored):
    # Whatever is not noticed has not changed a value: some bytes of a footer mean nothing to a reader.
    whole, expected = part(stored, 0).read_bytes(), CastDataset.load(stored).frame
    rng, n_noticed = random.Random(0), 0
    for _ in range(120):
        flipped = bytearray(whole)
        flipped[rng.randrange(len(flipped))] ^= 1 << rng.randrange(8)
        part(stored, 0).write_bytes(flipped)
        try:
            found = CastDataset.load(stored).frame
        except InputError:
            n_noticed += 1
        else:
            pd.testing.assert_frame_equal(found, expected)
    assert n_noticed > 60


@pytest.mark.skipif(not hasattr(os, "mkfifo"), reason="this system has no named pipes")
@pytest.mark.parametrize("name", ["casts/part-00001.parquet", "manifest.json"])
def test_a_pipe_is_not_waited_for(stored, name):
    (stored / name).unlink()
    os.mkfifo(stored / name)
    with pytest.raises(InputError, match="not a regular file"):
        CastDataset.load(stored)


@pytest.mark.parametrize("text", ["motion: {ratreat_duration: 2.5}", "ball: {mass: 0.04}", "\0"])
def test_a_scenario_that_is_not_that_of_the_casts_is_written_anew(stored, text):
    expected = CastDataset.load(stored).frame
    (stored / "scenario.yaml").write_text(text)
    make(stored, 5)
    pd.testing.assert_frame_equal(CastDataset.load(stored).frame, expected)
    assert (stored / "set_aside" / "scenario.yaml").read_text() == text


def test_a_byte_order_mark_is_no_reason_to_refuse(stored):
    manifest = stored / "manifest.json"
    manifest.write_bytes(b"\xef\xbb\xbf" + manifest.read_bytes())
    assert len(CastDataset.load(stored)) == N


@pytest.mark.parametrize(
    "types",
    [{"status": pa.large_string()}, {"status": pa.dictionary(pa.int32(), pa.string())}, {"cast": pa.int32()}],
    ids=str,
)
def test_equivalent_types_are_as_good(stored, types):
    expected = CastDataset.load(stored).frame
    table = pq.read_table(part(stored, 1))
    columns = {name: table[name].cast(types.get(name, table[name].type)) for name in table.column_names}
    pq.write_table(pa.table(columns), part(stored, 1))
    pd.testing.assert_frame_equal(CastDataset.load(stored).frame, expected)


def test_columns_go_by_name_and_those_of_others_are_kept(stored):
    expected = CastDataset.load(stored).frame
    frame = pq.read_table(part(stored, 1)).to_pandas()
    frame["mine"] = np.arange(50) * 2.0
    frame[frame.columns[::-1]].to_parquet(part(stored, 1), index=False)
    found = CastDataset.load(stored).frame
    pd.testing.assert_frame_equal(found[expected.columns], expected)
    assert found.columns[-1] == "mine"
    assert found["mine"][50:100].tolist() == frame["mine"].tolist()
    assert found["mine"].isna().sum() == N - 50
    part(stored, 2).unlink()
    rewritten = part(stored, 1).read_bytes()
    make(stored, 5)
    assert part(stored, 1).read_bytes() == rewritten


@pytest.mark.parametrize(
    ("change", "message"),
    [
        (lambda table: table.drop(["speed"]), "has 0 columns speed"),
        (
            lambda table: table.append_column("mine", table["cast"]).append_column("mine", table["cast"]),
            "has 2 columns 'mine', where one of a name can be kept",
        ),
        (
            lambda table: table.set_column(2, "speed", pa.array(["fast"] * 50)),
            "column speed: is of type string, where double belongs",
        ),
    ],
    ids=["missing", "of others, twice", "of another type"],
)
def test_a_wrong_column_is_named(stored, change, message):
    pq.write_table(change(pq.read_table(part(stored, 1))), part(stored, 1))
    with pytest.raises(InputError, match=f"part-00001.parquet {message}"):
        CastDataset.load(stored)


def test_the_second_of_two_writers_is_refused_at_once(tmp_path, monkeypatch):
    at_work, go_on = threading.Event(), threading.Event()

    def slow_row(scenario, seed, row):
        at_work.set()
        go_on.wait(5)
        return fake_row(scenario, seed, row)

    monkeypatch.setattr(dataset, "simulate_row", slow_row)
    first = threading.Thread(target=make, args=(tmp_path / "d", 5))
    first.start()
    assert at_work.wait(30)
    start = time.monotonic()
    try:
        with pytest.raises(
            InputError, match="another run is at work there; wait for its end, or choose another directory"
        ):
            make(tmp_path / "d", 6)
        assert time.monotonic() - start < 4
    finally:
        go_on.set()
        first.join()
    assert CastDataset.load(tmp_path / "d").seed == 5


OPEN = """
import sys
from wam_cast.errors import InputError
from wam_cast.scenario import Scenario
from wam_cast.storage.dataset_directory import DatasetDirectory

sys.stdin.readline()
folder, seed_of_the_first, seed = sys.argv[1:]
for i in range(80):
    try:
        with DatasetDirectory(f"{folder}/{i}") as store:
            store.open(Scenario(), int(seed_of_the_first if i < 40 else seed), 10, "controller", "drake")
    except InputError as error:
        assert "another run is at work" in str(error) or "with another seed" in str(error), error
"""


@pytest.mark.slow
def test_processes_that_open_a_directory_at_once_leave_one_whole_dataset(tmp_path):
    # With different seeds in the first 40 directories, with the same in the others.
    pipes = {"stdin": subprocess.PIPE, "stderr": subprocess.PIPE}
    both = [subprocess.Popen([sys.executable, "-c", OPEN, tmp_path, first, "5"], text=True, **pipes) for first in "56"]
    for process in both:
        process.stdin.write("go\n")
        process.stdin.flush()
    for process in both:
        assert process.communicate(timeout=60) == (None, "")
        assert process.returncode == 0
    assert len(list(tmp_path.glob("*/manifest.json"))) == 80
