"""Any regressor in the place of kernel ridge regression: what planners ask of it beside its prediction, by finite differences."""

from __future__ import annotations

from copy import copy
from typing import Protocol, Self

import numpy as np
from numpy.typing import ArrayLike

from wam_cast.errors import InputError, quoted
from wam_cast.types import Array

STEP = 0.01
"""Half the distance of the two predictions that a derivative is taken from, in units of the bounds: a smooth model is nearly a
line there, and a forest has several leaves."""


class Regressor(Protocol):
    """What scikit-learn calls a regressor: one of several outputs, such as `RandomForestRegressor`."""

    def fit(self, X: ArrayLike, y: ArrayLike) -> object:
        """Fit to inputs X, shape (n, n_features), and targets y, shape (n, n_outputs)."""

    def predict(self, X: ArrayLike) -> ArrayLike:
        """Predict the targets, shape (n, n_outputs)."""


class AnyRegressor:
    """Asks a regressor for its predictions, and takes their derivatives by central differences.

    Fits a clone of `regressor`, which is left as it is. `bounds` are the inputs' lower and upper bounds, each of shape
    (n_features,).

    Attributes
    ----------
    X_fit_
        The training inputs, shape (n, n_features).
    """

    def __init__(self, regressor: Regressor, bounds: tuple[Array, Array]) -> None:
        if isinstance(regressor, type) or not (hasattr(regressor, "fit") and hasattr(regressor, "predict")):
            raise InputError(
                f"estimator {quoted(regressor)} is no regressor: give an instance with the methods fit and predict, "
                "such as sklearn.gaussian_process.GaussianProcessRegressor()"
            )
        from sklearn.base import clone  # takes a second, which planning a cast does not need

        self._regressor: Regressor = clone(regressor, safe=False)
        self._steps = STEP * np.diag(bounds[1] - bounds[0])
        self._outputs: int | slice = slice(None)

    def fit(self, X: Array, y: Array) -> Self:
        """Fit to inputs, shape (n, n_features), and targets, shape (n, n_outputs).

        Raises
        ------
        InputError
            If the regressor refuses them, or its predictions are not as many finite numbers.
        """
        self.X_fit_ = X.copy()
        self._n_outputs = y.shape[1]
        try:
            self._regressor.fit(X, y)
            self.predict(X[:2])
        except ValueError as error:
            raise InputError(
                f"estimator {_name(self._regressor)} cannot be fitted to {y.shape[1]} outputs ({' '.join(str(error).split())}); "
                "if it has one output only, wrap it: sklearn.multioutput.MultiOutputRegressor(estimator)"
            ) from None
        return self

    def predict(self, X: Array) -> Array:
        """Return the predictions, shape (n, n_outputs); of shape (n,) if this is one `output`."""
        prediction = np.asarray(self._regressor.predict(X), dtype=float)
        if prediction.shape != (len(X), self._n_outputs) or not np.all(np.isfinite(prediction)):
            raise ValueError(f"its predictions of {len(X)} casts are not {self._n_outputs} finite numbers each")
        return np.asarray(prediction[:, self._outputs])

    def linearize(self, X: Array) -> tuple[Array, Array]:
        """Return the predictions, and their derivatives by the inputs as the last axis."""
        points = X + np.vstack([np.zeros_like(self._steps[:1]), self._steps, -self._steps])[:, np.newaxis]
        values = self.predict(points.reshape(-1, X.shape[1]))
        middle, above, below = np.split(
            values.reshape(len(points), len(X), *values.shape[1:]), [1, len(self._steps) + 1]
        )
        gradient = np.moveaxis(above - below, 0, -1) / (2 * self._steps.diagonal())
        return middle[0], gradient

    def output(self, index: int) -> Self:
        """Return the same for one of its outputs."""
        one = copy(self)
        one._outputs = index
        return one


def _name(regressor: object) -> str:
    return type(regressor).__name__
