"""The forward model: what it learns from, what it predicts, and its file."""

import io
import json
import math
import os
import re
import tracemalloc
import zipfile
from dataclasses import replace

import numpy as np
import pandas as pd
import pytest

from wam_cast.arm.arm_model import models_directory
from wam_cast.cast import PARAMETERS, cast_bounds
from wam_cast.errors import InputError
from wam_cast.generation.sampling import sample_casts
from wam_cast.learning.dataset import CastDataset
from wam_cast.learning.forward_model import ForwardModel
from wam_cast.learning.hyperparameters import tune_by_lbfgs
from wam_cast.learning.kernel_ridge import KernelRidge
from wam_cast.learning.losses import LeaveOneOutLoss
from wam_cast.learning.parts import Parts
from wam_cast.parallel.threads import one_thread
from wam_cast.planning.prediction import OUTPUTS
from wam_cast.scenario import Ball, Cup, Noise, Scenario

SCENARIO = Scenario()
N_CASTS = 340  # split into 260, 60 and 20
N_FEW = 102  # split into 78, 18 and 6


def closed_form(casts):
    """Return the outputs of casts of shape (n, 3), shape (n, 7): smooth, without physics."""
    distance, speed, wait = casts.T
    along = 0.2 + distance + 0.4 * speed * np.cos(3 * wait)
    others = [1.5 + 0.2 * wait, 0.02 + 0.1 * distance * wait, 0.3 + 0.1 * speed, 0.5 + 0.2 * distance]
    return np.column_stack([along, 0.01 * speed * wait, 0.5 * speed**2, *others])


def synthetic(n_casts=N_CASTS, scenario=SCENARIO, seed=0):
    casts = sample_casts(scenario, n_casts, seed)
    frame = pd.DataFrame(casts, columns=list(PARAMETERS))
    frame[list(OUTPUTS)] = closed_form(casts)
    return CastDataset(scenario, seed, frame.assign(status="landed", is_slack=True))


def changed(data, rows, **columns):
    frame = data.frame.copy()
    for name, value in columns.items():
        frame.loc[rows, name] = value
    return CastDataset(data.scenario, data.seed, frame)


def predictions(model):
    return model.predict(sample_casts(SCENARIO, 30, seed=99))


def refused(*path_and_scenario):
    with pytest.raises(InputError) as caught:
        ForwardModel.load(*path_and_scenario)
    line = str(caught.value)
    assert "\n" not in line
    assert str(path_and_scenario[0]) in line
    return line


@pytest.fixture(scope="module")
def data():
    return synthetic()


@pytest.fixture(scope="module")
def model(data):
    return ForwardModel.fit(data)


@pytest.fixture(scope="module")
def few():
    """Return casts for what does not take many to show: a fit of all of them takes six times as long."""
    return synthetic(N_FEW)


@pytest.fixture(scope="module")
def few_model(few):
    return ForwardModel.fit(few)


# --- fitting


def test_fit_recovers_a_closed_form(model):
    casts = sample_casts(SCENARIO, 200, seed=7)
    error = np.abs(model.predict(casts) - closed_form(casts))
    assert np.quantile(error, 0.9) < 1e-4
    assert error.max() < 5e-3  # in the corners of the bounds


def test_info_says_how_the_model_was_made(model, data):
    info = model.info
    assert (info.seed, info.n_train, info.n_validation, info.n_test) == (0, 260, 60, 20)
    for rows, rmse in zip(data.split()[1:], (info.validation_rmse, info.test_rmse), strict=True):
        casts = data.frame.loc[rows, list(PARAMETERS)].to_numpy()
        residual = (model.predict(casts) - closed_form(casts))[:, 0]
        assert rmse == pytest.approx(math.sqrt(np.mean(residual**2)), rel=1e-4)
    along = model.training_outputs[:, 0]
    estimator = KernelRidge(sigma=info.sigma, regularization=info.regularization, input_bounds=cast_bounds(SCENARIO))
    with one_thread():  # the fit is nearly singular, so that rounding shows
        residual = estimator.fit(model.training_casts, along).leave_one_out_residuals()
    assert info.leave_one_out_rmse == pytest.approx(math.sqrt(np.mean(residual**2)), rel=1e-6)
    assert 0 < info.leave_one_out_rmse < 1e-3
    assert model.scenario is data.scenario
    np.testing.assert_array_equal(model.training_casts, data.frame.loc[data.split()[0], list(PARAMETERS)])


