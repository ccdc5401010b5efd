"""Datasets and models of which something was replaced: what is taken is what was made, and else one line says why not."""

import io
import json
import shutil
import zipfile

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra import numpy as stn

from wam_cast.cast import PARAMETERS
from wam_cast.errors import InputError
from wam_cast.generation.sampling import sample_cast, sample_casts
from wam_cast.learning import dataset
from wam_cast.learning.dataset import CastDataset, generate_dataset
from wam_cast.learning.forward_model import ForwardModel
from wam_cast.scenario import Scenario
from wam_cast.storage.casts_part import SCHEMA

pytestmark = pytest.mark.usefixtures("little_memory")

SCENARIO = Scenario()
NUMBERS = st.floats() | st.integers() | st.sampled_from([0, 1, -1, 1e308, 10**18, 10**40])
JSON = st.recursive(
    st.none() | st.booleans() | NUMBERS | st.text(max_size=20),
    lambda inner: st.lists(inner, max_size=8) | st.dictionaries(st.text(max_size=9), inner, max_size=4),
    max_leaves=10,
)
COLUMNS = st.one_of(
    st.lists(values, min_size=50, max_size=50)
    for values in (
        st.floats(),
        st.integers(0, 60),
        st.sampled_from(["landed", "diverged", "other"]),
        st.none() | st.booleans(),
        st.dates(),
        st.lists(st.integers(0, 9), max_size=2),
    )
)
ARRAYS = stn.arrays(
    st.sampled_from(["f8", "f4", "i8", "?", "U3", "c16"]),
    stn.array_shapes(min_dims=0, max_dims=3, min_side=0, max_side=9),
)


def row(scenario, seed, number):
    """Return a cast without physics."""
    cast = sample_cast(scenario, seed, number)
    landing = {"landing_along": 0.2 + cast.distance + 0.4 * cast.speed * np.cos(3 * cast.wait), "landing_across": 0.0}
    own = {name: getattr(cast, name) for name in PARAMETERS} | landing
    return dict.fromkeys(SCHEMA.names, 0.1) | own | {"cast": number, "status": "landed", "is_slack": True}


@pytest.fixture(scope="module")
def made(tmp_path_factory):
    """Return a folder that holds a dataset and a model of it, where copies may be spoilt."""
    from concurrent.futures import ThreadPoolExecutor

    folder = tmp_path_factory.mktemp("made")
    with pytest.MonkeyPatch.context() as patch, ThreadPoolExecutor(1) as executor:
        patch.setattr(dataset, "simulate_row", row)
        data = generate_dataset(SCENARIO, 120, 0, executor=executor, directory=folder / "casts")
    ForwardModel.fit(data).save(folder / "whole.model")
    return folder


@st.composite
def overwritten(draw, content):
    """Return bytes of which some are written over, left out, or are more."""
    start = draw(st.integers(0, len(content)))
    end = min(len(content), start + draw(st.integers(0, 40)))
    return content[:start] + draw(st.binary(max_size=40)) + content[end:]


def replaced(values, draw, depth=0):
    """Return a value of JSON in which something is another value."""
    if depth == 3 or not isinstance(values, (dict, list)) or not values or draw(st.integers(0, 4)) == 4:
        return draw(JSON)
    keys = sorted(values) if isinstance(values, dict) else range(len(values))
    key = draw(st.sampled_from(keys))
    changed = values.copy()
    changed[key] = replaced(values[key], draw, depth + 1)
    return changed


@pytest.fixture(scope="module")
def expected(made):
    return CastDataset.load(made / "casts").frame


def copied(made):
    """Return a copy of the dataset, in the place of the one before."""
    shutil.rmtree(made / "copy", ignore_errors=True)
    return shutil.copytree(made / "casts", made / "copy")


