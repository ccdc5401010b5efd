from contextlib import contextmanager

import numpy as np
import pytest
from sklearn.base import clone

from wam_cast.learning import leave_one_out
from wam_cast.learning.kernel_ridge import KernelRidge
from wam_cast.learning.leave_one_out import (
    REGULARIZATION_BOUNDS,
    SIGMA_BOUNDS,
    leave_one_out_error_gradient,
    tune_by_leave_one_out,
)

LOWER = np.array([0.1, -2.0, 0.0])
UPPER = np.array([0.4, 3.0, 700.0])


def sample(n, noise=0.02, n_outputs=None, seed=0):
    """Draw inputs and targets that depend on the first input most and on the second not at all."""
    rng = np.random.default_rng(seed)
    Z = rng.uniform(size=(n, 3))
    y = np.column_stack([5.0 + np.sin(6 * Z[:, 0]) + np.cos(2 * Z[:, 2]), Z[:, 0] * Z[:, 2]])
    y += noise * rng.normal(size=y.shape)
    return LOWER + Z * (UPPER - LOWER), y[:, 0] if n_outputs is None else y[:, :n_outputs]


@pytest.fixture(params=[None, 1, 2])
def data(request):
    return sample(60, n_outputs=request.param)


def mean_squared_error(X, y, **parameters):
    """The loss by its definition: refits to all rows but one."""
    model = KernelRidge(**parameters)
    residuals = []
    for i in range(len(X)):
        others = np.arange(len(X)) != i
        residuals.append(y[i] - clone(model).fit(X[others], y[others]).predict(X[[i]])[0])
    return np.sum(np.square(residuals)) / len(X)


@pytest.mark.parametrize("sigma", [0.4, [0.3, 0.8, 0.5]])
@pytest.mark.parametrize("center_targets", [True, False])
def test_loss_equals_refits_and_its_gradient_equals_differences(data, sigma, center_targets):
    lam, h = 1e-3, 1e-5
    options = {"input_bounds": (LOWER, UPPER), "center_targets": center_targets}
    loss = leave_one_out_error_gradient(*data, sigma=sigma, regularization=lam, **options)
    refits = mean_squared_error(*data, sigma=sigma, regularization=lam, **options)
    np.testing.assert_allclose(loss.mean_squared, refits, rtol=1e-10)

    def at(log_sigma_move=0.0, log_lambda_move=0.0):
        model = KernelRidge(
            sigma=np.asarray(sigma) * np.exp(log_sigma_move),
            regularization=lam * np.exp(log_lambda_move),
            **options,
        )
        return np.sum(model.fit(*data).leave_one_out_residuals() ** 2) / len(data[0])

    moves = np.eye(3) * h if np.ndim(sigma) else [h]
    by_log_sigma = np.reshape([(at(move) - at(-move)) / (2 * h) for move in moves], np.shape(sigma))
    by_log_lambda = (at(log_lambda_move=h) - at(log_lambda_move=-h)) / (2 * h)
    assert loss.d_log_sigma.shape == np.shape(sigma)
    np.testing.assert_allclose(loss.d_log_sigma, by_log_sigma, rtol=1e-6, atol=1e-9)
    np.testing.assert_allclose(loss.d_log_regularization, by_log_lambda, rtol=1e-6, atol=1e-9)


def test_loss_of_several_outputs_adds_up():
    X, y = sample(60, n_outputs=2)

    def loss(columns):
        return leave_one_out_error_gradient(X, y[:, columns], sigma=[0.3, 0.8, 0.5], regularization=1e-3)

    both, one, other = loss([0, 1]), loss([0]), loss([1])
    np.testing.assert_allclose(both.mean_squared, one.mean_squared + other.mean_squared, rtol=1e-10)
    np.testing.assert_allclose(both.d_log_sigma, one.d_log_sigma + other.d_log_sigma, rtol=1e-9)


@pytest.mark.parametrize("sigma0", [0.5, [0.5, 0.5, 0.5]])
def test_search_ends_where_no_neighbour_is_better(data, sigma0):
    result = tune_by_leave_one_out(*data, sigma0=sigma0)
    assert result.is_converged
    best = np.append(result.sigma, result.regularization)
    lower, upper = np.transpose([SIGMA_BOUNDS] * np.size(sigma0) + [REGULARIZATION_BOUNDS])
    for factor in np.concatenate(
        [0.95 + 0.05 * (1 - np.eye(best.size)), 1.05 - 0.05 * (1 - np.eye(best.size))]
    ):
        *sigma, lam = best * factor
        if np.all((lower <= best * factor) & (best * factor <= upper)):
            neighbour = leave_one_out_error_gradient(
                *data, sigma=np.reshape(sigma, np.shape(sigma0)), regularization=lam
            )
            assert neighbour.rmse > result.rmse


@pytest.mark.slow
@pytest.mark.parametrize("sigma0", [0.5, 1.0])
def test_search_reaches_the_minimum_of_a_grid(sigma0):
    data = sample(60)
    result = tune_by_leave_one_out(*data, sigma0=sigma0)
    grid = [
        leave_one_out_error_gradient(*data, sigma=sigma, regularization=lam).rmse
        for sigma in np.geomspace(0.1, 10.0, 15)
        for lam in np.geomspace(1e-8, 1.0, 12)
    ]
    assert result.rmse <= min(grid)


