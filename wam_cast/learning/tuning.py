"""The kernel's width by gradient descent on the validation error (section 2.4 of the paper).

The descent runs in `log σ` (and `log λ`), which keeps both positive and makes a step the same relative change
at any scale. It lowers the logarithm of the error, whose slope does not depend on the units of the targets.
"""

import math
import sys
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import NamedTuple, Self

import numpy as np
from numpy.typing import ArrayLike
from scipy.linalg import cho_solve
from sklearn.utils.validation import check_X_y

from wam_cast.learning.kernel_ridge import (
    checked_regularization,
    checked_sigma,
    factorize,
    gaussian_kernel,
    input_scale,
    kernel_slope,
)
from wam_cast.types import Array

MAX_LOG_MOVE = 1.0
"""Largest change of log σ or log λ in one step: a factor e."""

SUFFICIENT_DECREASE = 1e-4
"""Share of the decrease foretold by the gradient that a step must reach (Armijo's condition)."""

MAX_HALVINGS = 20
"""A step a millionth of the first guess that still lowers nothing is lost in rounding."""


class SquaredError(NamedTuple):
    """Error of kernel ridge regression on data that it was not fitted to, and its gradient.

    The error of a row with several outputs is the length of its residual, as for a point on a plane.
    """

    mean_squared: float
    """Mean over the rows of the squared length of the residual, in squared units of the targets."""
    d_log_sigma: Array
    """Derivative by the logarithm of σ; its shape is that of σ, () or (n_features,)."""
    d_log_regularization: float
    """Derivative by the logarithm of λ."""

    @property
    def rmse(self) -> float:
        """Root of the mean squared error, in units of the targets."""
        return float(np.sqrt(self.mean_squared))


@dataclass(frozen=True)
class TuningResult:
    """The best parameters, and the path that led to them.

    The error is that on the validation data from `tune_sigma`, and that of leave-one-out from `tune_by_leave_one_out`.

    Attributes
    ----------
    sigma : float or ndarray of shape (n_features,)
        The best σ, one number if the descent started from one.
    regularization : float
        The best λ, or the one given.
    rmse : float
        Root mean squared error, in units of the targets.
    sigma_path : ndarray of shape (n_steps + 1,) or (n_steps + 1, n_features)
        σ at the start and after each step.
    regularization_path, rmse_path : ndarray of shape (n_steps + 1,)
        λ and the error at the same points; the error never rises.
    is_converged : bool
        Whether the descent ended where the gradient vanishes (or points out of the bounds), not by `max_steps` or at a
        point from which no step lowers the error, such as the verge of a singular kernel matrix.
    """

    sigma: float | Array
    regularization: float
    rmse: float
    sigma_path: Array
    regularization_path: Array
    rmse_path: Array
    is_converged: bool

    @classmethod
    def of_path(cls, parameters: Sequence[tuple[Array, float]], rmse_path: Array, is_converged: bool) -> Self:
        """Return the result of a search whose points had these σ and λ, and these errors; the last one is the best."""
        sigma_path = np.array([sigma for sigma, _ in parameters])
        regularization_path = np.array([lam for _, lam in parameters])
        return cls(
            sigma=sigma_path[-1].copy() if sigma_path.ndim > 1 else float(sigma_path[-1]),
            regularization=float(regularization_path[-1]),
            rmse=float(rmse_path[-1]),
            sigma_path=sigma_path,
            regularization_path=regularization_path,
            rmse_path=rmse_path,
            is_converged=is_converged,
        )


def validation_error_gradient(
    X_train: ArrayLike,
    y_train: ArrayLike,
    X_validation: ArrayLike,
    y_validation: ArrayLike,
    *,
    sigma: float | ArrayLike,
    regularization: float,
    input_bounds: tuple[ArrayLike, ArrayLike] | None = None,
    center_targets: bool = True,
) -> SquaredError:
    """Evaluate the validation error of `KernelRidge` and its gradient by log σ and log λ.

    Parameters
    ----------
    X_train, y_train : array-like of shape (n, n_features), (n,) or (n, n_outputs)
        Training data.
    X_validation, y_validation : array-like
        Validation data, of as many inputs and outputs.
    sigma, regularization, input_bounds, center_targets
        As for `KernelRidge`.

    Returns
    -------
    SquaredError
        The mean squared error and its derivatives.

    Raises
    ------
    ValueError
        If a parameter, or the shape or a value of the data, is not allowed.
    numpy.linalg.LinAlgError
        If the regularized kernel matrix is singular to working precision.
    """
    data = _TuningData(X_train, y_train, X_validation, y_validation, input_bounds, center_targets)
    checked_sigma(sigma, data.n_features)
    return data.loss(np.asarray(sigma, dtype=np.float64), checked_regularization(regularization))