@given(data=st.data())
def test_a_dataset_with_other_bytes_is_what_it_was_or_refused(made, expected, answered, data):
    copy = copied(made)
    name = data.draw(st.sampled_from(["manifest.json", "scenario.yaml", "casts/part-00001.parquet"]))
    (copy / name).write_bytes(data.draw(overwritten((copy / name).read_bytes())))
    with answered():
        assert CastDataset.load(copy).frame.equals(expected)


@given(data=st.data())
def test_a_manifest_with_other_values_is_as_good_or_refused(made, expected, answered, data):
    copy = copied(made)
    values = json.loads((copy / "manifest.json").read_text())
    (copy / "manifest.json").write_text(json.dumps(replaced(values, data.draw)))
    with answered():
        assert CastDataset.load(copy).frame.equals(expected)


@given(name=st.sampled_from(SCHEMA.names), values=COLUMNS)
def test_a_column_with_other_values_is_such_a_column_or_refused(made, expected, answered, name, values):
    copy = copied(made)
    path = copy / "casts" / "part-00001.parquet"
    table = pq.read_table(path)
    pq.write_table(table.set_column(table.column_names.index(name), name, pa.array(values)), path)
    with answered():
        frame = CastDataset.load(copy).frame
        assert frame.dtypes.equals(expected.dtypes)
        assert frame[["cast", *PARAMETERS]].notna().all().all()
        assert np.isfinite(frame.loc[frame["status"] == "landed", "landing_along"]).all()


def predicts(path, answered):
    with answered():
        model = ForwardModel.load(path)
        assert np.isfinite(model.predict(sample_casts(model.scenario, 5, seed=1))).all()
        assert model.reach[0] <= model.reach[1]


@given(data=st.data())
def test_a_model_with_other_bytes_is_what_it_was_or_refused(made, answered, data):
    path = made / "copy.model"
    path.write_bytes(data.draw(overwritten((made / "whole.model").read_bytes())))
    casts = sample_casts(SCENARIO, 5, seed=1)
    with answered():
        predicted = ForwardModel.load(path).predict(casts)
        np.testing.assert_array_equal(predicted, ForwardModel.load(made / "whole.model").predict(casts))


@given(data=st.data())
def test_a_model_with_another_header_predicts_or_is_refused(made, answered, data):
    with np.load(made / "whole.model") as file:
        arrays = dict(file)
    header = replaced(json.loads(str(arrays["header"])), data.draw)
    np.savez(made / "copy.npz", **arrays | {"header": np.array(json.dumps(header))})
    predicts(made / "copy.npz", answered)


@given(data=st.data())
def test_a_model_with_another_array_predicts_or_is_refused(made, answered, data):
    with np.load(made / "whole.model") as file:
        arrays = dict(file)
    name = data.draw(st.sampled_from(sorted(arrays)))
    array, values = arrays[name].copy(), data.draw(ARRAYS)
    if array.ndim and data.draw(st.booleans()):
        array = array.astype(float)
        array[data.draw(st.integers(0, len(array) - 1))] = data.draw(st.floats())
        values = array
    np.savez(made / "copy.npz", **arrays | {name: values})
    predicts(made / "copy.npz", answered)


@given(st.integers(0, 2**25) | st.sampled_from([2**44, 2**62]), st.sampled_from(["<f8", "<U9", "|O", "<i8"]))
def test_what_unpacks_to_much_is_not_unpacked(made, answered, n, kind):
    # The header of an array promises more than follows.
    header = io.BytesIO()
    np.lib.format.write_array_header_1_0(header, {"descr": kind, "fortran_order": False, "shape": (n,)})
    with zipfile.ZipFile(made / "whole.model") as whole, zipfile.ZipFile(made / "copy.model", "w") as copy:
        for name in whole.namelist():
            copy.writestr(name, header.getvalue() if name == "training_casts.npy" else whole.read(name))
    predicts(made / "copy.model", answered)


def changed(made, part, name, value):
    """Write the model with one number of its header, or one array, replaced, and return the file."""
    with np.load(made / "whole.model") as file:
        arrays = dict(file)
    header = json.loads(str(arrays["header"]))
    if part is None:
        arrays[name] = np.full_like(arrays[name], value)
    else:
        header[part][name] = value
    np.savez(made / "copy.npz", **arrays | {"header": np.array(json.dumps(header))})
    return made / "copy.npz"


