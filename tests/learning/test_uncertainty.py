"""The landing's uncertainty: a Gaussian process's posterior, corrected to follow errors whose size is known."""

import numpy as np
import pytest
from sklearn.gaussian_process import GaussianProcessRegressor
from sklearn.gaussian_process.kernels import RBF

from wam_cast.learning.kernel_ridge import KernelRidge
from wam_cast.learning.uncertainty import ErrorFit, LandingUncertainty, held_out_scale

LOWER = np.array([0.05, 0.2, 0.0])
UPPER = np.array([0.40, 0.9, 0.5])
N_TRAIN, N_HELD_OUT = 300, 300
SIGMA = (0.9, 1.2, 0.7)


def inputs(n, seed):
    return np.random.default_rng(seed).uniform(LOWER, UPPER, size=(n, 3))


def scaled(X):
    return (X - LOWER) / (UPPER - LOWER)


def error_level(X):
    """Return the standard deviation of the landings' errors [m]: twenty times larger at one end of the cube than at the other."""
    return 5e-4 * np.exp(3 * scaled(X)[:, 0])


def landing(X, seed):
    distance, speed, wait = scaled(X).T
    noise = np.random.default_rng(seed).standard_normal(len(X))
    return 0.5 + 0.2 * np.sin(distance + speed) * np.cos(wait) + error_level(X) * noise


def fitted(X, y, regularization=1e-2):
    estimator = KernelRidge(sigma=SIGMA, regularization=regularization, input_bounds=(LOWER, UPPER))
    # The landing is the first of several outputs; what the others are must not matter.
    return estimator.fit(X, np.column_stack([y, X @ [7.0, -3.0, 5.0]]))


def uncorrected(estimator, scale=1.0, log_ratio=0.0):
    """Return an uncertainty whose correction is the same everywhere."""
    ratios = np.full(len(estimator.X_fit_), log_ratio)
    return LandingUncertainty(estimator, ratios, ErrorFit((0.4, 0.5, 0.6), 0.5, scale))


def scaled_by(estimator, X, y):
    """Return the uncertainty that is learned, scaled by casts that are held out."""
    learned = LandingUncertainty.learn(estimator)
    return learned.scaled_by((estimator.predict(X)[:, 0] - y) / learned.std(X))


@pytest.fixture(scope="module")
def held_out():
    X = inputs(N_HELD_OUT, seed=2)
    return X, landing(X, seed=3)


@pytest.fixture(scope="module")
def estimator():
    X = inputs(N_TRAIN, seed=0)
    return fitted(X, landing(X, seed=1))


@pytest.fixture(scope="module")
def learned(estimator, held_out):
    return scaled_by(estimator, *held_out)


@pytest.fixture
def fresh():
    """Return casts that nothing has seen, and their landings."""
    X = inputs(1000, seed=4)
    return X, landing(X, seed=5)


@pytest.mark.parametrize("regularization", [1e-6, 1e-2])
def test_posterior_is_that_of_a_gaussian_process_of_scikit_learn(regularization):
    X, X_query = inputs(80, seed=6), inputs(30, seed=7)
    uncertainty = uncorrected(fitted(X, landing(X, seed=8), regularization), scale=0.03, log_ratio=-1.2)
    kernel = RBF(length_scale=np.array(SIGMA) / np.sqrt(2))
    process = GaussianProcessRegressor(kernel, alpha=regularization, optimizer=None)
    _, std = process.fit(scaled(X), np.zeros(len(X))).predict(scaled(X_query), return_std=True)
    expected = 0.03 * np.exp(-1.2) * np.sqrt(std**2 + regularization)
    np.testing.assert_allclose(uncertainty.std(X_query), expected, rtol=2e-3)


def test_expansion_is_the_standard_deviation_and_its_derivative(learned):
    for x in inputs(10, seed=9):
        std, gradient = learned.linearize(x)
        assert std == pytest.approx(learned.std(x[np.newaxis])[0], rel=1e-10)
        assert gradient.shape == (3,)
        steps = 1e-5 * np.diag(UPPER - LOWER)
        difference = (learned.std(x + steps) - learned.std(x - steps)) / (2 * np.diag(steps))
        np.testing.assert_allclose(gradient, difference, rtol=1e-5, atol=1e-5 * np.abs(gradient).max())


def test_derivative_of_the_posterior_alone():
    X = inputs(60, seed=6)
    uncertainty = uncorrected(fitted(X, landing(X, seed=8), 1e-4))
    for x in inputs(10, seed=9):
        steps = 1e-4 * np.diag(UPPER - LOWER)
        difference = (uncertainty.std(x + steps) - uncertainty.std(x - steps)) / (2 * np.diag(steps))
        np.testing.assert_allclose(uncertainty.linearize(x)[1], difference, rtol=1e-3, atol=1e-4)


