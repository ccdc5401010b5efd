"""Kernel ridge regression of a scenario's casts: how its sigma and lambda are chosen, and how uncertain it then is."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from wam_cast.cast import PARAMETERS, cast_bounds
from wam_cast.errors import InputError
from wam_cast.learning.hyperparameters import TuningResult, tune_by_lbfgs
from wam_cast.learning.kernel.kernel_parameters import checked_n_landmarks, checked_regularization, checked_sigma
from wam_cast.learning.kernel.kernel_regression import KernelRegression
from wam_cast.learning.kernel.landmarks import landmark_rows
from wam_cast.learning.losses import LeaveOneOutLoss
from wam_cast.learning.parts import Part
from wam_cast.learning.uncertainty import LandingUncertainty
from wam_cast.scenario import Scenario
from wam_cast.types import Array

START_SIGMA = 0.5
"""Where the search for the ARD length scales starts: half the width of the bounds."""

MOST_EXACT_CASTS = 5000
"""Training casts up to which kernel ridge regression is exact; its time grows as their cube, its memory as their square."""

N_LANDMARKS = 2000
"""Of the approximation beyond: training casts that the kernel stands at, and that sigma and lambda are chosen by."""

MANY_HELD_OUT = 150
"""Validation casts whose errors show their 95 % quantile: with so many, two standard deviations hold 95 +- 3.5 % of new casts in 19
models of 20, with the 44 of a dataset of 250 casts only 95 +- 6 %."""

N_FOLDS = 5


@dataclass(frozen=True)
class KernelFit:
    """How an estimator is made of a scenario's training casts: with `given` hyperparameters, or with those that it chooses.

    Given are a sigma, a lambda and a number of landmarks, or None for the default number. Without, they are those of
    `tune_model`. Calling it raises `.InputError` if they are not allowed or the kernel matrix is singular.
    """

    scenario: Scenario
    given: tuple[ArrayLike, float, int | None] | None = None

    def __call__(self, train: Part) -> KernelRegression:
        """Return an estimator fitted to training casts."""
        sigma, regularization, n_landmarks = self.given or (*self._tuned(train), None)
        if n_landmarks is None:
            n_landmarks = _n_landmarks(train)
        try:
            distance, speed, wait = (float(one) for one in checked_sigma(np.squeeze(sigma), len(PARAMETERS)))
            regularization = checked_regularization(regularization)
            n_landmarks = checked_n_landmarks(n_landmarks, regularization)
        except ValueError as error:
            raise InputError(f"estimator: {error}") from None
        return fit_kernel(self.scenario, (distance, speed, wait), regularization, n_landmarks, train.X, train.y)

    def _tuned(self, train: Part) -> tuple[ArrayLike, float]:
        tuned = tune_model(self.scenario, train)
        return tuned.sigma, tuned.regularization


def fit_kernel(
    scenario: Scenario, sigma: tuple[float, ...], regularization: float, n_landmarks: int | None, X: Array, y: Array
) -> KernelRegression:
    """Return an estimator of casts X, (n, 3), with `.OUTPUTS` y, (n, 7). Raises `.InputError` if its matrix is singular."""
    estimator = KernelRegression(
        sigma=sigma, regularization=regularization, input_bounds=cast_bounds(scenario), n_landmarks=n_landmarks
    )
    try:
        return estimator.fit(X, y)
    except ValueError as error:  # a singular matrix, too
        raise InputError(f"estimator: {error}") from None


def tune_model(scenario: Scenario, train: Part) -> TuningResult:
    """Return the ARD length scales and the lambda of least leave-one-out error over training casts; of many, over the landmarks."""
    n_landmarks = _n_landmarks(train)
    rows = slice(None) if n_landmarks is None else landmark_rows(len(train.X), n_landmarks)
    loss = LeaveOneOutLoss(train.X[rows], train.landing[rows], input_bounds=cast_bounds(scenario))
    return tune_by_lbfgs(loss, sigma0=[START_SIGMA] * train.X.shape[1])


def learn_uncertainty(estimator: KernelRegression, fit: KernelFit, train: Part, validation: Part) -> LandingUncertainty:
    """Return the uncertainty of an estimator that `fit` has made of the training casts, scaled by casts that it has not seen.

    These are the validation casts. Where they are few, they and the training casts are held out in turn, a fifth at a time, each
    from an estimator and an uncertainty that are made of the others (Vovk, Cross-conformal predictors, 2015): leave-one-out errors
    alone would be too small, since sigma and lambda were chosen by them.
    """
    uncertainty = LandingUncertainty.learn(estimator)
    if len(validation.X) >= MANY_HELD_OUT:
        return uncertainty.scaled_by(_normalized_errors(estimator, uncertainty, validation))
    errors = []
    for others, held_out in _folds(train, validation):
        without = fit(others)
        errors.append(_normalized_errors(without, LandingUncertainty.learn(without), held_out))
    return uncertainty.scaled_by(np.concatenate(errors))


def _folds(train: Part, validation: Part) -> Iterator[tuple[Part, Part]]:
    """Yield the casts of both in two parts, of which the second one is another fifth each time."""
    X, y, is_clean = (np.concatenate(columns) for columns in zip(train, validation, strict=True))
    number = np.arange(len(X)) % N_FOLDS
    for k in range(min(N_FOLDS, len(X))):
        is_other = number != k
        yield Part(X[is_other], y[is_other], is_clean[is_other]), Part(X[~is_other], y[~is_other], is_clean[~is_other])


def _normalized_errors(estimator: KernelRegression, uncertainty: LandingUncertainty, part: Part) -> Array:
    """Return the errors of predicted landings in standard deviations, shape (n,)."""
    return np.asarray((estimator.predict(part.X)[:, 0] - part.landing) / uncertainty.std(part.X))


def _n_landmarks(train: Part) -> int | None:
    """Return how many landmarks a fit to these training casts has by default; None if it is exact."""
    return N_LANDMARKS if len(train.X) > MOST_EXACT_CASTS else None