def test_test_casts_do_not_influence_the_model(few, few_model):
    *_, test = few.split()
    other = ForwardModel.fit(changed(few, test, landing_along=3.0, landing_across=1.0, status="limit_hit"))
    np.testing.assert_array_equal(predictions(other), predictions(few_model))
    assert other.reach == few_model.reach
    assert other.info.sigma == few_model.info.sigma
    assert other.info.test_rmse > 1


def test_hyperparameters_that_are_none_are_refused_and_not_chosen(data):
    with pytest.raises(InputError, match="sigma"):
        ForwardModel.from_hyperparameters(data, None, 1e-4)
    with pytest.raises(InputError, match="sigma"):
        ForwardModel.fit(data, estimator=KernelRidge(sigma=None))


@pytest.mark.slow
def test_the_standard_deviation_of_few_casts_holds_what_it_says():
    """Some landings are far off. With the few validation casts alone to scale by, it held 86 % of one dataset's fresh casts."""

    def noisy(n_casts, seed):
        data = synthetic(n_casts, seed=seed)
        off = 0.01 * np.random.default_rng(seed).standard_t(3, n_casts)
        return changed(data, slice(None), landing_along=data.frame["landing_along"] + off)

    fresh = noisy(2000, seed=100)
    casts, landing = fresh.frame[list(PARAMETERS)].to_numpy(), fresh.frame["landing_along"].to_numpy()
    covered = []
    for seed in range(12):
        model = ForwardModel.fit(noisy(120, seed))
        covered.append(np.mean(np.abs(model.predict(casts)[:, 0] - landing) <= 2 * model.uncertainty.std(casts)))
    assert min(covered) > 0.88
    assert np.mean(covered) == pytest.approx(0.95, abs=0.02)


def test_validation_casts_choose_nothing_but_measure(few, few_model):
    _, validation, _ = few.split()
    noise = np.random.default_rng(0).normal(scale=0.05, size=len(validation))
    other = ForwardModel.fit(changed(few, validation, landing_along=few.frame["landing_along"][validation] + noise))
    np.testing.assert_array_equal(predictions(other), predictions(few_model))
    assert other.reach == few_model.reach
    assert other.info.validation_rmse == pytest.approx(0.05, rel=0.3)
    assert replace(other.info, validation_rmse=few_model.info.validation_rmse) == few_model.info


def test_landings_across_the_casting_plane_steer_nothing(few, few_model):
    noise = np.random.default_rng(0).normal(scale=0.05, size=len(few))
    other = ForwardModel.fit(changed(few, few.frame.index, landing_across=noise))
    assert other.info == few_model.info


def test_a_parameter_that_matters_less_has_a_wider_sigma(model):
    # The closed form is linear in distance and oscillates in wait.
    distance, _, wait = model.info.sigma
    assert distance > 2 * wait


@pytest.mark.slow
def test_noise_in_the_landings_gives_a_large_regularization(data, model):
    noise = np.random.default_rng(0).normal(scale=0.02, size=len(data))
    noisy = ForwardModel.fit(changed(data, data.frame.index, landing_along=data.frame["landing_along"] + noise))
    assert noisy.info.regularization > 1e3 * model.info.regularization
    assert noisy.info.test_rmse == pytest.approx(0.02, rel=0.4)
    casts = sample_casts(SCENARIO, 200, seed=7)
    error = noisy.predict(casts)[:, 0] - closed_form(casts)[:, 0]
    assert np.sqrt(np.mean(error**2)) < 0.01  # below the noise that it learned from


