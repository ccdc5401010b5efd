"""Casts that fill the bounds, their faces included."""

from __future__ import annotations

import numpy as np

from wam_cast.cast import cast_bounds, is_allowed
from wam_cast.scenario import Scenario
from wam_cast.types import Array

BEYOND = 0.08
"""By how much a sequence reaches beyond each bound, in units of the bounds. What lies beyond is moved to the bound: cups at the
ends of the reach are cast at from there."""


def filling_casts(scenario: Scenario, n_casts: int) -> Array:
    """Return casts `[distance, speed, wait]` by Sobol's sequence, shape (n_casts, 3); more of them begin with the same ones."""
    from scipy.stats import qmc  # takes a second, which a model that is only read does without

    lower, upper = cast_bounds(scenario)
    drawn = qmc.Sobol(3, seed=0).random_base2((4 * n_casts - 1).bit_length())  # of a power of two they are even
    within = np.clip((1 + 2 * BEYOND) * drawn - BEYOND, 0.0, 1.0)
    casts = lower + (upper - lower) * within
    return np.asarray(casts[is_allowed(scenario, casts)][:n_casts])
