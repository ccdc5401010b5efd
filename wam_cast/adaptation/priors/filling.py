"""Casts that fill the bounds evenly."""

from __future__ import annotations

import numpy as np
from scipy.stats import qmc

from wam_cast.cast import cast_bounds, is_allowed
from wam_cast.scenario import Scenario
from wam_cast.types import Array


def filling_casts(scenario: Scenario, n_casts: int) -> Array:
    """Return casts `[distance, speed, wait]` by Sobol's sequence, shape (n_casts, 3); more of them begin with the same ones."""
    lower, upper = cast_bounds(scenario)
    drawn = qmc.Sobol(3, seed=0).random_base2((4 * n_casts - 1).bit_length())  # of a power of two they are even
    casts = qmc.scale(drawn, lower, upper)
    return np.asarray(casts[is_allowed(scenario, casts)][:n_casts])
