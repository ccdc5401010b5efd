"""Learning curves: errors on the validation casts over the number of training casts, which are drawn repeatedly."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Callable
from concurrent.futures import Executor
from contextlib import closing
from functools import partial
from typing import Any

import numpy as np
import pandas as pd
from sklearn.model_selection import GridSearchCV

from wam_cast.cast import PARAMETERS, cast_bounds
from wam_cast.experiments.frames import Columns, Result
from wam_cast.experiments.paper import baselines
from wam_cast.experiments.paper.baselines import Bounds
from wam_cast.experiments.paper.settings import OnProgress
from wam_cast.experiments.statistics import rmse
from wam_cast.learning.hyperparameters import tune_by_lbfgs
from wam_cast.learning.kernel_fit import START_SIGMA
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


def learn_with_fewer_casts(
    scenario: Scenario, parts: Parts, seed: int, n_repeats: int, executor: Executor | Workers, report: OnProgress
) -> LearningCurves:
    """Return the validation RMSE of estimators that were chosen and fitted on random subsets of the training casts alone.

    A repeat draws one order of the training casts; its subsets are that order's beginnings. Hyperparameters are chosen anew on
    each subset, without the validation casts: they measure only. The test part stays closed.
    """
    n_train = len(parts.train.X)
    sizes = (*(size for size in SIZES if size < n_train), n_train)
    # All casts make one subset only; the largest fits come first, so that no processor is left with one in the end.
    jobs = [
        (name, size, repeat)
        for size in reversed(sizes)
        for name in _FITS
        for repeat in range(1 if size == n_train else n_repeats)
    ]
    errors: dict[tuple[str, int], list[float]] = defaultdict(list)
    report(0, len(jobs))
    run_job = partial(_run_job, jobs, cast_bounds(scenario), parts.train, parts.validation, seed)
    with closing(run_rows(run_job, range(len(jobs)), executor)) as results:
        for done, ((name, size, _), result) in enumerate(zip(jobs, results, strict=True), 1):
            errors[name, size].append(result)
            report(done, len(jobs))
    return LearningCurves(
        n_train=sizes,
        n_repeats=n_repeats,
        curves={name: pd.DataFrame([_band(errors[name, size]) for size in sizes]) for name in _FITS},
    )


def _band(errors: list[float]) -> dict[str, float]:
    return {"median": float(np.median(errors)), "low": min(errors), "high": max(errors)}


def _run_job(
    jobs: list[tuple[str, int, int]], bounds: Bounds, train: Part, validation: Part, seed: int, row: int
) -> float:
    """Return the validation RMSE [m] of one estimator that is fitted to one subset."""
    name, size, repeat = jobs[row]
    rng = np.random.default_rng(derived_seed(seed, Purpose.SUBSETS, repeat))
    subset = rng.permutation(len(train.X))[:size]
    # One thread each: as many processes run as there are processors.
    with one_thread():
        model = _FITS[name](train.X[subset], train.landing[subset], bounds, derived_seed(seed, Purpose.NETWORK))
        return rmse(model.predict(validation.X) - validation.landing)


def fit_self_tuned(X: Array, y: Array, bounds: Bounds, n_sigmas: int) -> KernelRidge:
    """Fit kernel ridge regression, its lambda and its `n_sigmas` sigmas (1 or 3) chosen by leave-one-out on the same data."""
    sigma0 = START_SIGMA if n_sigmas == 1 else [START_SIGMA] * n_sigmas
    tuned = tune_by_lbfgs(LeaveOneOutLoss(X, y, input_bounds=bounds), sigma0=sigma0)
    return KernelRidge(sigma=tuned.sigma, regularization=tuned.regularization, input_bounds=bounds).fit(X, y)


def _fit_polynomial(X: Array, y: Array, bounds: Bounds) -> GridSearchCV:
    """Fit a polynomial of the degree that cross-validation chooses."""
    grid = {"legendrefeatures__degree": list(range(1, MAX_DEGREE + 1))}
    search = GridSearchCV(baselines.polynomial(1, bounds), grid, cv=N_FOLDS, scoring="neg_mean_squared_error")
    return search.fit(X, y)


_FITS: dict[str, Callable[[Array, Array, Bounds, int], Any]] = {
    "KRR, ARD length scales": lambda X, y, bounds, _: fit_self_tuned(X, y, bounds, len(PARAMETERS)),
    "KRR, one sigma": lambda X, y, bounds, _: fit_self_tuned(X, y, bounds, 1),
    "Gaussian process": lambda X, y, bounds, _: baselines.gaussian_process(bounds).fit(X, y),
    "polynomial": lambda X, y, bounds, _: _fit_polynomial(X, y, bounds),
    "neural network": lambda X, y, bounds, seed: baselines.neural_network(bounds, seed).fit(X, y),
    "nearest neighbour": lambda X, y, bounds, _: baselines.nearest_neighbour(bounds).fit(X, y),
}
"""What fits each estimator to casts and landings, with the bounds and a seed, by its label."""
