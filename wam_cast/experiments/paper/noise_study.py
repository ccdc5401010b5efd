"""What casts that do not repeat do to the model and to the hit rate."""

from __future__ import annotations

from concurrent.futures import Executor

import numpy as np

from wam_cast.experiments.paper.execution import Thrower, execute_plans
from wam_cast.experiments.paper.findings import PLANNERS
from wam_cast.experiments.paper.results import (
    Chosen,
    NoiseStudy,
    NoisyModel,
    floats,
    maybe_floats,
)
from wam_cast.experiments.paper.selection import (
    make_estimator,
    regularization_curve,
    select_per_parameter,
)
from wam_cast.experiments.paper.settings import OnProgress, Settings
from wam_cast.experiments.statistics import rmse, rmse_interval
from wam_cast.learning.dataset import CastDataset
from wam_cast.learning.forward_model import ForwardModel
from wam_cast.learning.parts import Parts, split_casts
from wam_cast.parallel.seeds import Purpose, derived_seed
from wam_cast.parallel.workers import Workers
from wam_cast.types import Array


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
    report(0, 2 * (len(PLANNERS) + 1) * settings.n_cups)  # what `execute_plans` will report, after the models
    parts = split_casts(noisy)
    chosen = select_per_parameter(scenario, parts)
    curve = regularization_curve(scenario, parts, chosen.sigma)
    train, _, test = clean.split()
    along, across = (_moved(clean, noisy, name)[train] for name in ("landing_along", "landing_across"))

    noisy_model = ForwardModel.from_hyperparameters(noisy, chosen.sigma, chosen.regularization)
    clean_model = ForwardModel.from_hyperparameters(clean, clean_chosen.sigma, clean_chosen.regularization)
    throwers = [Thrower(f"{planner}, learned with noise", planner, noisy_model) for planner in PLANNERS]
    throwers.append(Thrower("program, learned without noise", "program", clean_model))
    executions = execute_plans(
        scenario, throwers, settings.n_cups, seed=settings.seed, executor=executor, report=report
    )
    return NoiseStudy(
        levels=settings.noise.model_dump(),
        statuses={str(status): int(n) for status, n in noisy.frame["status"].value_counts().items()},
        along=maybe_floats(along),
        across=maybe_floats(across),
        along_std=float(np.nanstd(along)),
        across_std=float(np.nanstd(across)),
        models=_measure(settings, split_casts(clean), parts, chosen, clean_chosen),
        # The test casts' noise chooses nothing: it says what is left when a model is perfect.
        test_floor=float(np.sqrt(np.nanmean(_moved(clean, noisy, "landing_along")[test] ** 2))),
        regularization_curve=curve,
        executions=executions,
    )


def _moved(clean: CastDataset, noisy: CastDataset, name: str) -> Array:
    """Return one column of each noisy cast minus that of the same cast without noise, in the order of the rows."""
    return (noisy.frame[name] - clean.frame[name]).to_numpy(dtype=float)


def _measure(
    settings: Settings, clean: Parts, noisy: Parts, chosen: Chosen, clean_chosen: Chosen
) -> tuple[NoisyModel, ...]:
    """Return the errors of models on the noisy test casts, and on the noise-free landings of the validation casts.

    The latter chose nothing here; the noise-free test part has been opened already.
    """
    clean_lambda = chosen.model_copy(update={"regularization": clean_chosen.regularization})
    fits = (
        ("learned with noise, sigma and lambda chosen on it", chosen, noisy.train),
        ("the same with lambda of noise-free casts", clean_lambda, noisy.train),
        ("learned without noise", clean_chosen, clean.train),
    )
    test = noisy.open_test()
    models = []
    for label, parameters, train in fits:
        model = make_estimator(settings.scenario, parameters).fit(train.X, train.landing)
        residuals = model.predict(test.X) - test.landing
        models.append(
            NoisyModel(
                label=label,
                sigma=floats(parameters.sigma),
                regularization=parameters.regularization,
                test_rmse=rmse(residuals),
                test_rmse_interval=rmse_interval(residuals, derived_seed(settings.seed, Purpose.BOOTSTRAP)),
                noise_free_rmse=rmse(model.predict(clean.validation.X) - clean.validation.landing),
            )
        )
    return tuple(models)
