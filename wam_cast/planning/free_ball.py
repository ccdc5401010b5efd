"""Free ball: which casts for a cup let the ball rest in it, and the words about those that leave it hanging."""

from __future__ import annotations

import numpy as np

from wam_cast.planning.prediction import ALONG, Predictor
from wam_cast.scenario import Scenario

N_NEAREST = 10
"""Training casts, those that landed nearest to a cup, that tell why it is out of reach."""


def free_distances(scenario: Scenario, radius: float) -> tuple[float, float]:
    """Return the least and the greatest distance [m] of the casts that leave the ball free in a cup at `radius` [m].

    Where the scenario's bounds hold none they are the bounds: there is a cast that lands, if none that lets the ball rest.
    """
    bounds = scenario.bounds.distance
    least, greatest = scenario.tether.distances(radius)
    least, greatest = max(least, bounds[0]), min(greatest, bounds[1])
    return (least, greatest) if least <= greatest else bounds


def describe_hanging(scenario: Scenario, distance: float, radius: float) -> str:
    """Return in words that a cast of that distance [m] leaves the ball hanging in a cup at `radius` [m]; "" if it does not."""
    tether = scenario.tether
    if tether.leaves_free(distance, radius):
        return ""
    apart, is_beyond = abs(tether.start_radius + distance - radius), tether.start_radius + distance > radius
    return (
        f"the ball would hang in a taut string: the hand ends {apart:.3f} m from the cup's axis, where the string reaches the "
        f"bottom from {max(tether.span, 0.0):.3f} m; {_remedy('farther' if is_beyond else 'nearer')}"
    )


def describe_unreached(model: Predictor, radius: float) -> str:
    """Return in words that no cup at `radius` [m] is in reach because the ball would hang in it; "" if that is not why."""
    landing, tether = model.training_outputs[:, ALONG], model.scenario.tether
    if not np.min(landing) <= radius <= np.max(landing):
        return ""
    nearest = np.argsort(np.abs(landing - radius), kind="stable")[:N_NEAREST]
    distances = model.training_casts[nearest, 0]
    if 2 * np.count_nonzero(tether.leaves_free(distances, radius)) >= len(nearest):
        return ""
    is_beyond = tether.start_radius + np.median(distances) > radius
    return f"casts that land there leave the ball hanging in a taut string; {_remedy('farther' if is_beyond else 'nearer')}"


def _remedy(cup: str) -> str:
    return f"a longer string (string.length), a deeper drop (motion.drop_distance) or a {cup} cup mends it"
