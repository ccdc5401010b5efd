"""The searches for hyperparameters: the paper's gradient descent, and L-BFGS-B."""

from contextlib import contextmanager

import numpy as np
import pytest

from wam_cast.learning import hyperparameters, losses
from wam_cast.learning.hyperparameters import REGULARIZATION_BOUNDS, SIGMA_BOUNDS, tune_by_descent, tune_by_lbfgs
from wam_cast.learning.kernel_ridge import KernelRidge
from wam_cast.learning.losses import LeaveOneOutLoss, ValidationLoss

# --- gradient descent, on validation data


@pytest.mark.parametrize("sigma0", [0.15, 1.0, 3.0])
def test_descent_reaches_the_minimum_of_a_dense_grid(validation_data, sigma0, validation_error):
    result = tune_by_descent(ValidationLoss(*validation_data), sigma0=sigma0, regularization=1e-3)
    grid = np.geomspace(0.1, 4.0, 150)
    rmse_grid = np.sqrt([validation_error(validation_data, sigma=sigma, regularization=1e-3) for sigma in grid])
    best = np.argmin(rmse_grid)
    assert result.is_converged
    assert result.rmse <= rmse_grid[best]
    assert grid[best - 1] < result.sigma < grid[best + 1]


@pytest.mark.parametrize("tune_regularization", [False, True])
@pytest.mark.parametrize("sigma0", [2.0, [2.0, 2.0, 2.0]])
def test_descent_lowers_the_error_at_every_step_and_the_path_tells_the_truth(
    validation_data, sigma0, tune_regularization, validation_error
):
    result = tune_by_descent(
        ValidationLoss(*validation_data),
        sigma0=sigma0,
        regularization=0.1,
        tune_regularization=tune_regularization,
        max_steps=15,
    )
    n_points = len(result.rmse_path)
    assert 3 < n_points <= 16
    assert np.all(np.diff(result.rmse_path) < 0)
    assert result.sigma_path.shape == (n_points, *np.shape(sigma0))
    np.testing.assert_allclose(result.sigma_path[0], sigma0, rtol=1e-14)
    np.testing.assert_allclose(result.regularization_path[0], 0.1, rtol=1e-14)
    assert np.all(result.regularization_path == 0.1) != tune_regularization
    for i in range(n_points):
        error = validation_error(
            validation_data, sigma=result.sigma_path[i], regularization=result.regularization_path[i]
        )
        np.testing.assert_allclose(result.rmse_path[i], np.sqrt(error), rtol=1e-8)
    np.testing.assert_array_equal(result.sigma, result.sigma_path[-1])
    assert result.regularization == result.regularization_path[-1]
    assert result.rmse == result.rmse_path[-1]


@pytest.mark.parametrize("sigma0", [0.02, 0.1, 5.0])
def test_no_step_changes_sigma_by_more_than_a_factor_e(validation_data, sigma0):
    path = tune_by_descent(
        ValidationLoss(*validation_data), sigma0=sigma0, regularization=1e-3, max_steps=10
    ).sigma_path
    assert np.max(np.abs(np.diff(np.log(path)))) <= 1.0 + 1e-12


def test_more_freedom_lowers_the_error(validation_data):
    loss = ValidationLoss(*validation_data)
    one = tune_by_descent(loss, sigma0=1.0, regularization=0.1)
    three = tune_by_descent(loss, sigma0=[one.sigma] * 3, regularization=0.1)
    all_four = tune_by_descent(loss, sigma0=three.sigma, regularization=0.1, tune_regularization=True)
    assert one.rmse > three.rmse > all_four.rmse


def test_descent_gives_an_input_that_does_not_matter_the_widest_sigma(validation_data):
    result = tune_by_descent(ValidationLoss(*validation_data), sigma0=[0.5, 0.5, 0.5], regularization=1e-3)
    assert result.sigma[1] > 2 * max(result.sigma[0], result.sigma[2])


