import numpy as np
import pytest

from wam_cast.learning.kernel_ridge import KernelRidge
from wam_cast.learning.tuning import tune_sigma, validation_error_gradient

LOWER = np.array([0.1, -2.0, 0.0])
UPPER = np.array([0.4, 3.0, 700.0])


def noisy_sample(n, seed, n_outputs=None):
    """Draw inputs and noisy targets that depend on the first input most and on the second not at all."""
    rng = np.random.default_rng(seed)
    Z = rng.uniform(size=(n, 3))
    y = np.column_stack([5.0 + np.sin(6 * Z[:, 0]) + np.cos(2 * Z[:, 2]), Z[:, 0] * Z[:, 2]])
    y += 0.02 * rng.normal(size=y.shape)
    return LOWER + Z * (UPPER - LOWER), y[:, 0] if n_outputs is None else y[:, :n_outputs]


@pytest.fixture(params=[None, 1, 2])
def data(request):
    return *noisy_sample(80, 0, request.param), *noisy_sample(40, 1, request.param)


def mean_squared_error(data, **parameters):
    """The loss by its definition: refit and predict."""
    X, y, X_validation, y_validation = data
    residuals = KernelRidge(**parameters).fit(X, y).predict(X_validation) - y_validation
    return np.sum(residuals**2) / len(residuals)


@pytest.mark.parametrize("sigma", [0.4, [0.3, 0.8, 0.5]])
@pytest.mark.parametrize(
    "options", [{}, {"center_targets": False}, {"input_bounds": (LOWER, 2 * UPPER)}], ids=str
)
def test_loss_is_that_of_the_estimator_and_its_gradient_equals_differences(data, sigma, options):
    lam, h = 1e-3, 1e-5
    loss = validation_error_gradient(*data, sigma=sigma, regularization=lam, **options)

    def at(log_sigma_move=0.0, log_lambda_move=0.0):
        return mean_squared_error(
            data,
            sigma=np.asarray(sigma) * np.exp(log_sigma_move),
            regularization=lam * np.exp(log_lambda_move),
            **options,
        )

    moves = np.eye(3) * h if np.ndim(sigma) else [h]
    by_log_sigma = np.reshape([(at(move) - at(-move)) / (2 * h) for move in moves], np.shape(sigma))
    by_log_lambda = (at(log_lambda_move=h) - at(log_lambda_move=-h)) / (2 * h)

    np.testing.assert_allclose(loss.mean_squared, at(), rtol=1e-9)
    np.testing.assert_allclose(loss.rmse, np.sqrt(at()), rtol=1e-9)
    assert loss.d_log_sigma.shape == np.shape(sigma)
    np.testing.assert_allclose(loss.d_log_sigma, by_log_sigma, rtol=1e-5, atol=1e-9)
    np.testing.assert_allclose(loss.d_log_regularization, by_log_lambda, rtol=1e-5, atol=1e-9)


def test_loss_of_several_outputs_adds_up():
    X, y = noisy_sample(80, 0, 2)
    X_validation, y_validation = noisy_sample(40, 1, 2)

    def mean_squared(columns):
        return validation_error_gradient(
            X, y[:, columns], X_validation, y_validation[:, columns], sigma=0.4, regularization=1e-3
        ).mean_squared

    np.testing.assert_allclose(mean_squared([0, 1]), mean_squared([0]) + mean_squared([1]), rtol=1e-9)


@pytest.mark.parametrize("sigma0", [0.15, 1.0, 3.0])
def test_descent_reaches_the_minimum_of_a_dense_grid(data, sigma0):
    result = tune_sigma(*data, sigma0=sigma0, regularization=1e-3)
    grid = np.geomspace(0.1, 4.0, 150)
    rmse_grid = np.sqrt([mean_squared_error(data, sigma=sigma, regularization=1e-3) for sigma in grid])
    best = np.argmin(rmse_grid)
    assert result.is_converged
    assert result.rmse <= rmse_grid[best]
    assert grid[best - 1] < result.sigma < grid[best + 1]


@pytest.mark.parametrize("tune_regularization", [False, True])
@pytest.mark.parametrize("sigma0", [2.0, [2.0, 2.0, 2.0]])
def test_error_falls_at_every_step_and_the_path_tells_the_truth(data, sigma0, tune_regularization):
    result = tune_sigma(
        *data, sigma0=sigma0, regularization=0.1, tune_regularization=tune_regularization, max_steps=15
    )
    n_points = len(result.rmse_path)
    assert 3 < n_points <= 16
    assert np.all(np.diff(result.rmse_path) < 0)
    assert result.sigma_path.shape == (n_points, *np.shape(sigma0))
    np.testing.assert_allclose(result.sigma_path[0], sigma0, rtol=1e-14)
    np.testing.assert_allclose(result.regularization_path[0], 0.1, rtol=1e-14)
    assert np.all(result.regularization_path == 0.1) != tune_regularization
    for i in range(n_points):
        error = mean_squared_error(
            data, sigma=result.sigma_path[i], regularization=result.regularization_path[i]
        )
        np.testing.assert_allclose(result.rmse_path[i], np.sqrt(error), rtol=1e-8)
    np.testing.assert_array_equal(result.sigma, result.sigma_path[-1])
    assert result.regularization == result.regularization_path[-1]
    assert result.rmse == result.rmse_path[-1]


