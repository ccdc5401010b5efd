"""Model selection: sigma as in the paper, and a better way."""

from __future__ import annotations

import itertools
from collections.abc import Callable

import numpy as np
import pandas as pd

from wam_cast.cast import cast_bounds
from wam_cast.experiments.frames import Columns, Result
from wam_cast.experiments.paper import published as paper
from wam_cast.experiments.paper.baselines import Bounds
from wam_cast.experiments.paper.settings import OnProgress
from wam_cast.experiments.statistics import rmse
from wam_cast.learning.hyperparameters import TuningResult, tune_by_descent, tune_by_lbfgs
from wam_cast.learning.kernel_fit import START_SIGMA, tune_model
from wam_cast.learning.kernel_ridge import KernelRidge
from wam_cast.learning.losses import LeaveOneOutLoss, ValidationLoss
from wam_cast.learning.parts import Parts
from wam_cast.scenario import Scenario
from wam_cast.types import Array

SIGMAS = np.geomspace(0.1, 3.0, 31)
REGULARIZATIONS = np.geomspace(1e-10, 1e-1, 19)
PAPERS_REGULARIZATIONS = np.array([1e-8, 1e-6, 1e-4, 1e-2, 1.0])
"""At which the paper's own sigma is tried."""

SI_UNITS = (np.zeros(3), np.ones(3))
"""Bounds that leave parameters as they are."""

DESCENT_STARTS = (0.2, 1.5)
"""Of the paper's descent, on either side of the minimum: the error is not convex in sigma."""


class Chosen(Result):
    """Hyperparameters of the kernel regression and their errors [m]; `sigma` has one value or one for each parameter."""

    sigma: tuple[float, ...]
    regularization: float
    leave_one_out_rmse: float
    validation_rmse: float


class Selection(Result):
    """The model selection.

    An error curve has the columns `x`, the hyperparameter, and `validation_rmse` and `leave_one_out_rmse` [m], nan where the
    kernel matrix is singular.

    Attributes
    ----------
    by_validation
        As in the paper: sigma by gradient descent on the validation error, lambda that of `isotropic`.
    isotropic, per_parameter
        Sigma, one or one for each parameter, and lambda by leave-one-out.
    sigma_curve, regularization_curve
        Each with the other hyperparameter as in `isotropic`.
    papers_curve
        Errors over lambda with the paper's sigma, on parameters in SI units that are not scaled.
    descents
        Steps on the validation error over sigma, `x`, and the error there, `rmse` [m], each from another start; the best one gave
        `by_validation`.
    """

    by_validation: Chosen
    isotropic: Chosen
    per_parameter: Chosen
    sigma_curve: Columns
    regularization_curve: Columns
    papers_curve: Columns
    descents: tuple[Columns, ...]


def select_models(scenario: Scenario, parts: Parts, report: OnProgress) -> Selection:
    """Choose sigma and lambda in three ways, and trace the errors over each; the test part stays closed."""
    bounds, train, validation = cast_bounds(scenario), parts.train, parts.validation
    n_steps = len(SIGMAS) + len(REGULARIZATIONS) + len(PAPERS_REGULARIZATIONS) + 2 + len(DESCENT_STARTS)
    steps = itertools.count(1)

    def finished() -> None:
        report(next(steps), n_steps)

    report(0, n_steps)
    loss = LeaveOneOutLoss(train.X, train.landing, input_bounds=bounds)
    isotropic = _choose(tune_by_lbfgs(loss, sigma0=START_SIGMA), bounds, parts)
    finished()
    per_parameter = select_per_parameter(scenario, parts)
    finished()
    papers_loss = ValidationLoss(train.X, train.landing, validation.X, validation.landing, input_bounds=bounds)
    descents = []
    for start in DESCENT_STARTS:
        descents.append(tune_by_descent(papers_loss, sigma0=start, regularization=isotropic.regularization))
        finished()
    regularization, (sigma,) = isotropic.regularization, isotropic.sigma
    return Selection(
        by_validation=_choose(min(descents, key=lambda tuned: tuned.rmse), bounds, parts),
        isotropic=isotropic,
        per_parameter=per_parameter,
        sigma_curve=_curve(SIGMAS, lambda x: (x, regularization), bounds, parts, finished),
        regularization_curve=_curve(REGULARIZATIONS, lambda x: (sigma, x), bounds, parts, finished),
        papers_curve=_curve(PAPERS_REGULARIZATIONS, lambda x: (paper.SIGMA, x), SI_UNITS, parts, finished),
        descents=tuple(pd.DataFrame({"x": tuned.sigma_path, "rmse": tuned.rmse_path}) for tuned in descents),
    )


def make_estimator(scenario: Scenario, chosen: Chosen) -> KernelRidge:
    """Return the unfitted estimator with hyperparameters that were chosen."""
    sigma = chosen.sigma[0] if len(chosen.sigma) == 1 else np.array(chosen.sigma)
    return KernelRidge(sigma=sigma, regularization=chosen.regularization, input_bounds=cast_bounds(scenario))


def select_per_parameter(scenario: Scenario, parts: Parts) -> Chosen:
    """Choose ARD length scales and lambda; the test part stays closed."""
    return _choose(tune_model(scenario, parts.train), cast_bounds(scenario), parts)


def regularization_curve(scenario: Scenario, parts: Parts, sigma: tuple[float, ...]) -> pd.DataFrame:
    """Return the errors over lambda at one `sigma`."""
    return _curve(REGULARIZATIONS, lambda x: (np.array(sigma), x), cast_bounds(scenario), parts)


def _choose(tuned: TuningResult, bounds: Bounds, parts: Parts) -> Chosen:
    loo, validation = _errors(np.asarray(tuned.sigma), tuned.regularization, bounds, parts)
    return Chosen(
        sigma=tuple(np.ravel(tuned.sigma).tolist()),
        regularization=tuned.regularization,
        leave_one_out_rmse=loo,
        validation_rmse=validation,
    )


def _curve(
    values: Array,
    at: Callable[[float], tuple[float | Array, float]],
    bounds: Bounds,
    parts: Parts,
    finished: Callable[[], None] = lambda: None,
) -> pd.DataFrame:
    """Return the error curve over values of a hyperparameter, `at` each of which sigma and lambda are known."""
    errors = []
    for value in values:
        errors.append(_errors(*at(float(value)), bounds, parts))
        finished()
    loo, validation = np.array(errors).T
    return pd.DataFrame({"x": values, "validation_rmse": validation, "leave_one_out_rmse": loo})


def _errors(sigma: float | Array, regularization: float, bounds: Bounds, parts: Parts) -> tuple[float, float]:
    """Return the leave-one-out RMSE and the validation RMSE [m]; nan if the kernel matrix is singular."""
    model = KernelRidge(sigma=sigma, regularization=regularization, input_bounds=bounds)
    try:
        model.fit(parts.train.X, parts.train.landing)
    except np.linalg.LinAlgError:
        return np.nan, np.nan
    validation = rmse(model.predict(parts.validation.X) - parts.validation.landing)
    return rmse(model.leave_one_out_residuals()), validation