def test_descent_does_not_depend_on_units(validation_data):
    X, y, X_validation, y_validation = validation_data
    one = tune_by_descent(ValidationLoss(*validation_data), regularization=1e-3)
    loss = ValidationLoss(10 * X, 100 * y - 3, 10 * X_validation, 100 * y_validation - 3)
    other = tune_by_descent(loss, regularization=1e-3)
    np.testing.assert_allclose(other.sigma, one.sigma, rtol=1e-4)
    np.testing.assert_allclose(other.rmse, 100 * one.rmse, rtol=1e-6)


def test_descent_takes_bitwise_the_same_path_again(validation_data):
    one, other = (
        tune_by_descent(ValidationLoss(*validation_data), sigma0=[1.0, 1.0, 1.0], regularization=1e-3) for _ in range(2)
    )
    np.testing.assert_array_equal(one.sigma_path, other.sigma_path)
    np.testing.assert_array_equal(one.rmse_path, other.rmse_path)


def test_descent_reports_running_out_of_steps(validation_data):
    result = tune_by_descent(ValidationLoss(*validation_data), sigma0=2.0, regularization=1e-3, max_steps=1)
    assert len(result.rmse_path) == 2
    assert not result.is_converged


def test_start_at_the_minimum_stays_there(validation_data):
    best = tune_by_descent(ValidationLoss(*validation_data), regularization=1e-3)
    again = tune_by_descent(ValidationLoss(*validation_data), sigma0=best.sigma, regularization=1e-3)
    assert again.is_converged
    np.testing.assert_allclose(again.sigma_path, [best.sigma])


def test_perfect_validation_error_ends_the_descent(sample):
    X, X_validation = sample(20)[0], sample(10, seed=1)[0]
    result = tune_by_descent(ValidationLoss(X, np.full(20, 3.0), X_validation, np.full(10, 3.0)))
    assert result.is_converged
    assert result.rmse < 1e-12


def test_descent_stays_clear_of_singular_kernels():
    # A straight line is fitted best by ever wider kernels, until the kernel matrix is singular.
    X, X_validation = np.linspace(0, 1, 40)[:, np.newaxis], np.linspace(0.01, 0.99, 23)[:, np.newaxis]
    loss = ValidationLoss(X, X[:, 0], X_validation, X_validation[:, 0])
    result = tune_by_descent(loss, sigma0=0.05, regularization=0.0)
    assert np.all(np.diff(result.rmse_path) < 0)
    assert result.rmse < 0.1 * result.rmse_path[0]
    KernelRidge(sigma=result.sigma, regularization=0.0).fit(X, X[:, 0])


def test_singular_start_says_what_to_do(validation_data):
    with pytest.raises(np.linalg.LinAlgError, match="raise regularization"):
        tune_by_descent(ValidationLoss(*validation_data), sigma0=100.0, regularization=0.0)


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({"sigma0": -1.0}, r"sigma0=-1\.0 is not allowed.*> 0.*pass for example sigma0="),
        ({"sigma0": [1.0, 1.0]}, r"sigma0=\[1\.0, 1\.0\] is not allowed.*each of the 3 inputs"),
        ({"regularization": -1.0}, r"regularization=-1\.0 is not allowed"),
        ({"regularization": 0, "tune_regularization": True}, r"regularization=0 .*> 0; pass for example"),
    ],
)
def test_descent_names_a_wrong_parameter_with_what_is_allowed(validation_data, options, message):
    with pytest.raises(ValueError, match=message):
        tune_by_descent(ValidationLoss(*validation_data), **options)


# --- L-BFGS-B, on the leave-one-out error


@pytest.mark.parametrize("sigma0", [0.5, [0.5, 0.5, 0.5]])
def test_lbfgs_ends_where_no_neighbour_is_better(data, sigma0):
    loss = LeaveOneOutLoss(*data)
    result = tune_by_lbfgs(loss, sigma0=sigma0)
    assert result.is_converged
    best = np.append(result.sigma, result.regularization)
    lower, upper = np.transpose([SIGMA_BOUNDS] * np.size(sigma0) + [REGULARIZATION_BOUNDS])
    for factor in np.concatenate([0.95 + 0.05 * (1 - np.eye(best.size)), 1.05 - 0.05 * (1 - np.eye(best.size))]):
        *sigma, lam = best * factor
        if np.all((lower <= best * factor) & (best * factor <= upper)):
            assert loss(np.reshape(sigma, np.shape(sigma0)), lam).rmse > result.rmse