@pytest.mark.parametrize("sigma0", [2.0, [2.0, 2.0, 2.0]])
def test_error_falls_at_every_step_and_the_path_tells_the_truth(data, sigma0):
    result = tune_by_leave_one_out(*data, sigma0=sigma0, regularization0=0.1)
    n_points = len(result.rmse_path)
    assert n_points > 3
    assert np.all(np.diff(result.rmse_path) < 0)
    assert result.sigma_path.shape == (n_points, *np.shape(sigma0))
    np.testing.assert_allclose(result.sigma_path[0], sigma0, rtol=1e-14)
    np.testing.assert_allclose(result.regularization_path[0], 0.1, rtol=1e-14)
    for i in range(n_points):
        loss = leave_one_out_error_gradient(
            *data, sigma=result.sigma_path[i], regularization=result.regularization_path[i]
        )
        np.testing.assert_allclose(result.rmse_path[i], loss.rmse, rtol=1e-12)
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
    result = tune_by_leave_one_out(Z, y, sigma0=[0.4] * 3, input_bounds=(0, 1), center_targets=False)
    assert 0.5 < result.regularization / noise**2 < 2
    np.testing.assert_allclose(np.log(result.sigma / 0.6), 0.0, atol=np.log(2))


def test_regularization_grows_with_the_noise():
    chosen = [
        tune_by_leave_one_out(*sample(120, noise), sigma0=[0.5] * 3).regularization
        for noise in (0.0, 0.01, 0.1, 1.0)
    ]
    assert chosen == sorted(chosen)
    assert chosen[-1] > 1e6 * chosen[0]


def test_input_that_does_not_matter_gets_the_widest_sigma(data):
    result = tune_by_leave_one_out(*data, sigma0=[0.5, 0.5, 0.5])
    assert result.sigma[1] > 2 * max(result.sigma[0], result.sigma[2])


def test_units_do_not_matter(data):
    X, y = data
    one = tune_by_leave_one_out(X, y)
    other = tune_by_leave_one_out(10 * X, 1000 * y - 3)
    np.testing.assert_allclose(other.sigma, one.sigma, rtol=1e-4)
    np.testing.assert_allclose(other.rmse, 1000 * one.rmse, rtol=1e-8)


def test_same_data_gives_bitwise_the_same_path(data):
    one, other = (tune_by_leave_one_out(*data, sigma0=[1.0, 1.0, 1.0]) for _ in range(2))
    np.testing.assert_array_equal(one.sigma_path, other.sigma_path)
    np.testing.assert_array_equal(one.rmse_path, other.rmse_path)


def test_running_out_of_steps_is_reported(data):
    result = tune_by_leave_one_out(*data, max_steps=1)
    assert len(result.rmse_path) == 2
    assert not result.is_converged


def test_perfect_fit_ends_the_search():
    result = tune_by_leave_one_out(sample(20)[0], np.full(20, 3.0))
    assert result.is_converged
    assert result.rmse < 1e-12


def test_parameters_stay_within_their_bounds_where_nothing_can_be_learned():
    # Pure noise wants λ without end; a straight line and duplicates want ever wider kernels.
    X, rng = sample(60)[0], np.random.default_rng(5)
    noise = tune_by_leave_one_out(X, rng.normal(size=60))
    assert noise.rmse == pytest.approx(1.0, abs=0.3)
    twice = np.vstack([X, X])
    line = tune_by_leave_one_out(twice, twice @ [1.0, 2.0, 0.01], sigma0=[1.0] * 3)
    for result in (noise, line):
        assert np.all((result.sigma_path > 0.0299) & (result.sigma_path < 30.1))
        assert np.all((result.regularization_path > 0.99e-10) & (result.regularization_path < 10.1))
    assert line.rmse < 1e-3


def test_search_turns_back_from_singular_matrices(monkeypatch):
    factorize = leave_one_out.factorize
    refused = []

    def picky(K, regularization):
        if regularization < 3e-3:
            refused.append(regularization)
            raise np.linalg.LinAlgError
        return factorize(K, regularization)

    X, y = sample(60, noise=0.0)
    monkeypatch.setattr(leave_one_out, "factorize", picky)
    # Whatever the units: a large error is better than a singular matrix.
    result = tune_by_leave_one_out(X, 1e9 * y, regularization0=0.1)
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
        ({"input_bounds": (1, 0)}, r"input_bounds=\(1, 0\) is not allowed"),
    ],
)
def test_wrong_parameter_is_named_with_what_is_allowed(data, options, message):
    with pytest.raises(ValueError, match=message):
        tune_by_leave_one_out(*data, **options)


def test_one_row_is_refused():
    with pytest.raises(ValueError, match=r"n_samples=1 .* at least 2"):
        tune_by_leave_one_out([[1.0, 2.0]], [3.0])


def test_the_search_runs_in_one_thread(monkeypatch):
    events = []
    loss = leave_one_out._TrainingData.loss

    @contextmanager
    def limits(number):
        events.append(number)
        yield
        events.append("end")

    monkeypatch.setattr(leave_one_out, "threadpool_limits", limits)
    monkeypatch.setattr(
        leave_one_out._TrainingData, "loss", lambda *args: events.append("loss") or loss(*args)
    )
    X = np.random.default_rng(0).uniform(size=(20, 2))
    tune_by_leave_one_out(X, X.sum(axis=1), max_steps=3)
    assert (events[0], events[-1]) == (1, "end")
    assert set(events[1:-1]) == {"loss"}
