"""What a dataset says of itself is what was written, and a change is named; older datasets, without checksums, stay readable."""

import json
import random
import shlex
import shutil
from concurrent.futures import ThreadPoolExecutor

import pytest

from wam_cast.errors import InputError
from wam_cast.generation.sampling import sample_cast
from wam_cast.learning import dataset
from wam_cast.learning.dataset import CastDataset, generate_dataset
from wam_cast.scenario import Scenario
from wam_cast.storage.casts_part import SCHEMA
from wam_cast.storage.dataset_directory import DatasetDirectory


def fake_row(scenario, seed, row):
    """A row without physics."""
    cast = sample_cast(scenario, seed, row)
    own = {"cast": row, "distance": cast.distance, "speed": cast.speed, "wait": cast.wait}
    return dict.fromkeys(SCHEMA.names, 0.5) | own | {"status": "landed", "is_slack": True}


def make(directory, n_casts=3, scenario=None):
    with ThreadPoolExecutor(1) as executor:
        return generate_dataset(scenario or Scenario(), n_casts, 5, executor=executor, directory=directory)


@pytest.fixture
def stored(tmp_path, monkeypatch):
    monkeypatch.setattr(dataset, "simulate_row", fake_row)
    make(tmp_path / "d")
    return tmp_path / "d"


def rewrite(path, old, new):
    text = path.read_text()
    assert text.count(old) == 1
    path.write_text(text.replace(old, new))


def age(stored):
    """Make of a dataset what it was before there were checksums."""
    path = stored / "manifest.json"
    values = json.loads(path.read_text())
    del values["scenario"], values["checksums"]
    path.write_text(json.dumps(values, indent=2))


def held(stored):
    """Return all that is read of a dataset."""
    data = CastDataset.load(stored)
    return data.scenario, data.seed, data.controller, len(data), DatasetDirectory(stored).read_manifest().versions


@pytest.mark.parametrize("name", ["manifest.json", "scenario.yaml"])
def test_no_flipped_bit_is_taken(stored, name):
    path, expected = stored / name, held(stored)
    whole, rng = path.read_bytes(), random.Random(0)
    for _ in range(60):
        flipped = bytearray(whole)
        flipped[rng.randrange(len(flipped))] ^= 1 << rng.randrange(8)
        path.write_bytes(flipped)
        try:
            assert held(stored) == expected
        except InputError as error:
            assert str(error).isprintable()


@pytest.mark.parametrize(
    ("old", "new", "said"),
    [
        ('"wam_cast.robot.controller.CastController"', '"mine.Controller"', "controller = 'mine.Controller' does not"),
        ('"n_casts": 3', '"n_casts": 2', "n_casts = 2 does not match its checksum; restore it"),
        ('"seed": 5', '"seed": 6', "seed = 6 does not match"),
        ('"python": "', '"python": "4.', "versions = .* does not match"),
        ('"inner_radius": 0.0', '"inner_radius": 0.1', "scenario = .* does not match"),
        ('    "seed": "', '    "sead": "', "seed = 5 does not match"),
    ],
)
def test_a_changed_field_of_the_manifest_is_named(stored, old, new, said):
    rewrite(stored / "manifest.json", old, new)
    for use in (CastDataset.load, make):
        with pytest.raises(InputError, match=rf"manifest\.json was changed since it was written: {said}"):
            use(stored)


def test_the_manifest_may_be_laid_out_otherwise(stored):
    path, expected = stored / "manifest.json", held(stored)
    path.write_text(json.dumps(json.loads(path.read_text()), sort_keys=True))
    assert held(stored) == expected


def test_a_changed_value_of_the_scenario_is_named_with_the_one_before(stored):
    path = stored / "scenario.yaml"
    text = path.read_text()
    path.write_text(f"# mine\n{text}")
    assert CastDataset.load(stored).scenario == Scenario()
    rewrite(path, "inner_radius: 0.0", "inner_radius: 0.1")
    other = Scenario.from_yaml(path)
    said = rf"cup.inner_radius is {other.cup.inner_radius}, and was {Scenario().cup.inner_radius} when it was written"
    with pytest.raises(InputError, match=rf"scenario\.yaml: {said}; restore it; or name the scenario as it is now"):
        CastDataset.load(stored)
    assert CastDataset.load(stored, other).scenario == other
    make(stored)
    assert CastDataset.load(stored).scenario == Scenario()
    assert Scenario.from_yaml(stored / "set_aside" / "scenario.yaml") == other


def test_a_dataset_keeps_the_scenario_that_it_was_begun_with(stored):
    make(stored, 4, Scenario.from_dict({"cup": {"inner_radius": 0.04}}))
    assert CastDataset.load(stored).scenario == Scenario()


@pytest.mark.parametrize(
    "text",
    [
        "[" * 100_000,
        '{"a":' * 50_000,
        '{"format": 9, "n_casts": "`rm -rf`", "seed": 0}',
        '{"format": 9, "n_casts": 3, "seed": "; rm -rf"}',
        '{"format": 9, "n_casts": 1e400, "seed": true}',
    ],
    ids=["lists", "objects", "casts", "seed", "infinite"],
)
def test_a_manifest_of_anything_is_one_line_and_no_command(stored, text):
    (stored / "manifest.json").write_text(text)
    for use in (CastDataset.load, make):
        with pytest.raises(InputError, match=r"manifest\.json cannot be used") as error:
            use(stored)
        assert "wam-cast" not in str(error.value)


def test_the_command_that_finishes_a_dataset_is_quoted_for_a_shell(stored, tmp_path):
    place = stored.rename(tmp_path / "a $(b) c")
    (place / "casts" / "part-00000.parquet").unlink()
    with pytest.raises(InputError) as error:
        CastDataset.load(place)
    words = shlex.split(str(error.value).split("`")[1])
    assert words[-3:] == [f"{place}/scenario.yaml", "--out", str(place)]


def test_an_arm_that_python_names_is_found_from_anywhere(stored, tmp_path, monkeypatch):
    from wam_cast.arm.arm_model import models_directory

    shutil.copytree(models_directory(), tmp_path / "models")
    monkeypatch.chdir(tmp_path)
    make(tmp_path / "own", scenario=Scenario.from_dict({"arm": {"urdf": "models/wam7.urdf"}}))
    monkeypatch.chdir(stored)
    assert CastDataset.load(tmp_path / "own").scenario.arm.urdf == str((tmp_path / "models" / "wam7.urdf").resolve())


def test_the_arm_may_lie_elsewhere(stored, tmp_path):
    from wam_cast.arm.arm_model import models_directory

    shutil.copytree(models_directory(), tmp_path / "models")
    rewrite(stored / "scenario.yaml", "urdf: null", f"urdf: {tmp_path}/models/wam7.urdf")
    assert CastDataset.load(stored).scenario.arm.urdf == f"{tmp_path}/models/wam7.urdf"


def test_older_datasets_are_read_and_get_checksums_when_they_grow(stored):
    expected = held(stored)
    age(stored)
    assert held(stored) == expected
    make(stored, 4)
    rewrite(stored / "manifest.json", '"n_casts": 4', '"n_casts": 3')
    with pytest.raises(InputError, match="n_casts = 3 does not match its checksum"):
        CastDataset.load(stored)
