"""A forward model of more casts than kernel ridge regression takes exactly: what it says and predicts, its plans and its file."""

import json
import tracemalloc
from dataclasses import replace

import numpy as np
import pandas as pd
import pytest

from wam_cast.cast import PARAMETERS, cast_bounds
from wam_cast.errors import InputError
from wam_cast.generation.sampling import sample_casts
from wam_cast.learning import kernel_fit
from wam_cast.learning.dataset import CastDataset
from wam_cast.learning.forward_model import ForwardModel
from wam_cast.learning.hyperparameters import tune_by_lbfgs
from wam_cast.learning.kernel.landmarks import landmark_rows
from wam_cast.learning.kernel_ridge import KernelRidge
from wam_cast.learning.losses import LeaveOneOutLoss
from wam_cast.learning.parts import split_casts
from wam_cast.planning.plan import plan_cast
from wam_cast.planning.prediction import OUTPUTS
from wam_cast.scenario import Scenario

pytestmark = pytest.mark.slow

SCENARIO = Scenario()
N_LANDMARKS = 150


def landed(casts):
    """Return the outputs of casts, shape (n, 7): smooth, with noise of 2 mm in the landing."""
    distance, speed, wait = casts.T
    along = (
        0.2 + distance + 0.4 * speed * np.cos(3 * wait) + 0.002 * np.random.default_rng(7).standard_normal(len(casts))
    )
    others = [1.5 + 0.2 * wait, 0.02 + 0.1 * distance * wait, 0.3 + 0.1 * speed, 0.5 + 0.2 * distance]
    return np.column_stack([along, 0.01 * speed * wait, 0.5 * speed**2, *others])


def synthetic(n_casts, seed=0):
    casts = sample_casts(SCENARIO, n_casts, seed)
    frame = pd.DataFrame(casts, columns=list(PARAMETERS))
    frame[list(OUTPUTS)] = landed(casts)
    return CastDataset(SCENARIO, seed, frame.assign(status="landed", is_slack=True))


