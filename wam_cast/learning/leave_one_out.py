"""The kernel's widths and the regularization by the leave-one-out error over the training casts.

Every training cast serves as validation cast of a model that is fitted to all the others. Their residuals have a closed form
(Rasmussen and Williams, Gaussian Processes for Machine Learning, Eq. 5.12), and so has the gradient of their mean square
(Sundararajan and Keerthi, Predictive Approaches for Choosing Hyperparameters in Gaussian Processes, 2001).
"""

from __future__ import annotations

import math
import sys

import numpy as np
from numpy.typing import ArrayLike
from scipy.linalg import blas, lapack
from scipy.optimize import OptimizeResult, minimize
from threadpoolctl import threadpool_limits

from wam_cast.learning.kernel_ridge import (
    checked_regularization,
    checked_sigma,
    factorize,
    gaussian_kernel,
    input_scale,
    kernel_slope,
)
from wam_cast.learning.tuning import SquaredError, TuningResult, checked_data
from wam_cast.types import Array

SIGMA_BOUNDS = (0.03, 30.0)
"""Where σ is sought, in units of the scaled inputs: beyond, the kernel matrix is nearly the identity, or of rank one."""

REGULARIZATION_BOUNDS = (1e-10, 10.0)
"""Where λ is sought: from what keeps any kernel matrix regular to noise far above the signal."""

SINGULAR = 10.0
"""Logarithm of the error, over that of the mean as prediction, that a singular kernel matrix is taken to have."""