@pytest.mark.slow
@pytest.mark.parametrize("sigma0", [0.5, 1.0])
def test_lbfgs_reaches_the_minimum_of_a_grid(sigma0, sample):
    loss = LeaveOneOutLoss(*sample(60))
    result = tune_by_lbfgs(loss, sigma0=sigma0)
    grid = [loss(sigma, lam).rmse for sigma in np.geomspace(0.1, 10.0, 15) for lam in np.geomspace(1e-8, 1.0, 12)]
    assert result.rmse <= min(grid)


@pytest.mark.parametrize("sigma0", [2.0, [2.0, 2.0, 2.0]])
def test_lbfgs_lowers_the_error_at_every_step_and_the_path_tells_the_truth(data, sigma0):
    loss = LeaveOneOutLoss(*data)
    result = tune_by_lbfgs(loss, sigma0=sigma0, regularization0=0.1)
    n_points = len(result.rmse_path)
    assert n_points > 3
    assert np.all(np.diff(result.rmse_path) < 0)
    assert result.sigma_path.shape == (n_points, *np.shape(sigma0))
    np.testing.assert_allclose(result.sigma_path[0], sigma0, rtol=1e-14)
    np.testing.assert_allclose(result.regularization_path[0], 0.1, rtol=1e-14)
    for i in range(n_points):
        error = loss(result.sigma_path[i], result.regularization_path[i])
        np.testing.assert_allclose(result.rmse_path[i], error.rmse, rtol=1e-12)
    np.testing.assert_array_equal(result.sigma, result.sigma_path[-1])
    assert result.regularization == result.regularization_path[-1]
    assert result.rmse == result.rmse_path[-1]


@pytest.mark.parametrize("noise", [0.03, 0.3])
def test_regularization_is_the_squared_ratio_of_noise_to_signal(noise):
    # Targets drawn from the kernel's own Gaussian process of unit variance: λ is then the variance of the noise.
    rng = np.random.default_rng(1)
    Z = rng.uniform(size=(250, 3))
    K = np.exp(-np.sum((Z[:, np.newaxis] - Z) ** 2, axis=2) / 0.6**2)
    signal = np.linalg.cholesky(K + 1e-10 * np.eye(250)) @ rng.normal(size=250)
    y = signal + noise * rng.normal(size=250)
    loss = LeaveOneOutLoss(Z, y, input_bounds=(0, 1), center_targets=False)
    result = tune_by_lbfgs(loss, sigma0=[0.4] * 3)
    assert 0.5 < result.regularization / noise**2 < 2
    np.testing.assert_allclose(np.log(result.sigma / 0.6), 0.0, atol=np.log(2))


def test_regularization_grows_with_the_noise(sample):
    chosen = [
        tune_by_lbfgs(LeaveOneOutLoss(*sample(120, noise)), sigma0=[0.5] * 3).regularization
        for noise in (0.0, 0.01, 0.1, 1.0)
    ]
    assert chosen == sorted(chosen)
    assert chosen[-1] > 1e6 * chosen[0]


def test_lbfgs_gives_an_input_that_does_not_matter_the_widest_sigma(data):
    result = tune_by_lbfgs(LeaveOneOutLoss(*data), sigma0=[0.5, 0.5, 0.5])
    assert result.sigma[1] > 2 * max(result.sigma[0], result.sigma[2])


def test_lbfgs_does_not_depend_on_units(data):
    X, y = data
    one = tune_by_lbfgs(LeaveOneOutLoss(X, y))
    other = tune_by_lbfgs(LeaveOneOutLoss(10 * X, 1000 * y - 3))
    np.testing.assert_allclose(other.sigma, one.sigma, rtol=1e-4)
    np.testing.assert_allclose(other.rmse, 1000 * one.rmse, rtol=1e-8)


