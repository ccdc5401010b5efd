"""Learning curves: errors on the validation casts over the number of training casts, which are drawn repeatedly."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Callable
from concurrent.futures import Executor
from contextlib import closing
from dataclasses import dataclass
from functools import partial
from typing import Any, Self

import numpy as np
import pandas as pd
from sklearn.base import BaseEstimator, RegressorMixin
from sklearn.model_selection import GridSearchCV

from wam_cast.cast import PARAMETERS, cast_bounds
from wam_cast.errors import InputError
from wam_cast.experiments.frames import Columns, Result
from wam_cast.experiments.paper import baselines
from wam_cast.experiments.paper.baselines import Bounds
from wam_cast.experiments.paper.settings import OnProgress
from wam_cast.experiments.statistics import rmse
from wam_cast.learning.forward_model import START_SIGMA
from wam_cast.learning.hyperparameters import tune_by_lbfgs
from wam_cast.learning.kernel_ridge import KernelRidge
from wam_cast.learning.losses import LeaveOneOutLoss
from wam_cast.learning.parts import Part, Parts
from wam_cast.parallel.seeds import Purpose, derived_seed
from wam_cast.parallel.threads import one_thread
from wam_cast.parallel.workers import Workers, run_rows
from wam_cast.scenario import Scenario
from wam_cast.types import Array

SIZES = (25, 50, 100, 200, 400, 800, 1300)
MAX_DEGREE = 8
N_FOLDS = 5


class LearningCurves(Result):
    """Validation RMSE [m] by the estimator's label, each with a row for a number of training casts.

    The columns are `median`, `low` and `high`: of the repeated subsets of that size.
    """

    n_train: tuple[int, ...]
    n_repeats: int
    curves: dict[str, Columns]


@dataclass(frozen=True)
class _Task:
    """What every job of the learning curves needs."""

    scenario: Scenario
    train: Part
    validation: Part
    seed: int


def learn_with_fewer_casts(
    scenario: Scenario, parts: Parts, seed: int, n_repeats: int, executor: Executor | Workers, report: OnProgress
) -> LearningCurves:
    """Return the validation RMSE of estimators that were chosen and fitted on random subsets of the training casts alone.

    A repeat draws one order of the training casts; its subsets are that order's beginnings. Hyperparameters are chosen anew on
    each subset, without the validation casts: they measure only. The test part stays closed.
    """
    n_train = len(parts.train.X)
    sizes = (*(size for size in SIZES if size < n_train), n_train)
    task = _Task(scenario, parts.train, parts.validation, seed)
    # All casts make one subset only; the largest fits come first, so that no processor is left with one in the end.
    jobs = [
        (name, size, repeat)
        for size in reversed(sizes)
        for name in _ESTIMATORS
        for repeat in range(1 if size == n_train else n_repeats)
    ]
    errors: dict[tuple[str, int], list[float]] = defaultdict(list)
    report(0, len(jobs))
    with closing(run_rows(partial(_run_job, task, jobs), range(len(jobs)), executor)) as results:
        for done, ((name, size, _), result) in enumerate(zip(jobs, results, strict=True), 1):
            if result is None:
                raise InputError(f"learning curve, {name}: its process died; free memory and start again")
            errors[name, size].append(result)
            report(done, len(jobs))
    return LearningCurves(
        n_train=sizes,
        n_repeats=n_repeats,
        curves={name: _band([errors[name, size] for size in sizes]) for name in _ESTIMATORS},
    )


def _band(errors: list[list[float]]) -> pd.DataFrame:
    """Return the band of the errors of each size."""
    return pd.DataFrame(
        {
            "median": [np.median(values) for values in errors],
            "low": [min(values) for values in errors],
            "high": [max(values) for values in errors],
        }
    )


def _run_job(task: _Task, jobs: list[tuple[str, int, int]], row: int) -> float:
    """Return the validation RMSE [m] of one estimator that is fitted to one subset."""
    name, size, repeat = jobs[row]
    rng = np.random.default_rng(derived_seed(task.seed, Purpose.SUBSETS, repeat))
    subset = rng.permutation(len(task.train.X))[:size]
    # One thread each: as many processes run as there are processors.
    with one_thread():
        model = _ESTIMATORS[name](cast_bounds(task.scenario), derived_seed(task.seed, Purpose.NETWORK))
        model.fit(task.train.X[subset], task.train.landing[subset])
        return rmse(model.predict(task.validation.X) - task.validation.landing)


class SelfTunedKernelRidge(RegressorMixin, BaseEstimator):
    """Kernel ridge regression that chooses its own sigma and lambda by leave-one-out.

    Parameters
    ----------
    bounds : pair (lower, upper)
        Of the inputs.
    n_sigmas : int, default=1
        One for all inputs, or as many as there are inputs.

    Attributes
    ----------
    model_ : KernelRidge
        Fitted.
    """

    def __init__(self, bounds: Bounds, n_sigmas: int = 1) -> None:
        self.bounds = bounds
        self.n_sigmas = n_sigmas

    def fit(self, X: Array, y: Array) -> Self:
        """Choose on the training data, and fit to it."""
        sigma0 = START_SIGMA if self.n_sigmas == 1 else [START_SIGMA] * self.n_sigmas
        tuned = tune_by_lbfgs(LeaveOneOutLoss(X, y, input_bounds=self.bounds), sigma0=sigma0)
        self.model_ = KernelRidge(sigma=tuned.sigma, regularization=tuned.regularization, input_bounds=self.bounds).fit(
            X, y
        )
        return self

    def predict(self, X: Array) -> Array:
        """Return the predicted targets, shape (n,)."""
        return self.model_.predict(X)


def _polynomial(bounds: Bounds, _seed: int) -> Any:
    """Return a polynomial that chooses its degree by cross-validation."""
    grid = {"legendrefeatures__degree": list(range(1, MAX_DEGREE + 1))}
    return GridSearchCV(baselines.polynomial(1, bounds), grid, cv=N_FOLDS, scoring="neg_mean_squared_error")


_ESTIMATORS: dict[str, Callable[[Bounds, int], Any]] = {
    "KRR, ARD length scales": lambda bounds, _: SelfTunedKernelRidge(bounds, len(PARAMETERS)),
    "KRR, one sigma": lambda bounds, _: SelfTunedKernelRidge(bounds),
    "Gaussian process": lambda bounds, _: baselines.gaussian_process(bounds),
    "polynomial": _polynomial,
    "neural network": baselines.neural_network,
    "nearest neighbour": lambda bounds, _: baselines.nearest_neighbour(bounds),
}
"""What makes each estimator, of the bounds and a seed, by its label."""