def test_a_tuned_result_makes_the_model_without_opening_the_test_casts(few, few_model, monkeypatch):
    train, *_ = few.split()
    loss = LeaveOneOutLoss(
        few.frame.loc[train, list(PARAMETERS)],
        few.frame.loc[train, "landing_along"],
        input_bounds=cast_bounds(SCENARIO),
    )
    tuned = tune_by_lbfgs(loss, sigma0=[0.5] * 3)
    monkeypatch.setattr(Parts, "open_test", None)  # not to be called
    other = ForwardModel.from_hyperparameters(few, tuned.sigma, tuned.regularization)
    np.testing.assert_array_equal(predictions(other), predictions(few_model))
    assert math.isnan(other.info.test_rmse)
    assert replace(other.info, test_rmse=few_model.info.test_rmse) == few_model.info
    one = ForwardModel.from_hyperparameters(few, 0.7, tuned.regularization)
    assert one.info.sigma == (0.7, 0.7, 0.7)
    assert one.info.leave_one_out_rmse > few_model.info.leave_one_out_rmse


def test_casts_that_never_came_down_are_left_out(few):
    lost = [0, 5, 50, 80, 100]  # three to train with, one to validate and one to test
    broken = changed(few, lost, status="never_crossed", **dict.fromkeys(OUTPUTS[:5], np.nan))
    model = ForwardModel.fit(broken)
    assert (model.info.n_train, model.info.n_validation, model.info.n_test) == (75, 17, 5)
    assert np.isfinite(predictions(model)).all()
    kept = few.frame.drop(lost)[list(PARAMETERS)].to_numpy()[:75]
    np.testing.assert_array_equal(model.training_casts, kept)


def test_reach_covers_all_clean_training_casts_but_the_last_at_either_end(data, model):
    along = np.sort(data.frame["landing_along"][data.split()[0]])
    nearest, farthest = model.reach
    assert along[0] < nearest < along[3]
    assert along[-4] < farthest < along[-1]


@pytest.mark.parametrize("column", [{"is_slack": False}, {"status": "limit_hit"}])
def test_reach_leaves_out_casts_that_pull_the_string_or_hit_a_limit(few, few_model, column):
    along = few.frame["landing_along"]
    far = np.flatnonzero(along > 0.6)
    shorter = ForwardModel.fit(changed(few, far, **column))
    assert few_model.reach[1] > 0.65
    assert shorter.reach[1] <= 0.6
    assert shorter.reach[0] == pytest.approx(few_model.reach[0], abs=0.02)
    np.testing.assert_array_equal(predictions(shorter), predictions(few_model))  # but the model learns from them


@pytest.mark.parametrize(
    ("columns", "said"),
    [
        ({"status": "never_crossed", **dict.fromkeys(OUTPUTS[:5], np.nan)}, "training casts"),
        ({"status": "limit_hit"}, "slack"),
        ({"is_slack": False}, "slack"),
    ],
)
def test_a_dataset_that_teaches_nothing_is_refused_in_one_line(few, columns, said):
    with pytest.raises(InputError, match=said) as caught:
        ForwardModel.fit(changed(few, few.frame.index, **columns))
    assert "\n" not in str(caught.value)
    assert "change the scenario's motion or bounds" in str(caught.value)


def test_a_dataset_that_is_too_small_is_refused():
    with pytest.raises(InputError, match="at least 34"):
        ForwardModel.fit(synthetic(33))


def test_fitting_again_gives_the_same_model(few, few_model):
    again = ForwardModel.fit(few)
    assert again.info == few_model.info
    np.testing.assert_array_equal(predictions(again), predictions(few_model))


# --- predicting


def test_gradient_agrees_with_finite_differences_in_si_units(model):
    lower, upper = cast_bounds(SCENARIO)
    casts = np.random.default_rng(3).uniform(lower, upper, size=(10, 3))
    gradient = np.stack([model.linearize(cast).gradient for cast in casts])
    assert gradient.shape == (10, 7, 3)
    h = 1e-4
    for parameter, step in enumerate(h * np.eye(3)):
        difference = (model.predict(casts + step) - model.predict(casts - step)) / (2 * h)
        np.testing.assert_allclose(gradient[:, :, parameter], difference, rtol=1e-4, atol=1e-4)
    # Metres per metre: the closed form's landing moves as far as the hand does.
    np.testing.assert_allclose(gradient[:, 0, 0], 1.0, atol=0.02)


