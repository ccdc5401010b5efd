"""What casts that do not repeat do to the model and to the hit rate."""

from __future__ import annotations

from concurrent.futures import Executor

import numpy as np
import pandas as pd

from wam_cast.experiments.frames import Columns, Record, Result, Rows, Values
from wam_cast.experiments.paper.selection import Chosen, make_estimator, regularization_curve, select_per_parameter
from wam_cast.experiments.paper.settings import PLANNERS, OnProgress, Settings
from wam_cast.experiments.statistics import rmse, rmse_interval
from wam_cast.experiments.trials import Thrower, count_statuses, line_of_cups, plan_and_execute
from wam_cast.learning.dataset import CastDataset
from wam_cast.learning.forward_model import ForwardModel
from wam_cast.learning.parts import Parts, split_casts
from wam_cast.parallel.seeds import Purpose, derived_seed
from wam_cast.parallel.workers import Workers

LEARNED_WITH_NOISE = "learned with noise"
"""Ends the label of an execution whose model did."""


class NoiseStudy(Result):
    """The section on casts that do not repeat.

    Attributes
    ----------
    levels
        Of the scenario's noise.
    statuses
        Of the noisy casts.
    along, across
        Landing of each noisy training cast minus that of the same cast without noise [m], nan where one of them never landed.
    along_std, across_std
        Standard deviations of these [m].
    test_floor
        Root mean square of the same difference along the casting plane over the test casts [m]: what no model can predict.
    models
        A row a model, fitted to noisy casts or to others: its `label`, `sigma` and `regularization`, `test_rmse` on noisy test
        casts with its bootstrap interval, and `noise_free_rmse` against landings without noise [m].
    regularization_curve
        On noisy casts, an error curve as of `.Selection`.
    executions
        Trials with noise.
    """

    levels: dict[str, float]
    statuses: dict[str, int]
    along: Values
    across: Values
    along_std: float
    across_std: float
    test_floor: float
    models: Rows
    regularization_curve: Columns
    executions: Rows


def study_noise(
    settings: Settings,
    clean: CastDataset,
    noisy: CastDataset,
    clean_chosen: Chosen,
    executor: Executor | Workers,
    report: OnProgress,
) -> NoiseStudy:
    """Fit models to noisy casts, measure them, and execute plans with the noise on.

    Row i of both datasets is the same cast, so that their difference is the noise's doing. `clean_chosen` are the hyperparameters
    that suit casts without noise.
    """
    scenario = settings.noisy_scenario
    # What `plan_and_execute` will report, after the models.
    report(0, 2 * (len(PLANNERS) + 1) * settings.n_cups)
    parts = split_casts(noisy)
    chosen = select_per_parameter(scenario, parts)
    curve = regularization_curve(scenario, parts, chosen.sigma)
    train, _, test = clean.split()
    names = ["landing_along", "landing_across"]
    moved = (noisy.frame[names] - clean.frame[names]).to_numpy(dtype=float)
    along, across = moved[train].T

    noisy_model = ForwardModel.from_hyperparameters(noisy, chosen.sigma, chosen.regularization)
    clean_model = ForwardModel.from_hyperparameters(clean, clean_chosen.sigma, clean_chosen.regularization)
    throwers = [
        *((f"{planner}, {LEARNED_WITH_NOISE}", planner, noisy_model) for planner in PLANNERS),
        ("program, learned without noise", "program", clean_model),
    ]
    trials = plan_and_execute(
        scenario,
        [Thrower(*one, line_of_cups(one[-1], settings.n_cups)) for one in throwers],
        seed=settings.seed,
        executor=executor,
        report=report,
    )
    return NoiseStudy(
        levels=settings.noise.model_dump(),
        statuses=count_statuses(noisy.frame["status"]),
        along=along,
        across=across,
        along_std=float(np.nanstd(along)),
        across_std=float(np.nanstd(across)),
        models=_measure(settings, split_casts(clean), parts, chosen, clean_chosen),
        # The test casts' noise chooses nothing: it says what is left when a model is perfect.
        test_floor=float(np.sqrt(np.nanmean(moved[test, 0] ** 2))),
        regularization_curve=curve,
        executions=trials,
    )


def _measure(settings: Settings, clean: Parts, noisy: Parts, chosen: Chosen, clean_chosen: Chosen) -> pd.DataFrame:
    """Return the errors of models on the noisy test casts, and on the noise-free landings of the validation casts.

    The latter chose nothing here; the noise-free test part has been opened already.
    """
    clean_lambda = chosen.model_copy(update={"regularization": clean_chosen.regularization})
    fits = (
        (f"{LEARNED_WITH_NOISE}, sigma and lambda chosen on it", chosen, noisy.train),
        ("the same with lambda of noise-free casts", clean_lambda, noisy.train),
        ("learned without noise", clean_chosen, clean.train),
    )
    test = noisy.open_test()
    models: list[Record] = []
    for label, parameters, train in fits:
        model = make_estimator(settings.scenario, parameters).fit(train.X, train.landing)
        residuals = model.predict(test.X) - test.landing
        models.append(
            {
                "label": label,
                "sigma": parameters.sigma,
                "regularization": parameters.regularization,
                "test_rmse": rmse(residuals),
                "test_rmse_interval": rmse_interval(residuals, derived_seed(settings.seed, Purpose.BOOTSTRAP)),
                "noise_free_rmse": rmse(model.predict(clean.validation.X) - clean.validation.landing),
            }
        )
    return pd.DataFrame(models)