def test_standard_deviations_are_one_for_each_cast(learned):
    X = inputs(5, seed=9)
    std = learned.std(X)
    assert std.shape == (5,)
    np.testing.assert_allclose(learned.std(X[[3]]), std[[3]], rtol=1e-12)


def test_it_follows_errors_whose_size_varies(estimator, learned, fresh):
    X, y = fresh
    std = learned.std(X)
    assert np.corrcoef(np.log(std), np.log(error_level(X)))[0, 1] > 0.85
    # Which is learned from errors: the training casts are as dense everywhere.
    plain = uncorrected(estimator).std(X)
    assert np.corrcoef(np.log(plain), np.log(error_level(X)))[0, 1] < 0.3
    error = estimator.predict(X)[:, 0] - y
    for rows in np.array_split(np.argsort(std), 5):
        predicted = np.sqrt(np.mean(std[rows] ** 2))
        assert np.sqrt(np.mean(error[rows] ** 2)) == pytest.approx(predicted, rel=0.3)


def test_two_standard_deviations_hold_95_percent_of_casts_that_nothing_has_seen(estimator, learned, fresh, held_out):
    for (X, y), tolerance in ((held_out, 0.0101), (fresh, 0.02)):
        normalized = (estimator.predict(X)[:, 0] - y) / learned.std(X)
        assert np.mean(np.abs(normalized) <= 2) == pytest.approx(0.95, abs=tolerance)


@pytest.mark.parametrize("tail", [np.inf, 1.5])
@pytest.mark.parametrize("n", [6, 12, 44, 300])
def test_scale_of_held_out_errors_covers_new_ones_whatever_their_tail(n, tail):
    rng = np.random.default_rng(3)
    draw = rng.standard_normal if np.isinf(tail) else lambda size: rng.standard_t(tail, size)
    covered = [np.mean(np.abs(draw(1000)) <= 2 * held_out_scale(draw(n))) for _ in range(300)]
    # From a handful of errors with long tails the quantile cannot be seen.
    least = 0.94 if np.isinf(tail) or n > 12 else 0.88
    assert least < np.mean(covered) < 0.985


def test_a_single_error_says_little():
    assert held_out_scale(np.array([-0.01])) == pytest.approx(0.01 * 12.706 / 2, rel=1e-4)


def test_a_cast_that_is_predicted_perfectly_changes_little(estimator, learned, held_out, fresh):
    X, row = estimator.X_fit_, 17
    y = landing(X, seed=1)
    y[row] -= estimator.leave_one_out_residuals()[row, 0]
    perfect = fitted(X, y)
    assert abs(perfect.leave_one_out_residuals()[row, 0]) < 1e-12
    uncertainty = scaled_by(perfect, *held_out)
    # Without a least ratio, its logarithm would be -30 or less.
    assert uncertainty.log_ratios[row] > np.median(uncertainty.log_ratios) - 8
    ratio = uncertainty.std(fresh[0]) / learned.std(fresh[0])
    assert 0.7 < ratio.min() <= ratio.max() < 1.4


def test_among_few_casts_no_place_passes_for_sure_by_chance():
    # The errors are alike everywhere. Planners seek the least deviation, and would find each error that is small by chance.
    lowest = []
    for seed in range(8):
        X, X_held_out = inputs(30, seed), inputs(12, seed + 100)
        y, y_held_out = np.split(0.5 + 1e-3 * np.random.default_rng(seed).standard_normal(42), [30])
        learned = scaled_by(fitted(X, y, regularization=1.0), X_held_out, y_held_out)
        std = learned.std(np.vstack([X, inputs(500, seed + 200)]))
        lowest.append(std.min() / np.median(std))
    assert np.median(lowest) > 0.6
    assert min(lowest) > 0.15


def test_far_from_all_training_casts_it_grows(estimator, learned):
    inside, plain = learned.std(inputs(200, seed=9)).max(), uncorrected(estimator)
    middle, directions = (LOWER + UPPER) / 2, np.vstack([np.eye(3), -np.eye(3)]) * (UPPER - LOWER)
    for direction in directions:
        ray = middle + np.linspace(0.5, 5, 20)[:, np.newaxis] * direction
        posterior = plain.std(ray)
        assert np.all(np.diff(posterior) > -1e-12)
        assert posterior[-1] == pytest.approx(np.sqrt(1 + estimator.regularization_), rel=1e-6)
        assert learned.std(ray)[-1] > inside
        np.testing.assert_allclose(plain.linearize(ray[-1])[1], 0, atol=1e-6)


def test_learning_again_gives_the_same(estimator, learned, held_out):
    again = LandingUncertainty(estimator, learned.log_ratios, learned.fit)
    np.testing.assert_array_equal(again.std(held_out[0]), learned.std(held_out[0]))