def test_an_expansion_is_all_that_is_known_about_a_cast(model):
    casts = sample_casts(SCENARIO, 10, seed=3)
    for cast, prediction in zip(casts, model.predict(casts), strict=True):
        found = model.linearize(cast)
        np.testing.assert_allclose(found.outputs, prediction, rtol=1e-8, atol=1e-8)
        std, std_gradient = model.uncertainty.linearize(cast)
        assert found.std == std > 0
        np.testing.assert_array_equal(found.std_gradient, std_gradient)


def test_the_landing_alone_is_the_first_output(model):
    casts = sample_casts(SCENARIO, 10, seed=3)
    landing, landing_gradient = model.landing_with_gradient(casts)
    for i, cast in enumerate(casts):
        found = model.linearize(cast)
        np.testing.assert_allclose(landing[i], found.outputs[0], rtol=1e-8)
        np.testing.assert_allclose(landing_gradient[i], found.gradient[0], rtol=1e-6, atol=1e-6)


# --- the scenarios that it serves


OTHER_CUP = Scenario(cup=Cup(inner_radius=0.06))
NOISY = Scenario(noise=Noise.typical())


@pytest.mark.parametrize("other", [OTHER_CUP, NOISY])
def test_a_model_serves_other_cups_and_noise(model, other):
    assert model.serves(other)
    bound = model.bound_to(other)
    assert bound.scenario is other
    assert model.scenario == SCENARIO  # as it was
    np.testing.assert_array_equal(predictions(bound), predictions(model))
    assert bound.reach == model.reach


def test_the_reach_is_that_of_casts_that_let_the_ball_rest_in_the_scenarios_cup(tmp_path):
    short = Scenario.from_dict({"string": {"length": 0.40}})
    data = synthetic(N_FEW, short)
    model = ForwardModel.fit(data)
    train = data.frame.loc[data.split()[0]]
    apart = (train["landing_along"] - 0.2 - train["distance"]).abs()
    free = train["landing_along"][apart <= short.tether.span]
    assert len(free) < 0.9 * len(train)
    assert model.reach == pytest.approx(np.quantile(free, [0.005, 0.995]))
    assert model.reach[1] < np.quantile(train["landing_along"], 0.995) - 0.05
    # A wide cup leaves the ball more play, and so fewer hands that let it rest at the far wall.
    wide = short.model_copy(update={"cup": Cup(inner_radius=0.08)})
    model.save(tmp_path / "a.model")
    for bound in (model.bound_to(wide), ForwardModel.load(tmp_path / "a.model", wide)):
        free = train["landing_along"][apart <= wide.tether.span]
        assert bound.reach == pytest.approx(np.quantile(free, [0.005, 0.995]))
        assert bound.reach[1] < model.reach[1]
    assert ForwardModel.load(tmp_path / "a.model").reach == model.reach


def test_a_dataset_without_a_cup_in_which_the_ball_could_rest_is_refused_in_one_line():
    short = Scenario.from_dict({"string": {"length": 0.36}})
    far = changed(synthetic(scenario=short), slice(None), landing_along=0.9)
    with pytest.raises(InputError, match="would hang in a taut string") as caught:
        ForwardModel.fit(far)
    assert "\n" not in str(caught.value)
    assert "a longer string (string.length) or a deeper drop (motion.drop_distance) mends it" in str(caught.value)


def test_a_model_does_not_serve_another_ball(model):
    other = Scenario(ball=Ball(mass=0.04))
    assert not model.serves(other)
    with pytest.raises(InputError, match="made for another scenario") as caught:
        model.bound_to(other)
    line = str(caught.value)
    assert "\n" not in line
    assert SCENARIO.fingerprint in line
    assert other.fingerprint in line


def test_what_was_learned_with_noise_serves_that_noise_only():
    noisy = ForwardModel.from_hyperparameters(synthetic(scenario=NOISY), 0.7, 1e-4)
    assert noisy.serves(NOISY)
    assert noisy.bound_to(NOISY.model_copy(update={"cup": OTHER_CUP.cup})).scenario.cup == OTHER_CUP.cup
    for other in (SCENARIO, Scenario(noise=Noise(speed=0.03))):
        assert not noisy.serves(other)
        with pytest.raises(InputError, match="another scenario"):
            noisy.bound_to(other)