def test_lbfgs_takes_bitwise_the_same_path_again(data):
    one, other = (tune_by_lbfgs(LeaveOneOutLoss(*data), sigma0=[1.0, 1.0, 1.0]) for _ in range(2))
    np.testing.assert_array_equal(one.sigma_path, other.sigma_path)
    np.testing.assert_array_equal(one.rmse_path, other.rmse_path)


def test_lbfgs_reports_running_out_of_steps(data):
    result = tune_by_lbfgs(LeaveOneOutLoss(*data), max_steps=1)
    assert len(result.rmse_path) == 2
    assert not result.is_converged


def test_perfect_fit_ends_lbfgs(sample):
    result = tune_by_lbfgs(LeaveOneOutLoss(sample(20)[0], np.full(20, 3.0)))
    assert result.is_converged
    assert result.rmse < 1e-12


def test_parameters_stay_within_their_bounds_where_nothing_can_be_learned(sample):
    # Pure noise wants λ without end; a straight line and duplicates want ever wider kernels.
    X, rng = sample(60)[0], np.random.default_rng(5)
    noise = tune_by_lbfgs(LeaveOneOutLoss(X, rng.normal(size=60)))
    assert noise.rmse == pytest.approx(1.0, abs=0.3)
    twice = np.vstack([X, X])
    line = tune_by_lbfgs(LeaveOneOutLoss(twice, twice @ [1.0, 2.0, 0.01]), sigma0=[1.0] * 3)
    for result in (noise, line):
        assert np.all((result.sigma_path > 0.0299) & (result.sigma_path < 30.1))
        assert np.all((result.regularization_path > 0.99e-10) & (result.regularization_path < 10.1))
    assert line.rmse < 1e-3


def test_lbfgs_turns_back_from_singular_matrices(monkeypatch, sample):
    factorize = losses.factorize
    refused = []

    def picky(K, regularization):
        if regularization < 3e-3:
            refused.append(regularization)
            raise np.linalg.LinAlgError
        return factorize(K, regularization)

    X, y = sample(60, noise=0.0)
    monkeypatch.setattr(losses, "factorize", picky)
    # Whatever the units: a large error is better than a singular matrix.
    result = tune_by_lbfgs(LeaveOneOutLoss(X, 1e9 * y), regularization0=0.1)
    assert refused
    assert np.all(result.regularization_path >= 3e-3)
    assert result.rmse < result.rmse_path[0]
    assert not result.is_converged


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({"sigma0": -1.0}, r"sigma0=-1\.0 is not allowed.*> 0.*pass for example sigma0="),
        ({"sigma0": 100.0}, r"sigma0=100\.0 is not allowed.*between 0\.03 and 30"),
        ({"sigma0": [1.0, 1.0]}, r"sigma0=\[1\.0, 1\.0\] is not allowed.*each of the 3 inputs"),
        ({"regularization0": -1.0}, r"regularization=-1\.0 is not allowed"),
        ({"regularization0": 0.0}, r"regularization0=0\.0 is not allowed.*between 1e-10 and 10"),
    ],
)
def test_lbfgs_names_a_wrong_parameter_with_what_is_allowed(data, options, message):
    with pytest.raises(ValueError, match=message):
        tune_by_lbfgs(LeaveOneOutLoss(*data), **options)


def test_lbfgs_runs_in_one_thread(monkeypatch):
    events = []
    evaluate = LeaveOneOutLoss._evaluate

    @contextmanager
    def one_thread():
        events.append("one thread")
        yield
        events.append("end")

    monkeypatch.setattr(hyperparameters, "one_thread", one_thread)
    monkeypatch.setattr(LeaveOneOutLoss, "_evaluate", lambda *args: events.append("loss") or evaluate(*args))
    X = np.random.default_rng(0).uniform(size=(20, 2))
    tune_by_lbfgs(LeaveOneOutLoss(X, X.sum(axis=1)), max_steps=3)
    assert (events[0], events[-1]) == ("one thread", "end")
    assert set(events[1:-1]) == {"loss"}
