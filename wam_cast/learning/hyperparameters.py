"""The kernel's σ and λ: two searches for the least of a loss.

`tune_by_descent` is the paper's gradient descent (section 2.4); `tune_by_lbfgs` is what `.ForwardModel.fit` calls. Both run in log
σ and log λ, which keeps them positive and makes a step the same relative change at any scale. Both lower the logarithm of the
error, whose slope does not depend on the units of the targets.
"""

from __future__ import annotations

import math
import sys
from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import ArrayLike

from wam_cast.learning.kernel.kernel_parameters import checked_regularization, checked_sigma
from wam_cast.learning.losses import Loss
from wam_cast.parallel.threads import one_thread
from wam_cast.types import Array

if TYPE_CHECKING:
    from scipy.optimize import OptimizeResult

MAX_LOG_MOVE = 1.0
"""Largest change of log σ or log λ in one step of the descent: a factor e."""

SUFFICIENT_DECREASE = 1e-4
"""Fraction of the decrease predicted by the gradient that a step must reach (Armijo's condition)."""

MAX_HALVINGS = 20
"""A step a millionth of the first guess that still lowers nothing is lost in rounding."""

SIGMA_BOUNDS = (0.03, 30.0)
"""Where L-BFGS-B seeks σ, in units of the scaled inputs: beyond, the kernel matrix is nearly the identity, or of rank one."""

REGULARIZATION_BOUNDS = (1e-10, 10.0)
"""Where it seeks λ: from what keeps any kernel matrix regular to noise far above the signal."""

SINGULAR_LOG_ERROR = 10.0
"""Logarithm of the error, over that of the mean as prediction, that L-BFGS-B is told of a singular kernel matrix."""


@dataclass(frozen=True)
class TuningResult:
    """The best parameters, and the path that led to them.

    Attributes
    ----------
    sigma
        The best σ: one number if the search started from one, else of shape (n_features,).
    regularization
        The best λ, or the one given.
    rmse
        Root of the loss's mean squared error, in units of the targets.
    sigma_path
        σ at the start and after each step, shape (n_steps + 1,) or (n_steps + 1, n_features).
    regularization_path, rmse_path
        λ and the error at the same points, each of shape (n_steps + 1,); the error never rises.
    is_converged
        Whether the search ended where the gradient vanishes (or points out of the bounds), not by `max_steps` or at a point from
        which no step lowers the error, such as the verge of a singular kernel matrix.
    """

    sigma: float | Array
    regularization: float
    rmse: float
    sigma_path: Array
    regularization_path: Array
    rmse_path: Array
    is_converged: bool


def tune_by_descent(
    loss: Loss,
    *,
    sigma0: float | ArrayLike = 1.0,
    regularization: float = 1e-6,
    tune_regularization: bool = False,
    max_steps: int = 100,
    tolerance: float = 1e-4,
) -> TuningResult:
    """Find the σ of least loss by gradient descent (section 2.4 of the paper).

    Each step goes down the gradient by the step length of Barzilai and Borwein (Two-Point Step Size Gradient Methods, 1988), halved
    until the error has decreased enough, so that the error never rises.

    Parameters
    ----------
    loss
        The paper's is `.ValidationLoss`.
    sigma0
        Where the descent starts; an array of shape (n_features,) tunes ARD length scales, a σ for each input. The descent finds a
        local minimum, and far from the scale of the data there is little slope to follow: with σ far below the distance between
        training inputs every prediction is the mean, with σ far above the unit cube it hardly depends on σ.
    regularization
        λ, or where its descent starts.
    tune_regularization
        Whether to tune λ together with σ.
    max_steps
        Most steps to take.
    tolerance
        The descent has converged once changing any parameter by 1 % would change the error by less than `tolerance` percent, to
        first order.

    Raises
    ------
    ValueError
        If a parameter is not allowed.
    numpy.linalg.LinAlgError
        If the regularized kernel matrix is singular to working precision at the start.
    """
    checked_sigma(sigma0, loss.n_features, name="sigma0")
    regularization = checked_regularization(regularization)
    if tune_regularization and regularization == 0:
        raise ValueError(
            "regularization=0 is not allowed with tune_regularization=True, since the descent runs in its logarithm: it must be "
            "> 0; pass for example regularization=1e-6"
        )
    log_error = _LogError(loss, np.shape(sigma0), None if tune_regularization else regularization)
    theta0 = np.log(np.append(sigma0, [regularization] if tune_regularization else []))
    path, is_converged = _descend(log_error, theta0, max_steps, tolerance)
    return log_error.result(path, is_converged)


