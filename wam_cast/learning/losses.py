"""What hyperparameters are chosen by: errors of kernel ridge regression on data that it was not fitted to.

`ValidationLoss` measures on validation data (section 2.4 of the paper). `LeaveOneOutLoss` predicts each training row by a fit to
all the others; its residuals have a closed form (Rasmussen and Williams, Gaussian Processes for Machine Learning, Eq. 5.12), and so
has the gradient of their mean square (Sundararajan and Keerthi, Predictive Approaches for Choosing Hyperparameters in Gaussian
Processes, 2001). Both differentiate by the adjoint method: one factorization serves all parameters.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from typing import NamedTuple, TypeGuard

import numpy as np
from numpy.typing import ArrayLike
from scipy.linalg import blas, cho_solve, lapack

from wam_cast.learning.kernel.kernel_matrix import factorize, gaussian_kernel
from wam_cast.learning.kernel.kernel_parameters import checked_regularization, checked_sigma, input_scale
from wam_cast.types import Array


class SquaredError(NamedTuple):
    """A mean squared error and its gradient.

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


class Loss(ABC):
    """The mean squared error as a function of σ and λ; inputs are scaled and targets centred once, as `.KernelRidge` does it.

    Attributes
    ----------
    n_features
        Number of inputs.
    mean_squared_target
        The error far from all training data, where the prediction is the training mean, or 0 without centring.
    """

    mean_squared_target: float

    def __init__(
        self, X: Array, y: Array, input_bounds: tuple[ArrayLike, ArrayLike] | None, center_targets: bool
    ) -> None:
        self.n_features = X.shape[1]
        self._offset, self._range = input_scale(X, input_bounds)
        self._target_mean = y.mean(axis=0) if center_targets else 0.0

    def __call__(self, sigma: float | ArrayLike, regularization: float) -> SquaredError:
        """Evaluate the error and its gradient; σ and λ are as for `.KernelRidge`.

        Raises
        ------
        ValueError
            If a parameter is not allowed.
        numpy.linalg.LinAlgError
            If the regularized kernel matrix is singular to working precision.
        """
        checked_sigma(sigma, self.n_features)
        widths = np.asarray(sigma, dtype=np.float64)
        residuals, slope, d_log_regularization = self._evaluate(widths, checked_regularization(regularization))
        by_input = 2.0 / len(residuals) * slope
        return SquaredError(
            mean_squared=_mean_squared(residuals),
            d_log_sigma=by_input if widths.ndim else np.asarray(by_input.sum()),
            d_log_regularization=float(d_log_regularization),
        )

    @abstractmethod
    def _evaluate(self, sigma: Array, regularization: float) -> tuple[Array, Array, float]:
        """Return the residuals, half the derivative of their squares' sum by each input's log σ, and that of the mean by log λ.

        The shape of the residuals is (n_rows, n_outputs).
        """

    def _prepared(self, X: Array, y: Array) -> tuple[Array, Array]:
        """Return inputs in the unit cube, and centred targets of shape (n_rows, n_outputs)."""
        return (X - self._offset) / self._range, (y - self._target_mean).reshape(len(X), -1)


class ValidationLoss(Loss):
    """The error on validation data of a fit to training data.

    The shapes of both are (n, n_features) and (n,) or (n, n_outputs); the options are those of `.KernelRidge`.

    Raises
    ------
    ValueError
        If the bounds, or the shape or a value of the data, are not allowed.
    """

    def __init__(
        self,
        X_train: ArrayLike,
        y_train: ArrayLike,
        X_validation: ArrayLike,
        y_validation: ArrayLike,
        *,
        input_bounds: tuple[ArrayLike, ArrayLike] | None = None,
        center_targets: bool = True,
    ) -> None:
        X_train, y_train = _checked(X_train, y_train)
        X_validation, y_validation = _checked(X_validation, y_validation)
        shapes = [(X.shape[1], y.shape[1:]) for X, y in ((X_train, y_train), (X_validation, y_validation))]
        if shapes[0] != shapes[1]:
            raise ValueError(
                "the validation data must have as many inputs and outputs as the training data, but "
                f"X_validation is {X_validation.shape} and y_validation {y_validation.shape} where "
                f"X_train is {X_train.shape} and y_train {y_train.shape}; pass the same columns of both"
            )
        super().__init__(X_train, y_train, input_bounds, center_targets)
        self._Z_train, self._y_train = self._prepared(X_train, y_train)
        self._Z_validation, self._y_validation = self._prepared(X_validation, y_validation)
        self.mean_squared_target = _mean_squared(self._y_validation)

    def _evaluate(self, sigma: Array, regularization: float) -> tuple[Array, Array, float]:
        """Evaluate by the adjoint method.

        With `A = K + λ I`, `α = A^-1 y` and the residuals `r = K_v α - y_v`, the squared error `r^T r` has the derivative
        `2 r^T (dK_v α - K_v A^-1 dA α) = 2 (r^T dK_v α - β^T dA α)`, where the adjoint `β = A^-1 K_v^T r` serves all parameters.
        """
        Z_train, Z_validation = self._Z_train / sigma, self._Z_validation / sigma
        K_train = gaussian_kernel(Z_train, Z_train)
        K_validation = gaussian_kernel(Z_validation, Z_train)
        factor = factorize(K_train, regularization)
        dual_coef = cho_solve(factor, self._y_train)
        residuals = K_validation @ dual_coef - self._y_validation
        adjoint = cho_solve(factor, K_validation.T @ residuals)
        slope = _kernel_slope(residuals @ dual_coef.T * K_validation, Z_validation, Z_train)
        slope -= _kernel_slope(adjoint @ dual_coef.T * K_train, Z_train, Z_train)
        return residuals, slope, -2.0 / len(residuals) * regularization * np.sum(adjoint * dual_coef)


