"""Kernel ridge regression with the Gaussian kernel of section 2.4 of the paper, and its gradient: what a forward model is made of.

`.KernelRidge` is the same as an estimator of scikit-learn's, which takes a second to load: to plan a cast needs only this.
"""

from __future__ import annotations

from copy import copy
from typing import Literal, Self, overload

import numpy as np
from numpy.typing import ArrayLike
from scipy.linalg import cho_solve, solve_triangular
from scipy.linalg.lapack import dtrtri

from wam_cast.learning.kernel.kernel_matrix import factorize, gaussian_kernel
from wam_cast.learning.kernel.kernel_parameters import (
    checked_n_landmarks,
    checked_regularization,
    checked_sample_weight,
    checked_sigma,
    input_scale,
)
from wam_cast.learning.kernel.landmarks import LandmarkFit, landmark_rows
from wam_cast.types import Array


class KernelRegression:
    """Kernel ridge regression; parameters, attributes and methods are those of `.KernelRidge`.

    Inputs and targets are arrays of numbers; a ValueError says so where they are not.
    """

    def __init__(
        self,
        *,
        sigma: float | ArrayLike = 0.35,
        regularization: float = 1e-6,
        input_bounds: tuple[ArrayLike, ArrayLike] | None = None,
        center_targets: bool = True,
        n_landmarks: int | None = None,
    ) -> None:
        self.sigma = sigma
        self.regularization = regularization
        self.input_bounds = input_bounds
        self.center_targets = center_targets
        self.n_landmarks = n_landmarks

    def fit(self, X: ArrayLike, y: ArrayLike, sample_weight: float | ArrayLike | None = None) -> Self:
        """Fit to training inputs X, shape (n_samples, n_features), and targets y, shape (n_samples,) or (n_samples, n_outputs).

        They may have any units: inputs are scaled here. `sample_weight`, a number or shape (n_samples,), is by how much the squared
        error of each sample counts, as in `sklearn.kernel_ridge.KernelRidge`: a sample of weight 2 counts as if it was there
        twice, one of weight 0 as if it was not there. By default all have weight 1.

        Raises
        ------
        ValueError
            If a parameter, or the shape or a value of `X`, `y` or `sample_weight`, is not allowed.
        numpy.linalg.LinAlgError
            If `K + λ I` is singular to working precision; not with landmarks.
        """
        X_fit, y_fit = self._checked_data(X, y)
        weights = None if sample_weight is None else checked_sample_weight(sample_weight, len(X_fit))
        if weights is not None:
            counts = weights > 0
            X_fit, y_fit, weights = X_fit[counts], y_fit[counts], weights[counts]
        sigma = checked_sigma(self.sigma, X_fit.shape[1])
        self.regularization_ = checked_regularization(self.regularization)
        n_landmarks = checked_n_landmarks(self.n_landmarks, self.regularization_)
        self.input_offset_, input_range = input_scale(X_fit, self.input_bounds)
        self.length_scale_ = input_range * sigma
        self.center_targets_ = bool(self.center_targets)
        mean = np.average(y_fit, axis=0, weights=weights) if self.center_targets_ else np.zeros(y_fit.shape[1:])
        self.target_mean_ = np.asarray(mean)
        self.X_fit_, self.y_fit_ = X_fit, y_fit
        self.sample_weight_: Array = np.ones(len(X_fit)) if weights is None else weights
        if n_landmarks is None:
            self._solve()
        else:
            self._solve_by_landmarks(n_landmarks)
        return self

    def _solve(self) -> None:
        """Set what is learned exactly."""
        self.centers_: Array = self.X_fit_
        self.landmarks_: LandmarkFit | None = None
        Z_fit = self._scale(self.X_fit_)
        self.cholesky_, _ = factorize(gaussian_kernel(Z_fit, Z_fit), self.regularization_, self.sample_weight_)
        self.dual_coef_: Array = cho_solve((self.cholesky_, True), self.y_fit_ - self.target_mean_)

    def _solve_by_landmarks(self, n_landmarks: int) -> None:
        """Set what is learned with the kernel at landmarks alone."""
        self.centers_ = self.X_fit_[landmark_rows(len(self.X_fit_), n_landmarks)]
        Z_landmarks, Z_fit = self._scale(self.centers_), self._scale(self.X_fit_)
        y = (self.y_fit_ - self.target_mean_).reshape(len(Z_fit), -1)
        self.landmarks_ = LandmarkFit.of(Z_landmarks, Z_fit, y, self.regularization_, self.sample_weight_)
        self.dual_coef_ = self.landmarks_.dual_coef[:, :-1].reshape(len(Z_landmarks), *self.y_fit_.shape[1:])

    @overload
    def predict(self, X: ArrayLike, return_std: Literal[False] = False) -> Array: ...
    @overload
    def predict(self, X: ArrayLike, return_std: Literal[True]) -> tuple[Array, Array]: ...
    @overload
    def predict(self, X: ArrayLike, return_std: bool) -> Array | tuple[Array, Array]: ...
    def predict(self, X: ArrayLike, return_std: bool = False) -> Array | tuple[Array, Array]:
        """Predict the targets at inputs X, shape (n, n_features); shape (n,) or (n, n_outputs), 1-D if the training targets were.

        With `return_std`, as from `sklearn.gaussian_process.GaussianProcessRegressor`, it is a pair: the predictions, and their
        standard deviations of the same shape, those of `predict_std`.

        Raises
        ------
        ValueError
            If the shape or a value of `X` is not allowed.
        sklearn.exceptions.NotFittedError
            If a `.KernelRidge` is called before `fit`.
        """
        K = gaussian_kernel(self._scale(self._checked_inputs(X)), self._scale(self.centers_))
        prediction: Array = K @ self.dual_coef_ + self.target_mean_
        return (prediction, self.predict_std(X)) if return_std else prediction

    def linearize(self, X: ArrayLike) -> tuple[Array, Array]:
        """Predict the targets and differentiate them, quickly for the few inputs that an optimizer asks about.

        Parameters
        ----------
        X : array-like of shape (n, n_features)
            Inputs, taken as they are, without checks.

        Returns
        -------
        prediction : ndarray of shape (n,) or (n, n_outputs)
            As from `predict`, up to rounding.
        gradient : ndarray of shape (n, n_features) or (n, n_outputs, n_features)
            Element `[i, o, j]` is d output `o` / d input `j` at row `i`, in units of the targets per unit of the original inputs;
            no axis of outputs if the training targets were 1-D.
        """
        rows = np.asarray(X, dtype=float)
        offsets = (rows[:, np.newaxis, :] - self.centers_) / self.length_scale_
        kernel = np.exp(-np.einsum("pni,pni->pn", offsets, offsets))
        n_centers, n_features = self.centers_.shape
        # dk / dz = -2 (z - z_n) k
        weights = kernel[:, np.newaxis, :] * self.dual_coef_.reshape(n_centers, -1).T
        gradient = -2.0 * np.matmul(weights, offsets) / self.length_scale_
        shape = (len(rows), *self.dual_coef_.shape[1:])
        prediction = weights.sum(axis=2).reshape(shape) + self.target_mean_
        return prediction, gradient.reshape(*shape, n_features)

    def output(self, index: int) -> Self:
        """Return the same estimator for one of its outputs, of several: what asks for that alone need not compute the others."""
        one = copy(self)
        one.dual_coef_, one.target_mean_ = self.dual_coef_[:, index].copy(), self.target_mean_[index]
        one.y_fit_ = self.y_fit_[:, index]
        return one

    def predict_std(self, X: ArrayLike) -> Array:
        """Estimate the standard deviation of new targets about their predictions; arguments, shapes and errors as for `predict`.

        It is that of the Gaussian process with covariance `s^2 k` and noise of variance `s^2 λ`, the noise of the new target
        included: `s (k(x, x) - k(x)^T (K + λ I)^-1 k(x) + λ)^(1/2)` (Rasmussen and Williams, Gaussian Processes for Machine
        Learning, Eq. 2.26). The scale `s`, one for each output, makes the leave-one-out residuals of the training rows as
        large as predicted on average, where `s^2 / [(K + λ I)^-1]_ii` is predicted of the squared residual of row i (their
        section 5.4.2); after a fit to a single row there are none: a ValueError. The uncertainty of the targets' mean is left out.
        With weights, the noise of training row i has variance `s^2 λ / w_i`, and that of new targets is of weight 1. With landmarks
        it is that of the projected process (their Eq. 8.27), which grows far from them as it does far from all training rows.
        """
        X_valid = self._checked_inputs(X)
        K = gaussian_kernel(self._scale(self.centers_), self._scale(X_valid))
        residuals, inverse_diagonal = self.leave_one_out()
        squared_scale = np.mean((residuals.T**2 * inverse_diagonal).T, axis=0)
        if self.landmarks_ is None:
            explained = solve_triangular(self.cholesky_, K, lower=True, overwrite_b=True)
        else:
            explained = self.landmarks_.whitening() @ K
        # Rounding may take a little too much off where a training row is.
        unexplained = np.maximum(1.0 - np.einsum("ij,ij->j", explained, explained), 0.0)
        std: Array = np.sqrt(np.multiply.outer(unexplained + self.regularization_, squared_scale))
        return std

    def leave_one_out_residuals(self) -> Array:
        """Return the residuals of `leave_one_out` alone, in units of the targets."""
        return self.leave_one_out()[0]

    def leave_one_out(self) -> tuple[Array, Array]:
        """Compute each training target minus its prediction by a fit to all the other rows, without refits.

        The closed form `[(K + λ I)^-1 (y - b)]_i / [(K + λ I)^-1]_ii` holds for any constant offset `b` (Rasmussen and Williams,
        Gaussian Processes for Machine Learning, Eq. 5.12). With `center_targets` it is evaluated at the mean of the other rows'
        targets, which makes it exact there too. With weights, `λ / w_i` is in the place of λ, and that mean is weighted. The
        scaling of the inputs is that of this fit: refits agree exactly if given `input_bounds`; without, they would move the scale
        whenever the row left out holds the least or greatest value of an input.

        Returns
        -------
        residuals : ndarray of shape (n_samples,) or (n_samples, n_outputs)
            In units of the targets.
        inverse_diagonal : ndarray of shape (n_samples,)
            Of `(K + λ I)^-1`: the inverse of the residuals' predicted variance, up to a factor common to all. With landmarks, which
            stay what they are whatever row is left out, it is that inverse.

        Raises
        ------
        ValueError
            If the estimator was fitted to a single row.
        sklearn.exceptions.NotFittedError
            If a `.KernelRidge` is called before `fit`.
        """
        n_samples = len(self.X_fit_)
        if n_samples < 2:
            raise ValueError(
                f"leave-one-out with n_samples={n_samples} leaves nothing to fit to: "
                "it needs at least 2 training rows; call fit with more of them"
            )
        dual_coef = self.dual_coef_.reshape(len(self.centers_), -1)
        if self.landmarks_ is not None:
            Z_fit, y = self._scale(self.X_fit_), (self.y_fit_ - self.target_mean_).reshape(n_samples, -1)
            rest = (y, dual_coef, self.sample_weight_, self.center_targets_)
            residuals, inverse_diagonal = self.landmarks_.leave_one_out(Z_fit, *rest)
            return residuals.reshape(self.y_fit_.shape), inverse_diagonal
        if self.center_targets_:
            Z_fit = self._scale(self.X_fit_)
            weight = self.sample_weight_[:, np.newaxis]
            weight_of_others = (1.0 - np.eye(n_samples)) @ weight  # a difference of sums would lose a small one
            y_centered = gaussian_kernel(Z_fit, Z_fit) @ dual_coef + self.regularization_ / weight * dual_coef
            mean_minus_mean_of_others = weight * y_centered / weight_of_others
            dual_ones = cho_solve((self.cholesky_, True), np.ones((n_samples, 1)))
            dual_coef = dual_coef + mean_minus_mean_of_others * dual_ones
        # To solve for the columns of the identity would take three times as long.
        inverse_lower = np.tril(dtrtri(self.cholesky_, lower=1)[0])
        inverse_diagonal = np.einsum("ij,ij->j", inverse_lower, inverse_lower)
        residuals = (dual_coef / inverse_diagonal[:, np.newaxis]).reshape(self.dual_coef_.shape)
        return residuals, inverse_diagonal

    def _checked_data(self, X: ArrayLike, y: ArrayLike) -> tuple[Array, Array]:
        """Return copies of inputs and targets, so that the model does not change when its caller's arrays do."""
        X_valid, y_valid = np.array(X, dtype=np.float64), np.array(y, dtype=np.float64)
        if (
            X_valid.ndim != 2
            or len(y_valid) != len(X_valid)
            or not (np.isfinite(X_valid).all() and np.isfinite(y_valid).all())
        ):
            raise ValueError(
                f"X of shape {X_valid.shape} and y of shape {y_valid.shape} must be finite, with a row for each sample"
            )
        return X_valid, y_valid

    def _checked_inputs(self, X: ArrayLike) -> Array:
        X_valid: Array = np.asarray(X, dtype=np.float64)
        n_features = self.X_fit_.shape[1]
        if X_valid.ndim != 2 or X_valid.shape[1] != n_features or not np.isfinite(X_valid).all():
            raise ValueError(f"X of shape {X_valid.shape} must be finite, of shape (n, {n_features})")
        return X_valid

    def _scale(self, X: Array) -> Array:
        """Scale inputs so that the kernel has unit width."""
        Z: Array = (X - self.input_offset_) / self.length_scale_
        return Z
