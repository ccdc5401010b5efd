"""What casts that do not repeat do to the model and to the hit rate."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from wam_cast.evaluation.experiment.comparison import kernel_ridge
from wam_cast.evaluation.experiment.execution import Thrower, execute_plans
from wam_cast.evaluation.experiment.findings import PLANNERS
from wam_cast.evaluation.experiment.results import (
    Chosen,
    Noise,
    NoisyModel,
    floats,
    maybe_floats,
)
from wam_cast.evaluation.experiment.selection import regularization_curve, select_per_parameter
from wam_cast.evaluation.experiment.settings import OnProgress, Settings
from wam_cast.evaluation.experiment.statistics import rmse
from wam_cast.learning.dataset import CastDataset
from wam_cast.learning.forward_model import ForwardModel
from wam_cast.learning.parts import Parts, split_casts
from wam_cast.learning.workers import Workers

Array = NDArray[np.float64]


def study_noise(
    settings: Settings,
    clean_data: CastDataset,
    noisy_data: CastDataset,
    clean_chosen: Chosen,
    workers: Workers,
    report: OnProgress,
) -> Noise:
    """Fit models to noisy casts, measure them, and execute plans with the noise on.

    Row i of both datasets is the same cast, so that their difference is the noise's doing. `clean_chosen` are the hyperparameters
    that suit casts without noise.
    """
    scenario = settings.noisy_scenario
    report(0, 2 * (len(PLANNERS) + 1) * settings.n_cups)  # what `execute_plans` will report, after the models
    clean, noisy = split_casts(clean_data), split_casts(noisy_data)
    chosen = select_per_parameter(scenario, noisy)
    along, across = _scatter(clean_data, noisy_data)
    curve = regularization_curve(scenario, noisy, chosen.sigma)
    models = _measure(settings, clean, noisy, chosen, clean_chosen)

    noisy_model = ForwardModel.from_hyperparameters(noisy_data, chosen.sigma, chosen.regularization)
    clean_model = ForwardModel.from_hyperparameters(
        clean_data, clean_chosen.sigma, clean_chosen.regularization
    )
    throwers = [Thrower(f"{planner}, learned with noise", planner, noisy_model) for planner in PLANNERS]
    throwers.append(Thrower("program, learned without noise", "program", clean_model))
    executions = execute_plans(
        scenario, throwers, settings.n_cups, noise_seed=settings.seed, workers=workers, report=report
    )
    return Noise(
        levels=settings.noise.model_dump(),
        along=maybe_floats(along),
        across=maybe_floats(across),
        along_std=float(np.nanstd(along)),
        across_std=float(np.nanstd(across)),
        models=models,
        regularization_curve=curve,
        executions=executions,
    )


def _scatter(clean: CastDataset, noisy: CastDataset) -> tuple[Array, Array]:
    """Return the landing of each noisy training cast minus that of the same one without noise, along and across [m]."""
    train, _, _ = clean.split()
    along, across = (
        (noisy.frame[name] - clean.frame[name]).to_numpy(dtype=float)[train]
        for name in ("landing_along", "landing_across")
    )
    return along, across


def _measure(
    settings: Settings, clean: Parts, noisy: Parts, chosen: Chosen, clean_chosen: Chosen
) -> tuple[NoisyModel, ...]:
    """Return the errors of models on the noisy test casts, and on the noise-free landings of the validation casts.

    The latter chose nothing here; the noise-free test part has been opened already.
    """
    fits = (
        ("learned with noise, lambda chosen on it", chosen, noisy.train),
        ("learned with noise, lambda of noise-free casts", clean_chosen, noisy.train),
        ("learned without noise", clean_chosen, clean.train),
    )
    test = noisy.open_test()
    models = []
    for label, parameters, train in fits:
        model = kernel_ridge(settings.scenario, parameters).fit(train.X, train.landing)
        models.append(
            NoisyModel(
                label=label,
                sigma=floats(parameters.sigma),
                regularization=parameters.regularization,
                test_rmse=rmse(model.predict(test.X) - test.landing),
                noise_free_rmse=rmse(model.predict(clean.validation.X) - clean.validation.landing),
            )
        )
    return tuple(models)