@pytest.mark.parametrize("sigma0", [0.02, 0.1, 5.0])
def test_no_step_changes_sigma_by_more_than_a_factor_e(data, sigma0):
    path = tune_sigma(*data, sigma0=sigma0, regularization=1e-3, max_steps=10).sigma_path
    assert np.max(np.abs(np.diff(np.log(path)))) <= 1.0 + 1e-12


def test_more_freedom_lowers_the_error(data):
    one = tune_sigma(*data, sigma0=1.0, regularization=0.1)
    three = tune_sigma(*data, sigma0=[one.sigma] * 3, regularization=0.1)
    all_four = tune_sigma(*data, sigma0=three.sigma, regularization=0.1, tune_regularization=True)
    assert one.rmse > three.rmse > all_four.rmse


def test_input_that_does_not_matter_gets_the_widest_sigma(data):
    result = tune_sigma(*data, sigma0=[0.5, 0.5, 0.5], regularization=1e-3)
    assert result.sigma[1] > 2 * max(result.sigma[0], result.sigma[2])


def test_units_do_not_matter(data):
    X, y, X_validation, y_validation = data
    one = tune_sigma(*data, regularization=1e-3)
    other = tune_sigma(10 * X, 100 * y - 3, 10 * X_validation, 100 * y_validation - 3, regularization=1e-3)
    np.testing.assert_allclose(other.sigma, one.sigma, rtol=1e-4)
    np.testing.assert_allclose(other.rmse, 100 * one.rmse, rtol=1e-6)


def test_same_data_gives_bitwise_the_same_path(data):
    one, other = (tune_sigma(*data, sigma0=[1.0, 1.0, 1.0], regularization=1e-3) for _ in range(2))
    np.testing.assert_array_equal(one.sigma_path, other.sigma_path)
    np.testing.assert_array_equal(one.rmse_path, other.rmse_path)


def test_running_out_of_steps_is_reported(data):
    result = tune_sigma(*data, sigma0=2.0, regularization=1e-3, max_steps=1)
    assert len(result.rmse_path) == 2
    assert not result.is_converged


def test_start_at_the_minimum_stays_there(data):
    best = tune_sigma(*data, regularization=1e-3)
    again = tune_sigma(*data, sigma0=best.sigma, regularization=1e-3)
    assert again.is_converged
    np.testing.assert_allclose(again.sigma_path, [best.sigma])


def test_perfect_validation_error_ends_the_descent():
    X, X_validation = noisy_sample(20, 0)[0], noisy_sample(10, 1)[0]
    result = tune_sigma(X, np.full(20, 3.0), X_validation, np.full(10, 3.0))
    assert result.is_converged
    assert result.rmse < 1e-12


def test_descent_stays_clear_of_singular_kernels():
    # A straight line is fitted best by ever wider kernels, until the kernel matrix is singular.
    X, X_validation = np.linspace(0, 1, 40)[:, np.newaxis], np.linspace(0.01, 0.99, 23)[:, np.newaxis]
    result = tune_sigma(X, X[:, 0], X_validation, X_validation[:, 0], sigma0=0.05, regularization=0.0)
    assert np.all(np.diff(result.rmse_path) < 0)
    assert result.rmse < 0.1 * result.rmse_path[0]
    KernelRidge(sigma=result.sigma, regularization=0.0).fit(X, X[:, 0])


def test_singular_start_says_what_to_do(data):
    with pytest.raises(np.linalg.LinAlgError, match="raise regularization"):
        tune_sigma(*data, sigma0=100.0, regularization=0.0)


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({"sigma0": -1.0}, r"sigma0=-1\.0 is not allowed.*> 0.*pass for example sigma0="),
        ({"sigma0": [1.0, 1.0]}, r"sigma0=\[1\.0, 1\.0\] is not allowed.*each of the 3 inputs"),
        ({"regularization": -1.0}, r"regularization=-1\.0 is not allowed"),
        ({"regularization": 0, "tune_regularization": True}, r"regularization=0 .*> 0; pass for example"),
        ({"input_bounds": (1, 0)}, r"input_bounds=\(1, 0\) is not allowed"),
    ],
)
def test_wrong_parameter_is_named_with_what_is_allowed(data, options, message):
    with pytest.raises(ValueError, match=message):
        tune_sigma(*data, **options)


def test_wrong_sigma_of_the_gradient_is_named(data):
    with pytest.raises(ValueError, match=r"sigma=nan is not allowed"):
        validation_error_gradient(*data, sigma=np.nan, regularization=1e-3)
    with pytest.raises(ValueError, match=r"regularization=-1 is not allowed"):
        validation_error_gradient(*data, sigma=1.0, regularization=-1)


def test_validation_data_of_another_shape_is_named():
    X, y = noisy_sample(20, 0)
    with pytest.raises(ValueError, match=r"X_validation is \(20, 2\).*X_train is \(20, 3\)"):
        tune_sigma(X, y, X[:, :2], y)
    with pytest.raises(ValueError, match=r"y_validation \(20, 1\).*y_train \(20,\)"):
        tune_sigma(X, y, X, y[:, np.newaxis])