# --- the file


@pytest.fixture
def file(model, tmp_path):
    path = tmp_path / "a.model"
    model.save(path)
    return path


def tampered(file, **header):
    """Rewrite a model file with other values in its header."""
    with np.load(file) as stored:
        values = {name: stored[name] for name in stored.files}
    old = json.loads(str(values.pop("header")))
    with file.open("wb") as stream:
        np.savez_compressed(stream, header=np.array(json.dumps(old | header)), **values)


def replaced(file, **arrays):
    """Rewrite a model file with other arrays."""
    with np.load(file) as stored:
        values = {name: stored[name] for name in stored.files}
    with file.open("wb") as stream:
        np.savez_compressed(stream, **(values | arrays))


def members(file):
    with zipfile.ZipFile(file) as archive:
        return {name: archive.read(name) for name in archive.namelist()}


def zipped(file, name, content, said=None):
    """Rewrite a model file with another content of one member, which the archive says is so many bytes."""
    kept = members(file) | {f"{name}.npy": content}
    with zipfile.ZipFile(file, "w", zipfile.ZIP_DEFLATED) as archive:
        for one, written in kept.items():
            archive.writestr(one, written)
        if said is not None:
            archive.getinfo(f"{name}.npy").file_size = said


def recompressed(file, method):
    kept = members(file)
    with zipfile.ZipFile(file, "w", method) as archive:
        for name, content in kept.items():
            archive.writestr(name, content)


def with_flag(file, bits):
    """Rewrite a model file so that its members are said to be of that kind."""
    content = bytearray(file.read_bytes())
    for mark, offset in ((b"PK\x03\x04", 6), (b"PK\x01\x02", 8)):
        for found in re.finditer(re.escape(mark), bytes(content)):
            content[found.start() + offset] |= bits
    file.write_bytes(content)


def without(file, name):
    """Rewrite a model file without one of its arrays."""
    with np.load(file) as stored:
        values = {other: stored[other] for other in stored.files if other != name}
    with file.open("wb") as stream:
        np.savez_compressed(stream, **values)


def test_round_trip_predicts_the_same(model, file):
    again = ForwardModel.load(file)
    np.testing.assert_array_equal(predictions(again), predictions(model))
    np.testing.assert_array_equal(again.training_casts, model.training_casts)
    np.testing.assert_array_equal(again.training_outputs, model.training_outputs)
    casts = sample_casts(SCENARIO, 30, seed=99)
    np.testing.assert_array_equal(again.uncertainty.std(casts), model.uncertainty.std(casts))
    for found, expected in zip(again.linearize(casts[0]), model.linearize(casts[0]), strict=True):
        np.testing.assert_array_equal(found, expected)
    assert again.info == model.info
    assert again.reach == model.reach
    assert again.scenario == model.scenario


def test_a_model_serves_every_cup_that_is_as_high(file):
    slippery = Scenario(cup=Cup(friction=0.1))
    assert ForwardModel.load(file, slippery).scenario is slippery


def test_a_model_without_noise_serves_noise(model, file):
    loaded = ForwardModel.load(file, NOISY)
    assert loaded.scenario is NOISY
    np.testing.assert_array_equal(predictions(loaded), predictions(model))


def test_a_model_of_another_scenario_is_refused(file):
    other = Scenario(ball=Ball(mass=0.04))
    line = refused(file, other)
    assert other.fingerprint in line
    assert SCENARIO.fingerprint in line
    assert "wam-cast fit" in line


@pytest.mark.parametrize("name", ["missing.model", ".", "a.model/b"])
def test_what_cannot_be_read_is_refused(file, name):
    assert "wam-cast fit" in refused(file.parent / name)


def write_other_npz(path):
    with path.open("wb") as stream:
        np.savez(stream, training_casts=np.ones((3, 3)))


