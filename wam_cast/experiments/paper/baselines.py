"""What kernel ridge regression is compared with: unfitted scikit-learn estimators for the landing along the casting plane.

Each takes casts `[distance, speed, wait]` in SI units, shape (n, 3), and landings [m], shape (n,). `bounds` are the pair
(lower, upper) that `.cast_bounds` gives, which the inputs are scaled by.
"""

from __future__ import annotations

import warnings
from itertools import product
from typing import Any, Self

import numpy as np
from numpy.polynomial.legendre import legvander
from numpy.typing import ArrayLike
from sklearn.base import BaseEstimator, RegressorMixin, TransformerMixin, clone
from sklearn.compose import ColumnTransformer, TransformedTargetRegressor
from sklearn.dummy import DummyRegressor
from sklearn.exceptions import ConvergenceWarning
from sklearn.gaussian_process import GaussianProcessRegressor
from sklearn.gaussian_process.kernels import RBF, ConstantKernel, WhiteKernel
from sklearn.linear_model import LinearRegression
from sklearn.neighbors import KNeighborsRegressor
from sklearn.neural_network import MLPRegressor
from sklearn.pipeline import Pipeline, make_pipeline
from sklearn.preprocessing import FunctionTransformer, StandardScaler
from sklearn.utils.validation import check_is_fitted, validate_data

from wam_cast.types import Array

Bounds = tuple[Array, Array]

KERNEL_ROWS = 400
"""Training casts that choose the Gaussian process's kernel: each try costs their number cubed."""


def bounds_scaler(bounds: tuple[ArrayLike, ArrayLike]) -> FunctionTransformer:
    """Return what scales inputs from their bounds, each of shape (n_features,) or a number, to [-1, 1]."""
    return FunctionTransformer(_scale, kw_args={"bounds": bounds})


def _scale(X: Array, bounds: tuple[ArrayLike, ArrayLike]) -> Array:
    lower, upper = np.asarray(bounds, dtype=np.float64)
    return np.asarray(2.0 * (X - lower) / (upper - lower) - 1.0)


def constant() -> DummyRegressor:
    """Return what predicts the mean of the training landings, whatever the cast."""
    return DummyRegressor(strategy="mean")


def polynomial(degree: int, bounds: Bounds) -> Pipeline:
    """Return the polynomial of total degree `degree` in all parameters, by least squares.

    Its basis is products of Legendre polynomials on parameters scaled to [-1, 1], which are orthogonal over casts that fill the
    bounds evenly; least squares are solved by singular values. The condition number over the 1,300 training casts of the
    reference dataset is 39 at degree 5 and 1.2e5 at degree 12; that of `raw_polynomial`'s monomials is 6e5 and 1.6e14.
    """
    return make_pipeline(bounds_scaler(bounds), LegendreFeatures(degree), LinearRegression(fit_intercept=False))


def additive_polynomial(degree: int, bounds: Bounds) -> Pipeline:
    """Return a sum of polynomials of degree `degree`, one of each parameter alone, by least squares."""
    basis = LegendreFeatures(degree, is_additive=True)
    return make_pipeline(bounds_scaler(bounds), basis, LinearRegression(fit_intercept=False))


def single_parameter_polynomial(degree: int, bounds: Bounds, parameter: int) -> Pipeline:
    """Return the polynomial of degree `degree` in one parameter, by its column (0, 1 or 2), by least squares."""
    one = ColumnTransformer([("parameter", "passthrough", [parameter])])
    return make_pipeline(bounds_scaler(bounds), one, LegendreFeatures(degree), LinearRegression(fit_intercept=False))


def raw_polynomial(degree: int) -> Pipeline:
    """Return the polynomial of total degree `degree`, by monomials of the parameters as they are and the normal equations.

    As it may be programmed without a thought for its condition, which the normal equations square.
    """
    return make_pipeline(MonomialFeatures(degree), NormalEquations())


def nearest_neighbour(bounds: Bounds) -> Pipeline:
    """Return what predicts the landing of the nearest training cast, in parameters scaled to their bounds."""
    return make_pipeline(bounds_scaler(bounds), KNeighborsRegressor(n_neighbors=1))


def gaussian_process(bounds: Bounds) -> Pipeline:
    """Return a Gaussian process with a length scale for each parameter and white noise, chosen by marginal likelihood."""
    kernel = ConstantKernel(10.0, (1e-2, 1e5)) * RBF([1.0] * 3, (0.05, 50.0)) + WhiteKernel(1e-4, (1e-10, 1.0))
    process = GaussianProcessRegressor(kernel, normalize_y=True)
    return make_pipeline(bounds_scaler(bounds), SubsetTuned(process))


def neural_network(bounds: Bounds, seed: int = 0) -> Pipeline:
    """Return a neural network of two small layers, by the quasi-Newton method L-BFGS from weights drawn with `seed`."""
    network = QuietMLP(
        hidden_layer_sizes=(32, 32),
        activation="tanh",
        solver="lbfgs",
        alpha=1e-6,
        tol=1e-8,
        max_iter=1500,
        max_fun=3000,
        random_state=seed,
    )
    return make_pipeline(bounds_scaler(bounds), TransformedTargetRegressor(network, transformer=StandardScaler()))


