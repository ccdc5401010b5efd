"""Kernel ridge regression as an estimator of scikit-learn's.

It follows scikit-learn's contract, so that pipelines, cross-validation and model selection work on it as on any other. What it adds
to `sklearn.kernel_ridge.KernelRidge` is what a planner and a model builder need: inputs of different units scaled inside the
estimator, the paper's kernel width, ARD length scales, the analytic gradient of the prediction, its standard deviation, and
leave-one-out residuals without refits.
"""

from __future__ import annotations

import warnings

import numpy as np
from numpy.typing import ArrayLike
from sklearn.base import BaseEstimator, MultiOutputMixin, RegressorMixin
from sklearn.utils.validation import check_is_fitted, validate_data

from wam_cast.deprecation import renamed
from wam_cast.learning.kernel.kernel_regression import KernelRegression
from wam_cast.types import Array


class KernelRidge(MultiOutputMixin, RegressorMixin, BaseEstimator, KernelRegression):
    """Kernel ridge regression with a Gaussian kernel on scaled inputs (section 2.4 of the paper).

    The prediction is `m(x) = y_mean + k(x)^T (K + λ I)^-1 (Y - y_mean)` with the kernel `k(x, x') = exp(-||x - x'||^2 / σ^2)`,
    without the factor 2 that is usual elsewhere. Distances are measured between inputs scaled to the unit cube. With weights of
    the samples, `w`, there is `λ / w_i` for row i in the place of λ, and `y_mean` is the weighted mean. Its
    methods are those of `.KernelRegression`.

    Parameters
    ----------
    sigma : float or array-like of shape (n_features,), default=0.35
        Width σ of the kernel, in units of the scaled inputs. An array gives ARD length scales, a width for each input: the wider,
        the less the prediction depends on that input. The default is the paper's value.
    regularization : float, default=1e-6
        λ >= 0, in units of the kernel, whose diagonal is 1. The default suits noise-free simulated targets.
    input_bounds : pair (lower, upper) or None, default=None
        What is scaled to 0 and to 1, in units of the inputs; each a number for all inputs or an array-like of shape (n_features,).
        `None` takes the smallest and the largest training input of each column, and ignores a column that is constant, since
        nothing can be learned about it. Give the bounds that the inputs were sampled from if you know them: σ then means the same
        for every training set. `(0, 1)` leaves the inputs as they are.
    center_targets : bool, default=True
        Remove the mean of the training targets before the fit and add it to the predictions. Far from all training inputs the
        prediction then tends to this mean; without, as in `sklearn.kernel_ridge.KernelRidge`, it tends to 0, however far 0 is from
        any target seen.
    n_landmarks : int or None, default=None
        `None` solves exactly: the time is that of n_samples^3, the memory that of n_samples^2. A number approximates: the kernel
        stands at so many training rows alone, the landmarks, evenly spaced in their order; the time is that of
        n_samples `n_landmarks`^2, the memory that of `n_landmarks`^2. λ must be > 0. See `wam_cast.learning.kernel.landmarks`.
        With all training rows as landmarks the solution is the exact one, up to rounding; with fewer, a sample that is there twice
        may move the landmarks, where one of weight 2 does not.

    Attributes
    ----------
    X_fit_ : ndarray of shape (n_samples, n_features)
        The training inputs, in their original units, without those of weight 0.
    y_fit_ : ndarray of shape (n_samples,) or (n_samples, n_outputs)
        Their targets.
    centers_ : ndarray of shape (n_centers, n_features)
        Where the kernel stands: the training inputs, or the landmarks among them.
    sample_weight_ : ndarray of shape (n_samples,)
        Their weights, 1 where none were given.
    dual_coef_ : ndarray of shape (n_centers,) or (n_centers, n_outputs)
        `(K + λ I)^-1 (Y - y_mean)`, in units of the targets; with landmarks what takes its place at them.
    cholesky_ : ndarray of shape (n_samples, n_samples)
        The lower Cholesky factor of `K + λ I`, with anything above its diagonal: 13 MB for 1300 rows. Not with landmarks.
    landmarks_ : LandmarkFit or None
        The solution with landmarks.
    target_mean_ : ndarray of shape () or (n_outputs,)
        What is added to the kernel linearization; 0 without `center_targets`.
    input_offset_ : ndarray of shape (n_features,)
        What is scaled to 0, in units of the inputs.
    length_scale_ : ndarray of shape (n_features,)
        σ in units of the inputs; infinite for an input that is ignored.
    regularization_, center_targets_ : float, bool
        The parameters of the fit, whatever `set_params` was given since.
    n_features_in_ : int
        Number of inputs.
    feature_names_in_ : ndarray of shape (`n_features_in_`,)
        Names of the inputs, if `X` had any.

    Examples
    --------
    >>> import numpy as np
    >>> X = np.linspace(0, 2, 20).reshape(-1, 1)
    >>> model = KernelRidge(sigma=0.5).fit(X, np.sin(X[:, 0]))
    >>> y, dy_dX = model.linearize(np.array([[1.0]]))
    >>> print(y.round(2), dy_dX.round(2))  # sin(1) and cos(1)
    [0.84] [[0.54]]
    """

    expand = renamed("expand", "linearize")
    predict_with_gradient = renamed("predict_with_gradient", "linearize")

    def predict_gradient(self, X: ArrayLike) -> Array:
        """Return the second part of what `linearize` returns, which is to be called instead (deprecated)."""
        warnings.warn("KernelRidge.predict_gradient is now linearize(X)[1]", DeprecationWarning, stacklevel=2)
        return self.linearize(X)[1]

    def leave_one_out(self) -> tuple[Array, Array]:
        """Return what `.KernelRegression.leave_one_out` does, or raise scikit-learn's error before a fit."""
        check_is_fitted(self)
        return super().leave_one_out()

    def _checked_data(self, X: ArrayLike, y: ArrayLike) -> tuple[Array, Array]:
        X_valid, y_valid = validate_data(self, X, y, dtype=np.float64, copy=True, multi_output=True, y_numeric=True)
        return X_valid, np.asarray(y_valid, dtype=np.float64)

    def _checked_inputs(self, X: ArrayLike) -> Array:
        check_is_fitted(self)
        X_valid: Array = validate_data(self, X, dtype=np.float64, reset=False)
        return X_valid