def tune_by_lbfgs(
    loss: Loss,
    *,
    sigma0: float | ArrayLike = 0.5,
    regularization0: float = 0.1,
    regularization_bounds: tuple[float, float] = REGULARIZATION_BOUNDS,
    max_steps: int = 100,
    tolerance: float = 1e-4,
) -> TuningResult:
    """Find the σ and the λ of least loss by L-BFGS-B, within `SIGMA_BOUNDS` and `regularization_bounds`.

    Parameters
    ----------
    loss
        `.ForwardModel.fit` takes `.LeaveOneOutLoss`.
    sigma0
        Where the search for σ starts, as for `tune_by_descent`.
    regularization0
        Where the search for λ starts. A start at too small a λ, whose model follows the noise, can end in a poor local minimum of
        narrow kernels; a start at too large a λ was not seen to.
    regularization_bounds
        The least and the largest λ: narrower than usual where more is known of the noise.
    max_steps, tolerance
        As for `tune_by_descent`.

    Raises
    ------
    ValueError
        If a parameter is not allowed.
    """
    from scipy.optimize import minimize  # a model that is only read does without

    checked_sigma(sigma0, loss.n_features, name="sigma0")
    checked_regularization(regularization0)
    _check_within("sigma0", sigma0, SIGMA_BOUNDS)
    _check_within("regularization0", regularization0, regularization_bounds)
    log_error = _LogError(loss, np.shape(sigma0), None, regularization_bounds)
    log_of_mean = _half_log(loss.mean_squared_target)

    def relative(theta: Array) -> tuple[float, Array]:
        try:
            value, gradient = log_error(theta)
        except np.linalg.LinAlgError:  # the line search turns back from it
            return SINGULAR_LOG_ERROR, np.zeros_like(theta)
        return value - log_of_mean, gradient

    def record(intermediate_result: OptimizeResult) -> None:
        path.append((intermediate_result.x.copy(), float(intermediate_result.fun)))

    theta0 = np.log(np.append(sigma0, regularization0))
    bounds = np.log([SIGMA_BOUNDS] * (theta0.size - 1) + [regularization_bounds])
    options = {"maxiter": max_steps, "gtol": tolerance, "ftol": 1e-9}
    # One thread: more of them gain little on these matrices, and lose much where they share processors. It also makes the
    # path the same whatever their number.
    with one_thread():
        path = [(theta0, relative(theta0)[0])]
        end = minimize(relative, theta0, jac=True, method="L-BFGS-B", bounds=bounds, callback=record, options=options)
    free_gradient = end.x - np.clip(end.x - end.jac, *bounds.T)
    is_converged = bool(np.max(np.abs(free_gradient)) <= tolerance)
    return log_error.result([(theta, value + log_of_mean) for theta, value in path], is_converged)


@dataclass(frozen=True)
class _LogError:
    """Logarithm of a loss's RMSE as a function of θ = (log σ, log λ), or of θ = log σ for a `regularization` that is given.

    With `regularization_bounds`, σ is within `SIGMA_BOUNDS`, too.
    """

    loss: Loss
    sigma_shape: tuple[int, ...]
    regularization: float | None
    regularization_bounds: tuple[float, float] | None = None

    def unpack(self, theta: Array) -> tuple[Array, float]:
        """Return σ and λ."""
        sigma = np.exp(theta[: math.prod(self.sigma_shape)]).reshape(self.sigma_shape)
        regularization = float(np.exp(theta[-1])) if self.regularization is None else self.regularization
        if self.regularization_bounds is not None:
            # The exponential of a bound's logarithm may be beyond it by rounding.
            return np.clip(sigma, *SIGMA_BOUNDS), float(np.clip(regularization, *self.regularization_bounds))
        return sigma, regularization

    def __call__(self, theta: Array) -> tuple[float, Array]:
        """Return the value and its gradient."""
        error = self.loss(*self.unpack(theta))
        gradient = np.append(error.d_log_sigma, error.d_log_regularization)[: theta.size]
        # A perfect fit has no slope.
        return _half_log(error.mean_squared), 0.5 * gradient / max(error.mean_squared, sys.float_info.min)

    def result(self, path: Sequence[tuple[Array, float]], is_converged: bool) -> TuningResult:
        """Return the result of a search that went through these points and values; the last one is the best."""
        sigmas, regularizations = zip(*(self.unpack(theta) for theta, _ in path), strict=True)
        sigma_path, regularization_path = np.array(sigmas), np.array(regularizations)
        rmse_path = np.exp([value for _, value in path])
        return TuningResult(
            sigma=sigma_path[-1].copy() if self.sigma_shape else float(sigma_path[-1]),
            regularization=float(regularization_path[-1]),
            rmse=float(rmse_path[-1]),
            sigma_path=sigma_path,
            regularization_path=regularization_path,
            rmse_path=rmse_path,
            is_converged=is_converged,
        )


def _descend(
    log_error: _LogError, theta: Array, max_steps: int, tolerance: float
) -> tuple[list[tuple[Array, float]], bool]:
    """Go down the gradient; return the points with their values, and whether the gradient vanished."""
    value, gradient = log_error(theta)
    path = [(theta, value)]
    step = 1.0
    for _ in range(max_steps):
        if np.max(np.abs(gradient)) <= tolerance:
            break
        found = _backtrack(log_error, theta, value, gradient, step)
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
    log_error: _LogError, theta: Array, value: float, gradient: Array, step: float
) -> tuple[Array, float, Array] | None:
    """Halve the step until the value decreases enough; None if it never does."""
    step = min(step, MAX_LOG_MOVE / float(np.max(np.abs(gradient))))
    for _ in range(MAX_HALVINGS):
        theta_new = theta - step * gradient
        try:
            value_new, gradient_new = log_error(theta_new)
        except np.linalg.LinAlgError:  # a singular kernel matrix is no better than a large error
            value_new = np.inf
        if value_new < value - SUFFICIENT_DECREASE * step * (gradient @ gradient):
            return theta_new, value_new, gradient_new
        step *= 0.5
    return None


def _half_log(mean_squared: float) -> float:
    """Return the logarithm of the root, finite for a perfect fit too."""
    return 0.5 * math.log(max(mean_squared, sys.float_info.min))


def _check_within(name: str, value: float | ArrayLike, bounds: tuple[float, float]) -> None:
    values = np.asarray(value, dtype=np.float64)
    lower, upper = bounds
    if not np.all((lower <= values) & (values <= upper)):
        raise ValueError(
            f"{name}={values} is not allowed: the search starts between {lower:g} and {upper:g}; "
            f"pass for example {name}={math.sqrt(lower * upper):.2g}"
        )
