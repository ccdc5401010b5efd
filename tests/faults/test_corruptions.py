"""Damaged, exchanged and rewritten files: what is taken is what was made, else a line says why; nothing is overwritten unasked."""

import json
import random
import shutil
import sys

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
import pytest
import yaml

import wam_cast as wc
from wam_cast.errors import InputError
from wam_cast.learning import dataset

pytestmark = pytest.mark.slow


def parts(folder):
    return sorted((folder / "casts").glob("*.parquet"))


def any_file(folder, rng):
    return rng.choice([folder / "manifest.json", folder / "scenario.yaml", *parts(folder)])


def rewritten(change):
    """Return what reads a part, changes the table, and writes it as another program would."""

    def spoil(folder, rng):
        path = rng.choice(parts(folder))
        pq.write_table(change(pq.read_table(path), rng), path, compression=rng.choice(["snappy", "zstd", "none"]))

    return spoil


def flip_bits(folder, rng):
    flip_bits_in(any_file(folder, rng), rng)


def flip_bits_of_manifest(folder, rng):
    flip_bits_in(folder / "manifest.json", rng)


def flip_bits_of_scenario(folder, rng):
    flip_bits_in(folder / "scenario.yaml", rng)


def flip_bits_in(path, rng):
    content = bytearray(path.read_bytes())
    for _ in range(rng.choice([1, 1, 1, 5])):
        content[rng.randrange(len(content))] ^= 1 << rng.randrange(8)
    path.write_bytes(content)


def cut_off(folder, rng):
    path = any_file(folder, rng)
    path.write_bytes(path.read_bytes()[: rng.randrange(path.stat().st_size)])


def blank(folder, rng):
    path = any_file(folder, rng)
    content = bytearray(path.read_bytes())
    start = rng.randrange(len(content))
    length = rng.randrange(1, 600)
    content[start : start + length] = bytes(len(content[start : start + length]))
    path.write_bytes(content)


def swap(folder, rng):
    first, second = rng.sample(parts(folder), 2)
    contents = first.read_bytes(), second.read_bytes()
    second.write_bytes(contents[0])
    first.write_bytes(contents[1])


def copy(folder, rng):
    shutil.copy(*rng.sample(parts(folder), 2))


def remove(folder, rng):
    any_file(folder, rng).unlink()


def cast(table, name, kind):
    return table.set_column(table.column_names.index(name), name, table[name].cast(kind))


def other_types(table, rng):
    table = cast(
        table, "status", rng.choice([pa.large_string(), pa.string_view(), pa.dictionary(pa.int32(), pa.string())])
    )
    table = cast(table, "cast", rng.choice([pa.int16(), pa.uint64(), pa.float64()]))
    return cast(table, "is_slack", rng.choice([pa.int8(), pa.bool_()]))


def rounded(table, rng):
    return cast(table, rng.choice(["distance", "speed", "wait"]), pa.float32())


def other_order(table, rng):
    return table.select(rng.sample(table.column_names, len(table.column_names)))


def own_column(table, rng):
    return table.add_column(rng.randrange(5), "mine", pa.array([rng.random() for _ in range(table.num_rows)]))


def less_columns(table, rng):
    return table.drop([rng.choice(table.column_names)])


def shuffled(table, rng):
    return table.take(rng.sample(range(table.num_rows), table.num_rows))


def less_rows(table, rng):
    first = rng.randrange(table.num_rows)
    return table.slice(first, rng.randrange(table.num_rows - first))


def twice(table, rng):
    return pa.concat_tables([table, table.slice(rng.randrange(table.num_rows), 1)])


def absurd(table, rng):
    name = rng.choice(["distance", "wait", "landing_along", "entry_angle", "peak_tracking_error"])
    values = table[name].to_numpy().copy()
    values[rng.randrange(len(values))] = rng.choice([np.nan, np.inf, -np.inf] if name[0] != "p" else [np.inf, -np.inf])
    return table.set_column(table.column_names.index(name), name, pa.array(values))


def edit_scenario(folder, rng):
    path = folder / "scenario.yaml"
    values = yaml.safe_load(path.read_text())
    values["cup"][rng.choice(["inner_radius", "restitution"])] *= 1.01
    path.write_text(yaml.safe_dump(values))


def edit_manifest(folder, rng):
    path = folder / "manifest.json"
    values = json.loads(path.read_text())
    name = rng.choice(["fingerprint", "controller", "seed", "n_casts", "versions"])
    values[name] = values[name] * 2
    path.write_text(json.dumps(values))


FILES = (
    flip_bits,
    flip_bits_of_manifest,
    flip_bits_of_scenario,
    edit_scenario,
    edit_manifest,
    cut_off,
    blank,
    swap,
    copy,
    remove,
)
TABLES = (other_types, rounded, other_order, own_column, less_columns, shuffled, less_rows, twice, absurd)
HARMLESS = (other_types, other_order, own_column)
"""What other programs do to a table when they write it again."""


@pytest.fixture
def grow(monkeypatch, inline_executor):
    """Return a function that goes on with a dataset, in this process."""
    monkeypatch.syspath_prepend(__file__.rpartition("/")[0])
    import closed_forms

    monkeypatch.setattr(closed_forms, "SECONDS", 0)
    monkeypatch.setattr(dataset, "simulate_row", closed_forms.row)
    yield lambda folder, **options: wc.generate_dataset(
        wc.Scenario(), 120, 5, executor=inline_executor, directory=folder, **options
    )
    del sys.modules["closed_forms"]


def test_nothing_wrong_is_taken_and_nothing_readable_overwritten(made, grow, fault, n_faults, tmp_path):
    expected = wc.CastDataset.load(made)
    rng = random.Random(0)
    kinds = [(kind.__name__, kind) for kind in FILES] + [(kind.__name__, rewritten(kind)) for kind in TABLES]
    for number in range(n_faults):
        name, spoil = kinds[number % len(kinds)] if n_faults >= len(kinds) else rng.choice(kinds)
        with fault(f"corruption: {name}"):
            folder = shutil.copytree(made, tmp_path / str(number))
            spoil(folder, rng)
            before = {path.name: path.read_bytes() for path in parts(folder)}

            is_taken = works(expected, wc.CastDataset.load, folder)
            assert is_taken or name not in [kind.__name__ for kind in HARMLESS]
            assert {path.name: path.read_bytes() for path in parts(folder)} == before

            goes_on = works(expected, grow, folder)
            works(expected, grow, folder, force=True)
            aside = [path.read_bytes() for path in folder.glob("set_aside/*")]
            for path, content in before.items():
                assert content in aside or is_kept(content, folder / "casts" / path)
            if goes_on:
                assert works(expected, wc.CastDataset.load, folder)


def works(expected, use, folder, **options):
    """Return whether it gives what was made; if not, it must say why in a line."""
    try:
        data = use(folder, **options)
    except InputError as error:
        assert str(error).isprintable()
        assert len(str(error)) < 1000
        return False
    assert data.frame[expected.frame.columns].equals(expected.frame)
    assert (data.scenario, data.seed, data.controller) == (expected.scenario, expected.seed, expected.controller)
    return True


def is_kept(content, path):
    """Return whether a part still is what it was, or the beginning of it."""
    now = path.read_bytes()
    if now == content:
        return True
    old = pq.read_table(pa.BufferReader(content))
    return pq.read_table(path).slice(0, old.num_rows).equals(old)
