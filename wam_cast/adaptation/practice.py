"""Which casts to practise: those that tell most about where the casts will land that are wanted."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from wam_cast.adaptation.adaptive_model import AdaptiveModel
from wam_cast.adaptation.priors.filling import filling_casts
from wam_cast.adaptation.robot import LANDING_STD
from wam_cast.cast import Cast
from wam_cast.casting_plane import from_polar, to_polar
from wam_cast.errors import checked_integer
from wam_cast.planning.plan import plan_cast
from wam_cast.planning.prediction import PEAK_TORQUE_UTILIZATION, PEAK_VELOCITY_UTILIZATION, SLACK
from wam_cast.planning.reach import Reach
from wam_cast.types import Array, Position

N_CANDIDATES = 256
"""Casts, evenly over the bounds, of which the best is chosen."""

N_RADII = 7
"""Cups over the reach that stand for the floor, at each of three bearings."""

BEARING_SHARES = (-0.7, 0.0, 0.7)
"""Their bearings, as shares of how far joint 1 turns."""

MOST_UTILIZATION = 0.98
"""Of a cast that is worth practising, as of a plan."""


def choose_practice(model: AdaptiveModel, n_casts: int, cups: Sequence[Position] | None = None) -> list[Cast]:
    """Return the casts to practise next, the best one first.

    ::

        x* = argmax_x sum_t cov(t, x)^2 / (var(x) + noise(x))

    over candidates x, where t are the casts that the model plans now for the cups, and cov and var are those of the landing along
    the plane under the model's posterior: the landing of x lowers their summed variance by just that (the A-optimal design of
    Bayesian linear regression, one cast at a time). Where a cast will land does not matter to it, so that several may be chosen at
    once. A cast that scatters is worth less, and none is chosen again before all are: what the components leave would be the same again.

    Parameters
    ----------
    model
        What is known.
    n_casts
        How many, 1 at least.
    cups
        World (x, y) [m] of the cups that are wanted, in whose directions is practised; by default some all over the floor.

    Raises
    ------
    InputError
        If the number is none, or a cup is out of reach.
    """
    checked_integer("n_casts", n_casts, 1)
    wanted = _floor(Reach.of(model)) if cups is None else cups
    bearings = sorted({to_polar(cup)[1] for cup in wanted})
    goals = np.concatenate([_components(model, plan_cast(model, cup).cast) for cup in wanted])
    casts = _candidates(model)
    features = np.concatenate([model.toward(bearing).landing_components(casts) for bearing in bearings])
    noise = LANDING_STD**2 + np.tile([model.noise_variance(cast, is_measured=True)[0] for cast in casts], len(bearings))
    covariance, chosen, free = model.posterior.covariance, [], np.ones(len(casts), dtype=bool)
    for _ in range(n_casts):
        of_candidates = features @ covariance
        variances = np.einsum("nc,nc->n", of_candidates, features) + noise
        gains = ((goals @ of_candidates.T) ** 2).sum(axis=0) / variances * np.tile(free, len(bearings))
        best = int(np.argmax(gains))
        free[best % len(casts)] = False
        if not free.any():
            free[:] = True
        covariance = covariance - np.outer(of_candidates[best], of_candidates[best]) / variances[best]
        bearing, cast = divmod(best, len(casts))
        chosen.append(Cast.from_array(casts[cast], bearings[bearing]))
    return chosen


def _floor(reach: Reach) -> list[Position]:
    """Return cups all over the floor."""
    radii = np.linspace(reach.nearest, reach.farthest, N_RADII + 2)[1:-1]
    bearings = [share * (reach.highest if share > 0 else -reach.lowest) for share in BEARING_SHARES]
    return [from_polar(float(radius), bearing) for bearing in bearings for radius in radii]


def _components(model: AdaptiveModel, cast: Cast) -> Array:
    return model.toward(cast.bearing).landing_components(cast.to_array()[np.newaxis, :3])


def _candidates(model: AdaptiveModel) -> Array:
    """Return casts that land with a slack string within the arm's limits."""
    casts = filling_casts(model.scenario, N_CANDIDATES)
    expected = model.predict(casts)
    peaks = expected[:, [PEAK_TORQUE_UTILIZATION, PEAK_VELOCITY_UTILIZATION]]
    return np.asarray(casts[(expected[:, SLACK] > 0) & (peaks < MOST_UTILIZATION).all(axis=1)])