class MonomialFeatures(TransformerMixin, BaseEstimator):
    """Products of powers of the inputs, up to a total degree.

    Parameters
    ----------
    degree : int, default=3
        The largest sum of exponents; with n_features inputs there are `comb(degree + n_features, n_features)` products.
    is_additive : bool, default=False
        Leave out all products of several inputs; `1 + degree * n_features` powers remain.

    Attributes
    ----------
    exponents_ : ndarray of shape (n_terms, n_features)
        Of each product.
    """

    def __init__(self, degree: int = 3, *, is_additive: bool = False) -> None:
        self.degree = degree
        self.is_additive = is_additive

    def fit(self, X: ArrayLike, y: object = None) -> Self:  # noqa: ARG002 - scikit-learn's contract
        """List the exponents for as many inputs as `X` has."""
        n_features = validate_data(self, X, dtype=np.float64).shape[1]
        exponents = np.array(list(product(range(self.degree + 1), repeat=n_features)))
        is_kept = exponents.sum(axis=1) <= self.degree
        if self.is_additive:
            is_kept &= np.count_nonzero(exponents, axis=1) <= 1
        self.exponents_ = exponents[is_kept]
        return self

    def transform(self, X: ArrayLike) -> Array:
        """Return the products, shape (n, n_terms)."""
        check_is_fitted(self)
        X_valid: Array = validate_data(self, X, dtype=np.float64, reset=False)
        terms = np.ones((len(X_valid), len(self.exponents_)))
        for column, exponents in zip(X_valid.T, self.exponents_.T, strict=True):
            terms *= self._powers(column)[:, exponents]
        return terms

    def _powers(self, x: Array) -> Array:
        """Return the powers 0 to `degree` of one input of shape (n,): shape (n, degree + 1)."""
        return np.vander(x, self.degree + 1, increasing=True)


class LegendreFeatures(MonomialFeatures):
    """Products of Legendre polynomials in place of powers, each of unit mean square over [-1, 1]."""

    def _powers(self, x: Array) -> Array:
        scale = np.sqrt(2.0 * np.arange(self.degree + 1) + 1.0)
        return np.asarray(legvander(x, self.degree) * scale, dtype=np.float64)


class NormalEquations(RegressorMixin, BaseEstimator):
    """Least squares by the normal equations in double precision, without an intercept of its own.

    Attributes
    ----------
    coef_ : ndarray of shape (n_features,)
        In units of the targets per unit of the inputs.
    """

    def fit(self, X: ArrayLike, y: ArrayLike) -> Self:
        """Solve `X^T X c = X^T y`."""
        X_valid, y_valid = validate_data(self, X, y, dtype=np.float64, y_numeric=True)
        self.coef_ = np.linalg.solve(X_valid.T @ X_valid, X_valid.T @ y_valid)
        return self

    def predict(self, X: ArrayLike) -> Array:
        """Return the fitted targets, shape (n,)."""
        check_is_fitted(self)
        prediction: Array = validate_data(self, X, dtype=np.float64, reset=False) @ self.coef_
        return prediction


class SubsetTuned(RegressorMixin, BaseEstimator):
    """A Gaussian process whose kernel is chosen by some of the training rows, since each try costs their number cubed.

    Parameters
    ----------
    process : GaussianProcessRegressor
        What is fitted, unfitted.
    n_rows : int, default=400
        The first rows, which choose the kernel.

    Attributes
    ----------
    process_ : GaussianProcessRegressor
        Given all rows.
    """

    def __init__(self, process: GaussianProcessRegressor, n_rows: int = KERNEL_ROWS) -> None:
        self.process = process
        self.n_rows = n_rows

    def fit(self, X: ArrayLike, y: ArrayLike) -> Self:
        """Choose the kernel by the first rows, and condition the process with that kernel on all of them."""
        X_valid, y_valid = validate_data(self, X, y, dtype=np.float64, y_numeric=True)
        # A length scale at its bound is an answer: the input does not matter.
        with warnings.catch_warnings(action="ignore", category=ConvergenceWarning):
            tuned = clone(self.process).fit(X_valid[: self.n_rows], y_valid[: self.n_rows])
        self.process_ = clone(self.process).set_params(kernel=tuned.kernel_, optimizer=None).fit(X_valid, y_valid)
        return self

    def predict(self, X: ArrayLike, return_std: bool = False) -> Any:
        """Return the mean of the process, shape (n,), and with `return_std` the standard deviation of a new target, (n,)."""
        check_is_fitted(self)
        X_valid = validate_data(self, X, dtype=np.float64, reset=False)
        return self.process_.predict(X_valid, return_std=return_std)


class QuietMLP(MLPRegressor):
    """scikit-learn's neural network, which stops at its limit of iterations without a warning: the limit is the price."""

    def fit(self, X: ArrayLike, y: ArrayLike) -> Self:
        """Fit to training data."""
        with warnings.catch_warnings(action="ignore", category=ConvergenceWarning):
            super().fit(X, y)
        return self
