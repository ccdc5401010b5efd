"""The paper's planner: gradient descent on the predicted distance from the cup (Section 2.5 of the paper)."""

from __future__ import annotations

import numpy as np

from wam_cast.cast import cast_bounds, nearest_allowed
from wam_cast.planning.free_ball import free_distances
from wam_cast.planning.prediction import ALONG, Predictor
from wam_cast.planning.solution import LONGEST_MISS, Solution
from wam_cast.types import Array

MAX_STEPS = 200
STEP_FACTOR = 1.0
"""Step per distance [1/m], in parameters scaled to the unit cube: `alpha = STEP_FACTOR * |m(x) - y_cup|`."""

DIFFERENCE_STEP = 1e-3
"""Half the width of the central differences, in scaled parameters."""


def plan_by_gradient_descent(
    model: Predictor, radius: float, *, tolerance: float = LONGEST_MISS, max_steps: int = MAX_STEPS
) -> Solution:
    """Return parameters whose predicted landing is within `tolerance` [m] of `radius` [m], or the last ones tried.

    ``x_{i+1} = x_i - alpha grad |m(x_i) - y_cup|``, with alpha in proportion to ``|m(x_i) - y_cup|`` and the gradient by finite
    differences. It starts in the middle of the bounds and stays within them, where the string lets the ball rest in the cup. It
    terminates where the paper's does, so that it hits the cup's middle no better than it must, and a local minimum holds it.
    """
    scenario = model.scenario
    lower, upper = cast_bounds(scenario)
    span = upper - lower
    free = free_distances(scenario, radius)

    def within(parameters: Array) -> Array:
        return nearest_allowed(scenario, np.array([np.clip(parameters[0], *free), *parameters[1:]]))

    def distance_from_cup(scaled: Array) -> Array:
        return np.abs(model.predict(lower + span * scaled)[:, ALONG] - radius)

    parameters = within((lower + upper) / 2)
    offsets = DIFFERENCE_STEP * np.vstack([np.zeros(3), np.eye(3), -np.eye(3)])
    path = [parameters]
    while True:
        scaled = (parameters - lower) / span
        distance, *around = distance_from_cup(scaled + offsets)
        step = len(path) - 1
        if distance <= tolerance or step == max_steps:
            where = "within" if distance <= tolerance else "not within"
            reason = f"{where} {1e3 * tolerance:g} mm after {step} steps"
            return Solution(parameters, 7 * len(path), reason, (np.array(path),))
        gradient = (np.array(around[:3]) - np.array(around[3:])) / (2 * DIFFERENCE_STEP)
        scaled = scaled - STEP_FACTOR * distance * gradient
        parameters = within(lower + span * scaled)
        path.append(parameters)
