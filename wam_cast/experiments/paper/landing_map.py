"""The landing that a model predicts over distance and speed, at several waits."""

from __future__ import annotations

import numpy as np

from wam_cast.cast import cast_bounds, is_allowed
from wam_cast.experiments.frames import Result, Values
from wam_cast.experiments.paper.settings import OnProgress
from wam_cast.planning.prediction import Predictor

N_GRID = 41
N_WAITS = 4


class LandingMap(Result):
    """Predicted landing [m] by wait, speed and distance (in this order), and which casts are allowed by speed and distance."""

    distance: Values
    speed: Values
    waits: Values
    landing: Values
    is_allowed: tuple[tuple[bool, ...], ...]


def map_landings(model: Predictor, report: OnProgress) -> LandingMap:
    """Return the map over the bounds of the model's scenario."""
    report(0, 1)
    lower, upper = cast_bounds(model.scenario)
    distance, speed = (np.linspace(lower[i], upper[i], N_GRID) for i in range(2))
    waits = np.linspace(lower[2], upper[2], N_WAITS)
    grid = np.stack(np.meshgrid(waits, speed, distance, indexing="ij"), axis=-1)[..., ::-1]
    landing = model.predict(grid.reshape(-1, 3))[:, 0].reshape(grid.shape[:-1])
    allowed = is_allowed(model.scenario, grid[0])
    report(1, 1)
    return LandingMap(distance=distance, speed=speed, waits=waits, landing=landing, is_allowed=allowed.tolist())
