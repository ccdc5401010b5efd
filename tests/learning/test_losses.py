"""The losses that hyperparameters are chosen by: they are what they say, and so are their gradients."""

import numpy as np
import pytest
from sklearn.base import clone

from wam_cast.learning.kernel_ridge import KernelRidge
from wam_cast.learning.losses import LeaveOneOutLoss, ValidationLoss

LOWER = np.array([0.1, -2.0, 0.0])
UPPER = np.array([0.4, 3.0, 700.0])


# --- on validation data


@pytest.mark.parametrize("sigma", [0.4, [0.3, 0.8, 0.5]])
@pytest.mark.parametrize("options", [{}, {"center_targets": False}, {"input_bounds": (LOWER, 2 * UPPER)}], ids=str)
def test_validation_loss_is_that_of_the_estimator_and_its_gradient_equals_differences(
    validation_data, sigma, options, validation_error
):
    lam, h = 1e-3, 1e-5
    loss = ValidationLoss(*validation_data, **options)(sigma, lam)

    def at(log_sigma_move=0.0, log_lambda_move=0.0):
        return validation_error(
            validation_data,
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


def test_validation_loss_of_several_outputs_adds_up(sample):
    X, y = sample(80, n_outputs=2)
    X_validation, y_validation = sample(40, n_outputs=2, seed=1)

    def mean_squared(columns):
        loss = ValidationLoss(X, y[:, columns], X_validation, y_validation[:, columns])
        return loss(0.4, 1e-3).mean_squared

    np.testing.assert_allclose(mean_squared([0, 1]), mean_squared([0]) + mean_squared([1]), rtol=1e-9)


def test_validation_data_of_another_shape_is_named(sample):
    X, y = sample(20)
    with pytest.raises(ValueError, match=r"X_validation is \(20, 2\).*X_train is \(20, 3\)"):
        ValidationLoss(X, y, X[:, :2], y)
    with pytest.raises(ValueError, match=r"y_validation \(20, 1\).*y_train \(20,\)"):
        ValidationLoss(X, y, X, y[:, np.newaxis])


# --- leave one out


def leave_one_out_error(X, y, **parameters):
    """The loss by its definition: refits to all rows but one."""
    model = KernelRidge(**parameters)
    residuals = []
    for i in range(len(X)):
        others = np.arange(len(X)) != i
        residuals.append(y[i] - clone(model).fit(X[others], y[others]).predict(X[[i]])[0])
    return np.sum(np.square(residuals)) / len(X)


@pytest.mark.parametrize("sigma", [0.4, [0.3, 0.8, 0.5]])
@pytest.mark.parametrize("center_targets", [True, False])
def test_leave_one_out_loss_equals_refits_and_its_gradient_equals_differences(data, sigma, center_targets):
    lam, h = 1e-3, 1e-5
    options = {"input_bounds": (LOWER, UPPER), "center_targets": center_targets}
    loss = LeaveOneOutLoss(*data, **options)(sigma, lam)
    refits = leave_one_out_error(*data, sigma=sigma, regularization=lam, **options)
    np.testing.assert_allclose(loss.mean_squared, refits, rtol=1e-10)

    def at(log_sigma_move=0.0, log_lambda_move=0.0):
        model = KernelRidge(
            sigma=np.asarray(sigma) * np.exp(log_sigma_move), regularization=lam * np.exp(log_lambda_move), **options
        )
        return np.sum(model.fit(*data).leave_one_out_residuals() ** 2) / len(data[0])

    moves = np.eye(3) * h if np.ndim(sigma) else [h]
    by_log_sigma = np.reshape([(at(move) - at(-move)) / (2 * h) for move in moves], np.shape(sigma))
    by_log_lambda = (at(log_lambda_move=h) - at(log_lambda_move=-h)) / (2 * h)
    assert loss.d_log_sigma.shape == np.shape(sigma)
    np.testing.assert_allclose(loss.d_log_sigma, by_log_sigma, rtol=1e-6, atol=1e-9)
    np.testing.assert_allclose(loss.d_log_regularization, by_log_lambda, rtol=1e-6, atol=1e-9)


def test_leave_one_out_loss_of_several_outputs_adds_up(sample):
    X, y = sample(60, n_outputs=2)

    def loss(columns):
        return LeaveOneOutLoss(X, y[:, columns])([0.3, 0.8, 0.5], 1e-3)

    both, one, other = loss([0, 1]), loss([0]), loss([1])
    np.testing.assert_allclose(both.mean_squared, one.mean_squared + other.mean_squared, rtol=1e-10)
    np.testing.assert_allclose(both.d_log_sigma, one.d_log_sigma + other.d_log_sigma, rtol=1e-9)


def test_one_row_is_refused():
    with pytest.raises(ValueError, match=r"n_samples=1 .* at least 2"):
        LeaveOneOutLoss([[1.0, 2.0]], [3.0])


# --- both


@pytest.mark.parametrize("kind", [ValidationLoss, LeaveOneOutLoss])
def test_wrong_parameters_are_named(kind, sample):
    X, y = sample(30)
    data = (X, y, X, y) if kind is ValidationLoss else (X, y)
    loss = kind(*data)
    with pytest.raises(ValueError, match=r"sigma=nan is not allowed"):
        loss(np.nan, 1e-3)
    with pytest.raises(ValueError, match=r"regularization=-1 is not allowed"):
        loss(1.0, -1)
    with pytest.raises(ValueError, match=r"input_bounds=\(1, 0\) is not allowed"):
        kind(*data, input_bounds=(1, 0))