@pytest.mark.parametrize(
    ("part", "name", "value"),
    [
        ("uncertainty", "scale", 1e300),
        ("uncertainty", "scale", 1e-300),
        ("uncertainty", "scale", float("nan")),
        ("uncertainty", "regularization", 0),
        ("uncertainty", "sigma", [1e-300, 1, 1]),
        ("info", "sigma", [1, 1, 1e300]),
        ("info", "regularization", 1e308),
        ("info", "seed", -3),
        ("info", "test_rmse", -5),
        ("info", "test_rmse", 1e300),
        ("info", "validation_rmse", 1e300),
        ("info", "n_landmarks", 100_000),
        (None, "training_log_ratios", -1e6),
        (None, "training_log_ratios", 1e6),
    ],
)
def test_a_number_that_no_fit_gives_is_refused_by_its_name(made, part, name, value):
    with pytest.raises(InputError, match=name) as error:
        ForwardModel.load(changed(made, part, name, value))
    assert len(str(error.value)) < 600


@pytest.mark.parametrize(
    ("part", "name", "value"),
    [
        ("info", "test_rmse", float("nan")),
        ("info", "sigma", [1e-6] * 3),
        ("uncertainty", "sigma", [1e-6] * 3),
        ("uncertainty", "scale", 1e9),
        ("uncertainty", "scale", 1e-9),
        ("uncertainty", "regularization", 1e-12),
        ("uncertainty", "regularization", 1e6),
        (None, "training_log_ratios", -50),
        (None, "training_log_ratios", 50),
    ],
)
@pytest.mark.filterwarnings("error")
def test_at_the_end_of_each_range_the_standard_deviation_is_a_positive_number_with_a_slope(made, part, name, value):
    check_std(ForwardModel.load(changed(made, part, name, value)))


@pytest.mark.filterwarnings("error")
def test_without_a_regularization_so_it_is(made):
    data = CastDataset.load(made / "casts")
    ForwardModel.from_hyperparameters(data, sigma=0.1, regularization=0).save(made / "copy.model")
    check_std(ForwardModel.load(made / "copy.model"))


def check_std(model):
    """Check the standard deviations of a few training casts and others."""
    uncertainty = model.uncertainty
    casts = np.vstack([model.training_casts[:3], sample_casts(SCENARIO, 3, seed=1)])
    std = uncertainty.std(casts)
    assert np.all((std > 0) & np.isfinite(std))
    for cast, expected in zip(casts, std, strict=True):
        found, slope = uncertainty.linearize(cast)
        assert found == pytest.approx(expected, rel=1e-4)
        assert np.all(np.isfinite(slope))


def test_a_model_that_no_file_may_hold_is_not_kept(made):
    data = CastDataset.load(made / "casts")
    model = ForwardModel.from_hyperparameters(data, sigma=1e8, regularization=1e-3)
    with pytest.raises(InputError, match=r"info\.sigma.*fit it with other hyperparameters"):
        model.save(made / "other.model")
    assert not (made / "other.model").exists()


@pytest.mark.parametrize("shape", ["(" * 5000, "-" * 9000, "0x", "(1, "])
def test_the_header_of_an_array_that_no_parser_takes_is_refused(made, shape):
    text = f"{{'descr': '<f8', 'fortran_order': False, 'shape': {shape}".encode() + b"\n"
    with zipfile.ZipFile(made / "whole.model") as whole, zipfile.ZipFile(made / "copy.model", "w") as copy:
        for name in whole.namelist():
            spoilt = b"\x93NUMPY\x01\x00" + len(text).to_bytes(2, "little") + text
            copy.writestr(name, spoilt if name == "training_casts.npy" else whole.read(name))
    with pytest.raises(InputError, match="not a model file, or a damaged one"):
        ForwardModel.load(made / "copy.model")