class LeaveOneOutLoss(Loss):
    """The error of each training row, predicted by a fit to all the others.

    The residuals are those of `.KernelRidge.leave_one_out_residuals`: with `center_targets` each is that of a refit which
    subtracts the mean of the other rows' targets. The scaling of the inputs is not refitted; it is `input_bounds`, or the range
    of all rows. Shapes, options and errors are as for `ValidationLoss`; there must be at least 2 rows.
    """

    def __init__(
        self,
        X: ArrayLike,
        y: ArrayLike,
        *,
        input_bounds: tuple[ArrayLike, ArrayLike] | None = None,
        center_targets: bool = True,
    ) -> None:
        X, y = _checked(X, y)
        n_rows = len(X)
        if n_rows < 2:
            raise ValueError(
                f"leave-one-out with n_samples={n_rows} leaves nothing to fit to: it needs at least 2 rows"
            )
        super().__init__(X, y, input_bounds, center_targets)
        self._Z, self._y = self._prepared(X, y)
        self.mean_squared_target = _mean_squared(self._y)
        # How far the mean of the other rows' targets is below the mean of all.
        self._shift = self._y / (n_rows - 1) if center_targets else np.zeros_like(self._y)
        self._is_lower = np.tri(n_rows, dtype=bool)

    def _evaluate(self, sigma: Array, regularization: float) -> tuple[Array, Array, float]:
        """Evaluate with one inverse and one product of matrices, by the adjoint method.

        With `A = K + λ I`, `α = A^-1 y`, `β = A^-1 1` and the shift `c` of the centre by the row left out, the residuals are
        `e_i = (α_i + c_i β_i) / [A^-1]_ii`. Since `dA^-1 = -A^-1 dA A^-1`, with `w_i = e_i / [A^-1]_ii`::

            d (1/2 e^T e) = -(A^-1 w)^T dA α - (A^-1 (c w))^T dA β + tr(A^-1 diag(w e) A^-1 dA) = sum(M * dA),

        where the matrix M serves all parameters; several outputs add up.
        """
        n_rows = len(self._y)
        Z = self._Z / sigma
        K = gaussian_kernel(Z, Z)
        lower, _ = lapack.dpotri(factorize(K, regularization)[0], lower=1, overwrite_c=1)
        inverse = np.where(self._is_lower, lower, lower.T)
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
        return residuals, _kernel_slope(M, Z, Z), 2.0 / n_rows * by_log_regularization


def _kernel_slope(weights: Array, Z: Array, Z_fit: Array) -> Array:
    """Sum `weights * d log k / d log σ_j = weights * 2 (z_j - z'_j)^2` over all pairs of inputs, for each input j.

    With weights `W * K`, shape (n, n_samples), that is the sum of `W * dK / d log σ_j`. Inputs are as for `.gaussian_kernel`.
    """
    slope: Array = 2.0 * (
        weights.sum(axis=1) @ Z**2 + weights.sum(axis=0) @ Z_fit**2 - 2.0 * np.einsum("ij,ij->j", Z, weights @ Z_fit)
    )
    return slope


def _checked(X: ArrayLike, y: ArrayLike) -> tuple[Array, Array]:
    """Return inputs and targets as arrays of floats, or raise a ValueError that says what is wrong with them."""
    if _are_rows(X) and _are_rows(y, may_be_numbers=True) and len(X) == len(y):
        return X, y
    from sklearn.utils.validation import check_X_y  # takes a second, which a fit to a dataset does not need

    X_valid, y_valid = check_X_y(X, y, dtype=np.float64, multi_output=True, y_numeric=True)
    return X_valid, np.asarray(y_valid, dtype=np.float64)


def _are_rows(values: ArrayLike, *, may_be_numbers: bool = False) -> TypeGuard[Array]:
    """Return whether `values` is an array of rows, or of numbers where it may be, all of them finite floats."""
    if type(values) is not np.ndarray or values.dtype != np.float64 or values.size == 0:
        return False
    return (values.ndim == 2 or (may_be_numbers and values.ndim == 1)) and bool(np.all(np.isfinite(values)))


def _mean_squared(rows: Array) -> float:
    """Return the mean over the rows of their squared length."""
    return float(np.sum(rows**2) / len(rows))
