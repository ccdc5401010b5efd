"""The section on noise, computed again from its casts."""

import numpy as np
import pytest

import wam_cast as wc
from wam_cast.cast import cast_bounds
from wam_cast.learning.kernel_ridge import KernelRidge
from wam_cast.learning.parts import split_casts
from wam_cast.parallel.seeds import Purpose, derived_seed


@pytest.fixture
def study(finished):
    return finished[0].noise


def moved(casts, noisy_casts):
    return (noisy_casts.frame["landing_along"] - casts.frame["landing_along"]).to_numpy()


def test_floor_is_the_noise_of_the_test_casts(study, casts, noisy_casts):
    difference = moved(casts, noisy_casts)
    assert study.test_floor == pytest.approx(np.sqrt(np.mean(difference[80:] ** 2)), rel=1e-12)
    assert study.along.tolist() == difference[:65].tolist()
    assert study.along_std == pytest.approx(np.std(difference[:65]), rel=1e-12)


def test_models_differ_in_what_their_labels_say(finished, study):
    clean = finished[0].selection.per_parameter
    with_noise, clean_lambda, without_noise = study.models.itertuples()
    assert without_noise.sigma == clean.sigma
    assert without_noise.regularization == clean_lambda.regularization == clean.regularization
    assert clean_lambda.sigma == with_noise.sigma != clean.sigma
    assert with_noise.regularization != clean.regularization


def test_models_are_measured_with_noise_and_without(study, casts, noisy_casts):
    clean, noisy = split_casts(casts), split_casts(noisy_casts)
    test, validation = noisy.open_test(), clean.validation
    for model, train in zip(study.models.itertuples(), (noisy.train, noisy.train, clean.train), strict=True):
        refit = KernelRidge(
            sigma=np.array(model.sigma), regularization=model.regularization, input_bounds=cast_bounds(wc.Scenario())
        ).fit(train.X, train.landing)
        for part, rmse in ((test, model.test_rmse), (validation, model.noise_free_rmse)):
            residuals = refit.predict(part.X) - part.landing
            assert rmse == pytest.approx(np.sqrt(np.mean(residuals**2)), rel=1e-6), model.label
        low, high = model.test_rmse_interval
        assert low < model.test_rmse < high


def scatter(trials):
    """Return where each cast landed beyond what `landing` in conftest says without noise [m]."""
    clean = 0.2 + trials["distance"] + 0.4 * trials["speed"] + 0.02 * np.sin(6 * trials["wait"])
    return trials["landing_along"] - clean


def test_plans_are_executed_with_noise_there_and_without_it_before(finished, study):
    trials = finished[0].executions.trials
    np.testing.assert_allclose(scatter(trials), 0, atol=1e-12)
    seeds = [derived_seed(0, Purpose.NOISE, cup) for cup in range(6)]
    expected = [0.005 * np.random.default_rng(seed).standard_normal() for seed in seeds]
    assert study.executions["label"].nunique() == trials["label"].nunique() + 1
    for _, execution in study.executions.groupby("label"):
        np.testing.assert_allclose(scatter(execution), expected, rtol=0, atol=1e-12)