def tune_sigma(
    X_train: ArrayLike,
    y_train: ArrayLike,
    X_validation: ArrayLike,
    y_validation: ArrayLike,
    *,
    sigma0: float | ArrayLike = 1.0,
    regularization: float = 1e-6,
    tune_regularization: bool = False,
    input_bounds: tuple[ArrayLike, ArrayLike] | None = None,
    center_targets: bool = True,
    max_steps: int = 100,
    tolerance: float = 1e-4,
) -> TuningResult:
    """Find the σ of least validation error by gradient descent (section 2.4 of the paper).

    Each step goes down the gradient by the step length of Barzilai and Borwein (Two-Point Step Size Gradient
    Methods, 1988), halved until the error has decreased enough, so that the error never rises.

    Parameters
    ----------
    X_train, y_train : array-like of shape (n, n_features), (n,) or (n, n_outputs)
        Training data.
    X_validation, y_validation : array-like
        Validation data, of as many inputs and outputs.
    sigma0 : float or array-like of shape (n_features,), default=1.0
        Where the descent starts; an array tunes a σ for each input. The descent finds a local minimum, and
        far from the scale of the data there is little slope to follow: with σ far below the distance between
        training inputs every prediction is the mean, with σ far above the unit cube it hardly depends on σ.
    regularization : float, default=1e-6
        λ, or where its descent starts.
    tune_regularization : bool, default=False
        Whether to tune λ together with σ.
    input_bounds, center_targets
        As for `KernelRidge`.
    max_steps : int, default=100
        Most steps to take.
    tolerance : float, default=1e-4
        The descent has converged once changing any parameter by 1 % would change the error by less than
        `tolerance` percent, to first order.

    Returns
    -------
    TuningResult
        The best parameters and the path to them.

    Raises
    ------
    ValueError
        If a parameter, or the shape or a value of the data, is not allowed.
    numpy.linalg.LinAlgError
        If the regularized kernel matrix is singular to working precision at the start.
    """
    data = _TuningData(X_train, y_train, X_validation, y_validation, input_bounds, center_targets)
    checked_sigma(sigma0, data.n_features, name="sigma0")
    sigma_start = np.asarray(sigma0, dtype=np.float64)
    regularization = checked_regularization(regularization)
    if tune_regularization and regularization == 0:
        raise ValueError(
            "regularization=0 is not allowed with tune_regularization=True, since the descent runs in its "
            "logarithm: it must be > 0; pass for example regularization=1e-6"
        )

    def unpack(theta: Array) -> tuple[Array, float]:
        sigma = np.exp(theta[: sigma_start.size]).reshape(sigma_start.shape)
        return sigma, float(np.exp(theta[-1])) if tune_regularization else regularization

    def log_rmse(theta: Array) -> tuple[float, Array]:
        loss = data.loss(*unpack(theta))
        # A perfect fit has no slope, and its logarithm must stay finite.
        mean_squared = max(loss.mean_squared, sys.float_info.min)
        gradient = np.append(loss.d_log_sigma, [loss.d_log_regularization] if tune_regularization else [])
        return 0.5 * math.log(mean_squared), 0.5 * gradient / mean_squared

    theta0 = np.log(np.append(sigma_start, [regularization] if tune_regularization else []))
    path, is_converged = _descend(log_rmse, theta0, max_steps, tolerance)
    return TuningResult.of_path(
        [unpack(theta) for theta, _ in path], np.exp([value for _, value in path]), is_converged
    )


