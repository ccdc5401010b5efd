"""Which casts to practise: those that tell most about where the casts will land that are wanted."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from wam_cast.adaptation.adaptive_model import AdaptiveModel
from wam_cast.adaptation.priors.filling import filling_casts
from wam_cast.adaptation.robot import LANDING_STD
from wam_cast.cast import Cast
from wam_cast.errors import checked_integer
from wam_cast.planning.plan import plan_cast
from wam_cast.planning.prediction import PEAK_TORQUE_UTILIZATION, PEAK_VELOCITY_UTILIZATION, SLACK
from wam_cast.types import Array, Position

N_CANDIDATES = 256
"""Casts, evenly over the bounds, of which the best is chosen."""

N_RADII = 9
"""Cups over the reach that stand for the floor."""

MOST_UTILIZATION = 0.98
"""Of a cast that is worth practising, as of a plan."""


def choose_practice(model: AdaptiveModel, n_casts: int, cups: Sequence[Position] | None = None) -> list[Cast]:
    """Return the casts to practise next, at bearing 0, the best one first.

    ::

        x* = argmax_x sum_t cov(t, x)^2 / (var(x) + noise(x))

    over candidates x, where t are the casts that the model plans now for the cups, and cov and var are those of the landing along
    the plane under the model's posterior: the landing of x lowers their summed variance by just that (the A-optimal design of
    Bayesian linear regression, one cast at a time). Where a cast will land does not matter to it, so that several may be chosen at
    once. A cast that scatters is worth less.

    Parameters
    ----------
    model
        What is known.
    n_casts
        How many, 1 at least.
    cups
        World (x, y) [m] of the cups that are wanted; by default the whole floor that the model reaches.

    Raises
    ------
    InputError
        If the number is none, or a cup is out of reach.
    """
    checked_integer("n_casts", n_casts, 1)
    wanted = [(radius, 0.0) for radius in np.linspace(*model.reach, N_RADII + 2)[1:-1]] if cups is None else cups
    targets = np.array([plan_cast(model, cup).cast.to_array()[:3] for cup in wanted])
    candidates = _candidates(model)
    features, goals = model.landing_components(candidates), model.landing_components(targets)
    noise = LANDING_STD**2 + np.array([model.noise_variance(cast)[0] for cast in candidates])
    covariance, chosen = model.posterior.covariance, []
    for _ in range(n_casts):
        of_candidates = features @ covariance
        variances = np.einsum("nc,nc->n", of_candidates, features) + noise
        gains = ((goals @ of_candidates.T) ** 2).sum(axis=0) / variances
        best = int(np.argmax(gains))
        covariance = covariance - np.outer(of_candidates[best], of_candidates[best]) / variances[best]
        chosen.append(Cast(*candidates[best]))
    return chosen


def _candidates(model: AdaptiveModel) -> Array:
    """Return casts that land with a slack string within the arm's limits."""
    casts = filling_casts(model.scenario, N_CANDIDATES)
    expected = model.predict(casts)
    peaks = expected[:, [PEAK_TORQUE_UTILIZATION, PEAK_VELOCITY_UTILIZATION]]
    return np.asarray(casts[(expected[:, SLACK] > 0) & (peaks < MOST_UTILIZATION).all(axis=1)])
