"""Learning curves: errors on the validation casts over the number of training casts, which are drawn repeatedly."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import closing
from dataclasses import dataclass
from functools import partial
from typing import Any

import numpy as np
from numpy.typing import NDArray
from sklearn.model_selection import GridSearchCV
from threadpoolctl import threadpool_limits

from wam_cast.cast import cast_bounds
from wam_cast.errors import InputError
from wam_cast.evaluation.experiment.results import Band, LearningCurves, floats
from wam_cast.evaluation.experiment.statistics import rmse
from wam_cast.learning import baselines
from wam_cast.learning.kernel_ridge import KernelRidge
from wam_cast.learning.leave_one_out import tune_by_leave_one_out
from wam_cast.learning.parts import Part, Parts
from wam_cast.learning.workers import run_rows
from wam_cast.scenario import Scenario

Array = NDArray[np.float64]
Report = Callable[[int, int], None]

SIZES = (25, 50, 100, 200, 400, 800, 1300)
MAX_DEGREE = 8
N_FOLDS = 5


@dataclass(frozen=True)
class _Task:
    """What one worker needs to fit one estimator to growing subsets of the training casts."""

    scenario: Scenario
    train: Part
    validation: Part
    sizes: tuple[int, ...]
    seed: int


def learn_with_fewer_casts(
    scenario: Scenario, parts: Parts, seed: int, n_repeats: int, report: Report
) -> LearningCurves:
    """Return the validation RMSE of estimators that were chosen and fitted on random subsets of the training casts alone.

    A repeat draws one order of the training casts; its subsets are that order's beginnings. Hyperparameters are chosen anew on
    each subset, without the validation casts: they measure only. The test part stays closed.
    """
    n_train = len(parts.train.X)
    sizes = (*(size for size in SIZES if size < n_train), n_train)
    task = _Task(scenario, parts.train, parts.validation, sizes, seed)
    jobs = [(name, repeat) for repeat in range(n_repeats) for name in _CURVES]
    errors: dict[str, list[Array]] = {name: [] for name in _CURVES}
    report(0, len(jobs))
    with closing(run_rows(partial(_run_job, task, jobs), range(len(jobs)))) as results:
        for done, ((name, _), result) in enumerate(zip(jobs, results, strict=True), 1):
            if result is None:
                raise InputError(
                    f"learning curve of {name}: its process died; free some memory and start again"
                )
            errors[name].append(result)
            report(done, len(jobs))
    return LearningCurves(
        n_train=sizes,
        n_repeats=n_repeats,
        curves={name: _band(np.array(errors[name])) for name in _CURVES},
    )


def _band(errors: Array) -> Band:
    return Band(
        median=floats(np.median(errors, axis=0)),
        low=floats(errors.min(axis=0)),
        high=floats(errors.max(axis=0)),
    )


def _run_job(task: _Task, jobs: list[tuple[str, int]], row: int) -> Array:
    """Return the validation RMSE [m] over the sizes of one estimator and one order of the casts."""
    name, repeat = jobs[row]
    rng = np.random.default_rng(np.random.SeedSequence(task.seed, spawn_key=(repeat,)))
    order = rng.permutation(len(task.train.X))
    X, y = task.train.X[order], task.train.landing[order]
    # One thread each: as many processes run as there are processors.
    with threadpool_limits(1):
        models = _CURVES[name](task, X, y)
        errors = [rmse(model.predict(task.validation.X) - task.validation.landing) for model in models]
    return np.array(errors)


def _kernel_ridges(task: _Task, X: Array, y: Array, sigma: Any) -> Iterator[KernelRidge]:
    """Yield the kernel regressions of the growing subsets; each search starts where the one before it ended."""
    bounds = cast_bounds(task.scenario)
    for size in task.sizes:
        tuned = tune_by_leave_one_out(X[:size], y[:size], sigma0=sigma, input_bounds=bounds)
        sigma = tuned.sigma
        yield KernelRidge(sigma=sigma, regularization=tuned.regularization, input_bounds=bounds).fit(
            X[:size], y[:size]
        )


def _isotropic(task: _Task, X: Array, y: Array) -> Iterator[Any]:
    return _kernel_ridges(task, X, y, 0.5)


def _per_parameter(task: _Task, X: Array, y: Array) -> Iterator[Any]:
    return _kernel_ridges(task, X, y, np.full(3, 0.5))


def _fitted(make: Callable[[_Task], Any], task: _Task, X: Array, y: Array) -> Iterator[Any]:
    for size in task.sizes:
        yield make(task).fit(X[:size], y[:size])


def _polynomial(task: _Task) -> Any:
    grid = {"legendrefeatures__degree": list(range(1, MAX_DEGREE + 1))}
    return GridSearchCV(
        baselines.polynomial(1, cast_bounds(task.scenario)),
        grid,
        cv=N_FOLDS,
        scoring="neg_mean_squared_error",
    )


_CURVES: dict[str, Callable[[_Task, Array, Array], Iterator[Any]]] = {
    "KRR, a sigma for each parameter": _per_parameter,
    "KRR, one sigma": _isotropic,
    "Gaussian process": partial(_fitted, lambda task: baselines.gaussian_process(cast_bounds(task.scenario))),
    "polynomial": partial(_fitted, _polynomial),
    "neural network": partial(
        _fitted, lambda task: baselines.neural_network(cast_bounds(task.scenario), task.seed)
    ),
    "nearest neighbour": partial(
        _fitted, lambda task: baselines.nearest_neighbour(cast_bounds(task.scenario))
    ),
}
"""Estimators by label; each yields its models for the growing subsets."""