class _TuningData:
    """Training and validation data, checked once, with inputs in the unit cube and targets centred."""

    def __init__(
        self,
        X_train: ArrayLike,
        y_train: ArrayLike,
        X_validation: ArrayLike,
        y_validation: ArrayLike,
        input_bounds: tuple[ArrayLike, ArrayLike] | None,
        center_targets: bool,
    ) -> None:
        X_train, y_train = checked_data(X_train, y_train)
        X_validation, y_validation = checked_data(X_validation, y_validation)
        shapes = [(X.shape[1], y.shape[1:]) for X, y in ((X_train, y_train), (X_validation, y_validation))]
        if shapes[0] != shapes[1]:
            raise ValueError(
                "the validation data must have as many inputs and outputs as the training data, but "
                f"X_validation is {X_validation.shape} and y_validation {y_validation.shape} where "
                f"X_train is {X_train.shape} and y_train {y_train.shape}; pass the same columns of both"
            )
        offset, input_range = input_scale(X_train, input_bounds)
        target_mean = y_train.mean(axis=0) if center_targets else 0.0
        self.n_features = X_train.shape[1]
        self._Z_train = (X_train - offset) / input_range
        self._Z_validation = (X_validation - offset) / input_range
        self._y_train = (y_train - target_mean).reshape(len(X_train), -1)
        self._y_validation = (y_validation - target_mean).reshape(len(X_validation), -1)

    def loss(self, sigma: Array, regularization: float) -> SquaredError:
        """Evaluate the error and its gradient with one factorization, by the adjoint method.

        With `A = K + λ I`, `α = A^-1 y` and the residuals `r = K_v α - y_v`, the squared error `r^T r` has
        the derivative `2 r^T (dK_v α - K_v A^-1 dA α) = 2 (r^T dK_v α - β^T dA α)`, where the adjoint
        `β = A^-1 K_v^T r` serves all parameters.
        """
        Z_train, Z_validation = self._Z_train / sigma, self._Z_validation / sigma
        K_train = gaussian_kernel(Z_train, Z_train)
        K_validation = gaussian_kernel(Z_validation, Z_train)
        factor = factorize(K_train, regularization)
        dual_coef = cho_solve(factor, self._y_train)
        residuals = K_validation @ dual_coef - self._y_validation
        adjoint = cho_solve(factor, K_validation.T @ residuals)

        n_rows = len(residuals)
        by_input = kernel_slope(residuals @ dual_coef.T * K_validation, Z_validation, Z_train)
        by_input -= kernel_slope(adjoint @ dual_coef.T * K_train, Z_train, Z_train)
        by_input *= 2.0 / n_rows
        return SquaredError(
            mean_squared=float(np.sum(residuals**2) / n_rows),
            d_log_sigma=by_input if sigma.ndim else np.asarray(by_input.sum()),
            d_log_regularization=float(-2.0 / n_rows * regularization * np.sum(adjoint * dual_coef)),
        )


def checked_data(X: ArrayLike, y: ArrayLike) -> tuple[Array, Array]:
    """Return inputs and targets as arrays of floats, or raise a ValueError that says what is wrong with them."""
    X_valid, y_valid = check_X_y(X, y, dtype=np.float64, multi_output=True, y_numeric=True)
    return X_valid, np.asarray(y_valid, dtype=np.float64)


Objective = Callable[[Array], tuple[float, Array]]


def _descend(
    objective: Objective, theta: Array, max_steps: int, tolerance: float
) -> tuple[list[tuple[Array, float]], bool]:
    """Go down the gradient; return the points with their values, and whether the gradient vanished."""
    value, gradient = objective(theta)
    path = [(theta, value)]
    step = 1.0
    for _ in range(max_steps):
        if np.max(np.abs(gradient)) <= tolerance:
            break
        found = _backtrack(objective, theta, value, gradient, step)
        if found is None:
            break
        theta_new, value, gradient_new = found
        move, turn = theta_new - theta, gradient_new - gradient
        curvature = move @ turn
        # Where the error curves downward there is no minimum to aim at: go on with longer steps.
        step = float(move @ move / curvature) if curvature > 0 else 2.0 * step
        theta, gradient = theta_new, gradient_new
        path.append((theta, value))
    return path, bool(np.max(np.abs(gradient)) <= tolerance)


def _backtrack(
    objective: Objective, theta: Array, value: float, gradient: Array, step: float
) -> tuple[Array, float, Array] | None:
    """Halve the step until the value decreases enough; None if it never does."""
    step = min(step, MAX_LOG_MOVE / float(np.max(np.abs(gradient))))
    for _ in range(MAX_HALVINGS):
        theta_new = theta - step * gradient
        try:
            value_new, gradient_new = objective(theta_new)
        except np.linalg.LinAlgError:  # a singular kernel matrix is no better than a large error
            value_new = np.inf
        if value_new < value - SUFFICIENT_DECREASE * step * (gradient @ gradient):
            return theta_new, value_new, gradient_new
        step *= 0.5
    return None