def write_array(path):
    with path.open("wb") as stream:
        np.save(stream, np.ones(3))


def write_pickle(path):
    with path.open("wb") as stream:
        np.save(stream, np.array([{}], dtype=object), allow_pickle=True)


NOT_A_MODEL = {
    "text": lambda path: path.write_text("sigma: 0.5\n"),
    "empty": lambda path: path.write_bytes(b""),
    "bytes": lambda path: path.write_bytes(bytes(range(256)) * 4),
    "truncated": lambda path: path.write_bytes(path.read_bytes()[:-500]),
    "cut to a half": lambda path: path.write_bytes(path.read_bytes()[: path.stat().st_size // 2]),
    "damaged": lambda path: path.write_bytes(path.read_bytes()[:1500] + bytes(40) + path.read_bytes()[1540:]),
    "other npz": write_other_npz,
    "array": write_array,
    "pickle": write_pickle,
    "no word on clean casts": lambda path: without(path, "training_is_clean"),
    "deep header": lambda path: replaced(path, header=np.array("[" * 100_000)),
    "no JSON": lambda path: replaced(path, header=np.array("sigma: 0.5")),
    "header of numbers": lambda path: replaced(path, header=np.ones(3)),
    "objects": lambda path: replaced(path, training_casts=np.array([{}], dtype=object)),
    "encrypted": lambda path: with_flag(path, 1),
    "strongly encrypted": lambda path: with_flag(path, 65),
    "bzip2": lambda path: recompressed(path, zipfile.ZIP_BZIP2),
}


@pytest.mark.parametrize("kind", NOT_A_MODEL)
def test_what_is_not_a_model_is_refused(file, kind):
    NOT_A_MODEL[kind](file)
    assert "not a model file" in refused(file)
    assert "wam-cast fit" in refused(file)


def test_a_model_of_another_format_is_refused_with_both_named(file):
    tampered(file, format="wam_cast forward model 4")
    line = refused(file)
    assert "'wam_cast forward model 4'" in line
    assert "'wam_cast forward model 5'" in line
    assert "wam-cast fit" in line


def test_damage_anywhere_is_noticed(file):
    whole = file.read_bytes()
    for start in range(0, len(whole) - 60, len(whole) // 60):
        file.write_bytes(whole[:start] + bytes(60) + whole[start + 60 :])
        refused(file)
    for end in range(0, len(whole), len(whole) // 60):
        file.write_bytes(whole[:end])
        refused(file)


@pytest.mark.slow
def test_a_flipped_bit_is_noticed_or_of_no_consequence(file, monkeypatch):
    from wam_cast.learning import model_file

    kept, whole = model_file.read_model(file), bytearray(file.read_bytes())
    rng = np.random.default_rng(0)
    n_refused = 0
    for position in (*rng.integers(len(whole), size=150), *range(len(whole) - 250, len(whole))):
        flipped = whole.copy()
        flipped[position] ^= 1 << int(rng.integers(8))
        file.write_bytes(flipped)
        try:
            found = model_file.read_model(file)
        except InputError as error:
            assert "\n" not in str(error)
            n_refused += 1
        else:  # of what says when and by whom the archive was written
            for one, other in zip(found, kept, strict=True):
                np.testing.assert_array_equal(one, other)
    assert n_refused > 200


ADVICE = "which wam-cast fit does not write; fit it anew"


@pytest.mark.parametrize(
    ("part", "values", "said"),
    [
        ("info", {"sigma": [0.0, 1.0, 1.0]}, "info.sigma.0: input should be greater than or equal to 0.000001, not 0"),
        ("info", {"sigma": [math.nan] * 3}, "info.sigma.0: "),
        ("info", {"sigma": 0.5}, "info.sigma: "),
        ("info", {"sigma": [0.5, 0.5]}, "info.sigma.2: "),
        ("info", {"regularization": -1}, "info.regularization: input should be greater than or equal to 0, not -1"),
        ("info", {"regularization": math.nan}, "info.regularization: "),
        ("info", {"regularization": math.inf}, "info.regularization: "),
        ("info", {"n_train": 0}, "info.n_train: "),
        ("info", {"n_train": 10**9}, "info.n_train: "),
        (
            "info",
            {"n_train": 259},
            r"training_casts is of shape \(260, 3\) and type float64, not \(259, 3\) and float64",
        ),
        ("info", {"n_test": "many"}, "info.n_test: "),
        ("info", {"n_landmarks": 0}, "info.n_landmarks: input should be greater than or equal to 1, not 0"),
        ("info", {"n_landmarks": 10**9}, "info.n_landmarks: "),
        ("info", {"seed": None}, "info.seed: "),
        ("uncertainty", {"scale": math.nan}, "uncertainty.scale: "),
        (
            "uncertainty",
            {"scale": -1},
            "uncertainty.scale: input should be greater than or equal to 0.000000001, not -1",
        ),
        ("uncertainty", {"scale": 0}, "uncertainty.scale: "),
        ("uncertainty", {"sigma": [0.2]}, "uncertainty.sigma.1: "),
        ("uncertainty", {"regularization": math.inf}, "uncertainty.regularization: "),
        ("uncertainty", {"more": 1}, "uncertainty.more: "),
    ],
)
def test_a_header_that_no_fit_writes_is_one_line(file, part, values, said):
    with np.load(file) as stored:
        header = json.loads(str(stored["header"]))
    tampered(file, **{part: header[part] | values})
    line = refused(file)
    assert re.search(said, line)
    assert line.endswith(ADVICE)


@pytest.mark.parametrize("name", ["info", "uncertainty", "fingerprint", "scenario", "controller"])
@pytest.mark.parametrize("value", [None, 3, [[[]]]], ids=str)
def test_a_part_of_the_header_of_another_kind_is_one_line(file, name, value):
    tampered(file, **{name: value})
    assert refused(file).endswith(ADVICE)


@pytest.mark.parametrize("arm", [None, 3, []], ids=str)
def test_a_scenario_of_another_kind_is_one_line(file, arm):
    tampered(file, scenario={"arm": arm})
    for scenario in (None, SCENARIO):
        assert "its scenario cannot be used now" in refused(file, scenario)


@pytest.mark.parametrize(
    ("name", "change", "said"),
    [
        ("training_casts", lambda a: np.where(a == a[3, 1], np.nan, a), "training_casts holds nan"),
        ("training_outputs", lambda a: np.where(a == a[3, 1], -np.inf, a), "training_outputs holds -inf"),
        ("training_log_ratios", lambda a: a + 1e9, "training_log_ratios holds 1e"),
        ("training_casts", lambda a: a[:0], r"training_casts is of shape \(0, 3\)"),
        ("training_casts", lambda a: a.T, r"training_casts is of shape \(3, 260\)"),
        ("training_casts", lambda a: a.astype(np.float32), "type float32, not .* float64"),
        ("training_casts", lambda a: a.astype(complex), "type complex128"),
        ("training_is_clean", lambda a: a.astype(float), "training_is_clean is of .* type float64, not .* bool"),
        ("training_outputs", lambda a: a.astype(str), "training_outputs is of .* type <U"),
    ],
)
def test_an_array_that_no_fit_writes_is_one_line(file, name, change, said):
    with np.load(file) as stored:
        values = change(stored[name])
    replaced(file, **{name: values})
    line = refused(file)
    assert re.search(said, line)
    assert line.endswith(ADVICE)


def test_a_kernel_that_cannot_be_factorized_is_one_line(file):
    with np.load(file) as stored:
        info, casts = json.loads(str(stored["header"]))["info"], stored["training_casts"]
    tampered(file, info=info | {"regularization": 0.0})
    replaced(file, training_casts=np.tile(casts[:2], (130, 1)))
    assert "singular to working precision with regularization=0" in refused(file)
    data = changed(synthetic(60), slice(None), distance=0.2, speed=0.5, wait=0.1)
    with pytest.raises(InputError, match=r"estimator: the kernel matrix .* is singular") as caught:
        ForwardModel.from_hyperparameters(data, 0.5, 0.0)
    assert "\n" not in str(caught.value)


def declared(shape):
    """Return what a member of an archive holds that says it is an array of that shape, with eight bytes of it."""
    content = io.BytesIO()
    np.lib.format.write_array_header_1_0(content, {"descr": "<f8", "fortran_order": False, "shape": shape})
    return content.getvalue() + bytes(8)


BOMBS = {
    "unpacks to 100 MB": lambda file: zipped(file, "training_casts", bytes(100_000_000)),
    "says that it is 8 TB": lambda file: zipped(file, "training_casts", declared((10**12,))),
    "says less than it unpacks to": lambda file: zipped(file, "training_casts", bytes(100_000_000), said=100),
    "100 MB as it is": lambda file: os.truncate(file, 100_000_000),
}


@pytest.mark.parametrize("bomb", BOMBS)
def test_a_bomb_is_refused_within_bounded_memory(file, bomb):
    BOMBS[bomb](file)
    tracemalloc.start()
    try:
        refused(file)
        _, peak = tracemalloc.get_traced_memory()
    finally:
        tracemalloc.stop()
    assert peak < 50_000_000


@pytest.mark.skipif(not hasattr(os, "mkfifo"), reason="named pipes")
def test_a_named_pipe_is_not_waited_for(tmp_path):
    os.mkfifo(tmp_path / "pipe")
    assert "not a regular file" in refused(tmp_path / "pipe")


def test_more_training_casts_than_a_matrix_takes_are_refused(monkeypatch):
    from wam_cast.learning import forward_model

    monkeypatch.setattr(forward_model, "MOST_TRAINING_CASTS", 40)
    with pytest.raises(InputError, match=r"45 training casts are too many .* give it 40 at most"):
        ForwardModel.from_hyperparameters(synthetic(60), 0.5, 1e-4)


def test_a_model_of_another_arm_is_refused(file):
    tampered(file, fingerprint="0123456789abcdef")
    line = refused(file)
    assert "0123456789abcdef" in line
    assert "fit it anew" in line


def test_a_model_whose_scenario_is_out_of_date_is_refused(file):
    tampered(file, scenario={"string": {"colour": "red"}})
    assert "string.colour" in refused(file)


@pytest.mark.parametrize("name", ["missing/a.model", ".", "a.model/b"])
def test_an_unwritable_output_leaves_nothing_behind(model, file, name):
    before = file.read_bytes()
    with pytest.raises(InputError, match="cannot write") as caught:
        model.save(file.parent / name)
    assert "\n" not in str(caught.value)
    assert [path.name for path in file.parent.iterdir()] == ["a.model"]
    assert file.read_bytes() == before


def test_a_model_of_ones_own_arm_serves_it_wherever_its_file_is_now(tmp_path):
    text = re.sub(r"<visual.*?</visual>", "", (models_directory() / "wam7.urdf").read_text(), flags=re.DOTALL)
    folders = [tmp_path / name for name in ("old", "new", "other")]
    for folder in folders:
        folder.mkdir()
        (folder / "arm.urdf").write_text(text)
    (folders[2] / "arm.urdf").write_text(re.sub(r'<mass value="', '<mass value="1', text, count=1))
    old, new, other = (Scenario.from_dict({"arm": {"urdf": str(folder / "arm.urdf")}}) for folder in folders)
    model = ForwardModel.fit(synthetic(60, old))
    model.save(tmp_path / "a.model")
    (folders[0] / "arm.urdf").unlink()
    assert "no such file" in refused(tmp_path / "a.model")
    moved = ForwardModel.load(tmp_path / "a.model", new)
    np.testing.assert_array_equal(predictions(moved), predictions(model))
    assert "another model of the arm" in refused(tmp_path / "a.model", other)


@pytest.mark.parametrize(
    "changes", [{"sigma": [0.5, 0.5]}, {"sigma": "a"}, {"sigma": -1}, {"regularization": -1}], ids=str
)
def test_hyperparameters_that_cannot_be_are_one_line(changes):
    (name,) = changes
    with pytest.raises(InputError, match=f"estimator: {name}=.* is not allowed") as error:
        ForwardModel.fit(synthetic(60), estimator=KernelRidge(**changes))
    assert "\n" not in str(error.value)