def leave_one_out_error_gradient(
    X: ArrayLike,
    y: ArrayLike,
    *,
    sigma: float | ArrayLike,
    regularization: float,
    input_bounds: tuple[ArrayLike, ArrayLike] | None = None,
    center_targets: bool = True,
) -> SquaredError:
    """Evaluate the leave-one-out error of `KernelRidge` and its gradient by log σ and log λ.

    The residuals are those of `KernelRidge.leave_one_out_residuals`: with `center_targets` each is that of a refit which
    subtracts the mean of the other rows' targets. The scaling of the inputs is not refitted; it is `input_bounds`, or the range
    of all rows.

    Parameters
    ----------
    X, y : array-like of shape (n, n_features), (n,) or (n, n_outputs)
        Training data, at least 2 rows. The error of a row with several outputs is the length of its residual.
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
    data = _TrainingData(X, y, input_bounds, center_targets)
    checked_sigma(sigma, data.n_features)
    return data.loss(np.asarray(sigma, dtype=np.float64), checked_regularization(regularization))


def tune_by_leave_one_out(
    X: ArrayLike,
    y: ArrayLike,
    *,
    sigma0: float | ArrayLike = 0.5,
    regularization0: float = 0.1,
    input_bounds: tuple[ArrayLike, ArrayLike] | None = None,
    center_targets: bool = True,
    max_steps: int = 100,
    tolerance: float = 1e-4,
) -> TuningResult:
    """Find the σ and the λ of least leave-one-out error, by L-BFGS-B in their logarithms.

    Parameters
    ----------
    X, y : array-like of shape (n, n_features), (n,) or (n, n_outputs)
        Training data, at least 2 rows.
    sigma0 : float or array-like of shape (n_features,), default=0.5
        Where the search for σ starts, between 0.03 and 30; an array tunes a σ for each input. The search finds a local minimum.
    regularization0 : float, default=0.1
        Where the search for λ starts, between 1e-10 and 10. A start at too small a λ, whose model follows the noise, can end in a
        poor local minimum of narrow kernels; a start at too large a λ was not seen to.
    input_bounds, center_targets
        As for `KernelRidge`.
    max_steps : int, default=100
        Most steps to take.
    tolerance : float, default=1e-4
        The search has converged once changing any parameter by 1 % would change the error by less than `tolerance`
        percent, to first order.

    Returns
    -------
    TuningResult
        The best parameters and the path to them; the error is the leave-one-out error.

    Raises
    ------
    ValueError
        If a parameter, or the shape or a value of the data, is not allowed.
    """
    data = _TrainingData(X, y, input_bounds, center_targets)
    checked_sigma(sigma0, data.n_features, name="sigma0")
    sigma_start = np.asarray(sigma0, dtype=np.float64)
    _check_within("sigma0", sigma_start, SIGMA_BOUNDS)
    _check_within(
        "regularization0", np.asarray(checked_regularization(regularization0)), REGULARIZATION_BOUNDS
    )
    log_spread = _half_log(data.spread)

    def unpack(theta: Array) -> tuple[Array, float]:
        # Clipped, since the exponential of a bound's logarithm may be beyond it by rounding.
        sigma = np.clip(np.exp(theta[:-1]), *SIGMA_BOUNDS).reshape(sigma_start.shape)
        return sigma, float(np.clip(np.exp(theta[-1]), *REGULARIZATION_BOUNDS))

    def log_error(theta: Array) -> tuple[float, Array]:
        try:
            loss = data.loss(*unpack(theta))
        except np.linalg.LinAlgError:  # the line search turns back from it
            return SINGULAR, np.zeros_like(theta)
        gradient = np.append(loss.d_log_sigma, loss.d_log_regularization)
        value = _half_log(loss.mean_squared) - log_spread
        return value, 0.5 * gradient / max(loss.mean_squared, sys.float_info.min)

    theta0 = np.log(np.append(sigma_start, regularization0))
    bounds = np.log([SIGMA_BOUNDS] * sigma_start.size + [REGULARIZATION_BOUNDS])
    path: list[tuple[Array, float]] = []

    def record(intermediate_result: OptimizeResult) -> None:
        path.append((intermediate_result.x.copy(), float(intermediate_result.fun)))

    options = {"maxiter": max_steps, "gtol": tolerance, "ftol": 1e-9}
    # One thread: more of them gain little on these matrices, and lose much where they share processors. It also makes the
    # path the same whatever their number.
    with threadpool_limits(1):
        path = [(theta0, log_error(theta0)[0])]
        end = minimize(
            log_error, theta0, jac=True, method="L-BFGS-B", bounds=bounds, callback=record, options=options
        )
    free_gradient = end.x - np.clip(end.x - end.jac, *bounds.T)
    return TuningResult.of_path(
        [unpack(theta) for theta, _ in path],
        np.exp([value + log_spread for _, value in path]),
        bool(np.max(np.abs(free_gradient)) <= tolerance),
    )


class _TrainingData:
    """Training data, checked once, with inputs in the unit cube and targets centred."""

    def __init__(
        self,
        X: ArrayLike,
        y: ArrayLike,
        input_bounds: tuple[ArrayLike, ArrayLike] | None,
        center_targets: bool,
    ) -> None:
        X, y = checked_data(X, y)
        n_rows, self.n_features = X.shape
        if n_rows < 2:
            raise ValueError(
                f"leave-one-out with n_samples={n_rows} leaves nothing to fit to: it needs at least 2 rows"
            )
        offset, input_range = input_scale(X, input_bounds)
        self._Z = (X - offset) / input_range
        self._y = (y - (y.mean(axis=0) if center_targets else 0.0)).reshape(n_rows, -1)
        # How far the mean of the other rows' targets is below the mean of all.
        self._shift = self._y / (n_rows - 1) if center_targets else np.zeros_like(self._y)
        self._is_lower = np.tri(n_rows, dtype=bool)
        self.spread = float(np.sum(self._y**2) / n_rows)

    def loss(self, sigma: Array, regularization: float) -> SquaredError:
        """Evaluate the error and its gradient with one inverse and one product of matrices, by the adjoint method.

        With `A = K + λ I`, `α = A^-1 y`, `β = A^-1 1` and the shift `c` of the centre by the row left out, the residuals are
        `e_i = (α_i + c_i β_i) / [A^-1]_ii`. Since `dA^-1 = -A^-1 dA A^-1`, with `w_i = e_i / [A^-1]_ii`

            d (1/2 e^T e) = -(A^-1 w)^T dA α - (A^-1 (c w))^T dA β + tr(A^-1 diag(w e) A^-1 dA) = sum(M * dA),

        where the matrix M serves all parameters; several outputs add up.
        """
        n_rows = len(self._y)
        Z = self._Z / sigma
        K = gaussian_kernel(Z, Z)
        inverse = self._inverse(K, regularization)
        inverse_diagonal = inverse.diagonal()[:, np.newaxis]

        dual = inverse @ np.column_stack([self._y, np.ones(n_rows)])
        residuals = (dual[:, :-1] + self._shift * dual[:, -1:]) / inverse_diagonal
        w = residuals / inverse_diagonal
        adjoint = inverse @ np.column_stack([w, np.sum(self._shift * w, axis=1)])
        root = inverse * np.sqrt(np.sum(w * residuals, axis=1))

        # The lower half of a symmetric part of M, twice, is as good as all of it, dK being symmetric and 0 on its diagonal.
        M = blas.dsyrk(1.0, root, lower=1)
        by_log_regularization = regularization * (np.trace(M) - np.sum(adjoint * dual))
        M = blas.dgemm(-1.0, adjoint, dual, beta=2.0, c=M, trans_b=1, overwrite_c=1)
        M *= K.T
        by_input = 2.0 / n_rows * kernel_slope(M, Z, Z)
        return SquaredError(
            mean_squared=float(np.sum(residuals**2) / n_rows),
            d_log_sigma=by_input if sigma.ndim else np.asarray(by_input.sum()),
            d_log_regularization=float(2.0 / n_rows * by_log_regularization),
        )

    def _inverse(self, K: Array, regularization: float) -> Array:
        """Return `(K + λ I)^-1`, in LAPACK's order; overwrites nothing."""
        factor, _ = factorize(K, regularization)
        lower, _ = lapack.dpotri(factor, lower=1, overwrite_c=1)
        inverse: Array = np.where(self._is_lower, lower, lower.T)
        return inverse


def _half_log(mean_squared: float) -> float:
    """Return the logarithm of the root, finite for a perfect fit too."""
    return 0.5 * math.log(max(mean_squared, sys.float_info.min))


def _check_within(name: str, values: Array, bounds: tuple[float, float]) -> None:
    lower, upper = bounds
    if not np.all((lower <= values) & (values <= upper)):
        raise ValueError(
            f"{name}={values} is not allowed: the search starts between {lower:g} and {upper:g}; "
            f"pass for example {name}={math.sqrt(lower * upper):.2g}"
        )