@pytest.fixture(scope="module", autouse=True)
def few_are_many():
    """Let 300 training casts be too many."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(kernel_fit, "MOST_EXACT_CASTS", 300)
        patch.setattr(kernel_fit, "N_LANDMARKS", N_LANDMARKS)
        yield


@pytest.fixture(scope="module")
def data():
    return synthetic(680)  # 520 to train with


@pytest.fixture(scope="module")
def model(data):
    return ForwardModel.fit(data)


@pytest.fixture
def casts():
    return sample_casts(SCENARIO, 300, seed=99)


def test_a_fit_says_how_many_landmarks_it_has(data, model):
    assert (model.info.n_train, model.info.n_landmarks) == (520, N_LANDMARKS)
    assert len(model.training_casts) == len(model.training_outputs) == 520
    same = ForwardModel.from_hyperparameters(data, model.info.sigma, model.info.regularization)
    assert replace(same.info, test_rmse=model.info.test_rmse) == model.info


def test_up_to_the_limit_it_is_exact():
    model = ForwardModel.from_hyperparameters(synthetic(393), 0.5, 1e-4)
    assert (model.info.n_train, model.info.n_landmarks) == (300, None)
    info = model.info
    exact = KernelRidge(sigma=info.sigma, regularization=info.regularization, input_bounds=cast_bounds(SCENARIO))
    exact.fit(model.training_casts, model.training_outputs)
    np.testing.assert_allclose(model.predict(model.training_casts), exact.predict(model.training_casts), rtol=1e-9)


def test_the_landmarks_choose_sigma_and_lambda(data, model):
    train = split_casts(data).train
    rows = landmark_rows(520, N_LANDMARKS)
    loss = LeaveOneOutLoss(train.X[rows], train.landing[rows], input_bounds=cast_bounds(SCENARIO))
    best = tune_by_lbfgs(loss, sigma0=[0.5] * 3)
    assert model.info.sigma == tuple(best.sigma)
    assert model.info.regularization == best.regularization


def test_it_predicts_what_the_exact_one_does(data, model, casts, monkeypatch):
    monkeypatch.setattr(kernel_fit, "MOST_EXACT_CASTS", 5000)
    exact = ForwardModel.from_hyperparameters(data, model.info.sigma, model.info.regularization)
    assert exact.info.n_landmarks is None
    np.testing.assert_allclose(model.predict(casts), exact.predict(casts), rtol=0, atol=2e-4)
    ratio = model.uncertainty.std(casts) / exact.uncertainty.std(casts)
    assert 0.8 < ratio.min() <= ratio.max() < 1.25


def test_the_number_of_landmarks_may_be_given(data, model, casts):
    chosen = {"sigma": model.info.sigma, "regularization": model.info.regularization}
    fewer = ForwardModel.fit(data, estimator=KernelRidge(**chosen, n_landmarks=20))
    assert fewer.info.n_landmarks == 20
    assert fewer.info.validation_rmse > model.info.validation_rmse
    all_of_them = ForwardModel.fit(synthetic(80), estimator=KernelRidge(**chosen, n_landmarks=10_000))
    assert all_of_them.info.n_landmarks == all_of_them.info.n_train < 80
    with pytest.raises(InputError, match=r"estimator: n_landmarks=0 is not allowed"):
        ForwardModel.fit(data, estimator=KernelRidge(**chosen, n_landmarks=0))
    with pytest.raises(InputError, match=r"estimator: regularization=0 is not allowed"):
        ForwardModel.fit(data, estimator=KernelRidge(sigma=0.4, regularization=0.0))


def test_derivatives_are_those_of_what_it_predicts(model, casts):
    steps = 1e-5 * np.diag(np.ptp(cast_bounds(SCENARIO), axis=0))
    for cast in casts[:5]:
        outputs, gradient, std, std_gradient = model.linearize(cast)
        np.testing.assert_allclose(outputs, model.predict(cast[np.newaxis])[0], rtol=1e-9)
        assert std == pytest.approx(model.uncertainty.std(cast[np.newaxis])[0], rel=1e-9)
        above, below = cast + steps, cast - steps
        difference = (model.predict(above) - model.predict(below)).T / (2 * steps.diagonal())
        np.testing.assert_allclose(gradient, difference, rtol=1e-4, atol=1e-4)
        difference = (model.uncertainty.std(above) - model.uncertainty.std(below)) / (2 * steps.diagonal())
        np.testing.assert_allclose(std_gradient, difference, rtol=1e-3, atol=1e-3 * np.abs(std_gradient).max())


def test_two_standard_deviations_hold_95_percent(model):
    fresh = sample_casts(SCENARIO, 1000, seed=98)
    error = model.predict(fresh)[:, 0] - landed(fresh)[:, 0]
    assert np.mean(np.abs(error) <= 2 * model.uncertainty.std(fresh)) == pytest.approx(0.95, abs=0.03)


@pytest.mark.parametrize("method", ["gradient", "program"])
def test_planners_plan_with_it(model, method):
    plan = plan_cast(model, (sum(model.reach) / 2, 0.0), method)
    assert plan.is_feasible
    assert plan.predicted_miss < 2e-3


def test_round_trip(model, casts, tmp_path):
    model.save(tmp_path / "a.model")
    again = ForwardModel.load(tmp_path / "a.model")
    assert again.info == model.info
    np.testing.assert_array_equal(again.predict(casts), model.predict(casts))
    np.testing.assert_array_equal(again.uncertainty.std(casts), model.uncertainty.std(casts))
    np.testing.assert_array_equal(again.training_casts, model.training_casts)


def header_changed(file, change):
    with np.load(file) as stored:
        values = {name: stored[name] for name in stored.files}
    header = json.loads(str(values.pop("header")))
    change(header["info"])
    with file.open("wb") as stream:
        np.savez_compressed(stream, header=np.array(json.dumps(header)), **values)


def test_a_file_that_knows_no_landmarks_is_of_an_exact_model(casts, tmp_path, monkeypatch):
    exact = ForwardModel.from_hyperparameters(synthetic(80), 0.5, 1e-4)
    exact.save(tmp_path / "old.model")
    header_changed(tmp_path / "old.model", lambda info: info.pop("n_landmarks"))
    monkeypatch.setattr(kernel_fit, "MOST_EXACT_CASTS", 20)  # whatever the limit is now
    old = ForwardModel.load(tmp_path / "old.model")
    np.testing.assert_array_equal(old.predict(casts), exact.predict(casts))
    assert old.info.n_landmarks is None


def test_a_file_whose_landmarks_cannot_be_fitted_is_refused_in_one_line(model, tmp_path):
    model.save(tmp_path / "a.model")
    header_changed(tmp_path / "a.model", lambda info: info.update(regularization=0.0))
    with pytest.raises(
        InputError, match=r"a\.model: estimator: regularization=0 is not allowed with n_landmarks"
    ) as caught:
        ForwardModel.load(tmp_path / "a.model")
    assert "\n" not in str(caught.value)


@pytest.mark.slow
def test_the_memory_of_20000_training_casts_is_far_from_a_matrix_of_them(tmp_path):
    data = synthetic(26_154)
    tracemalloc.start()
    try:
        model = ForwardModel.fit(data)
        _, peak = tracemalloc.get_traced_memory()
    finally:
        tracemalloc.stop()
    assert (model.info.n_train, model.info.n_landmarks) == (20_000, N_LANDMARKS)
    assert peak < 200_000_000  # the matrix has 3.2 GB
    assert model.info.test_rmse == pytest.approx(0.002, rel=0.1)
    model.save(tmp_path / "a.model")
    assert ForwardModel.load(tmp_path / "a.model").info == model.info
