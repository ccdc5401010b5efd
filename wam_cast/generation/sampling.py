"""Which casts a dataset holds: row i of seed s is always the same cast, whatever else is drawn, wherever and in which order."""

from __future__ import annotations

import numpy as np

from wam_cast.cast import Cast, cast_bounds, is_allowed
from wam_cast.scenario import Scenario
from wam_cast.types import Array


def sample_cast(scenario: Scenario, seed: int, row: int) -> Cast:
    """Return the cast of one row, drawn uniformly from all that `.is_allowed` accepts.

    Each row has a random stream of its own, and rejects in it. What is drawn from is first cut down to the casts' bounding box,
    so that no scenario rejects more than half of what it draws. Neither `seed` nor `row` may be negative.
    """
    rng = np.random.default_rng(np.random.SeedSequence(seed, spawn_key=(row,)))
    lower, upper = _allowed_box(scenario)
    while True:
        parameters = rng.uniform(lower, upper)
        if is_allowed(scenario, parameters):
            return Cast.from_array(parameters)


def row_noise_seed(seed: int, row: int) -> int:
    """Return the noise seed of one row; it has no part in the draw of the row's cast."""
    (child,) = np.random.SeedSequence(seed, spawn_key=(row,)).spawn(1)
    return int(child.generate_state(1, np.uint64)[0])


def sample_casts(scenario: Scenario, n_casts: int, seed: int) -> Array:
    """Return the first `n_casts` rows `[distance, speed, wait]` of a seed, shape (n_casts, 3) [m, m/s, s]."""
    casts = [sample_cast(scenario, seed, row).to_array() for row in range(n_casts)]
    return np.array(casts).reshape(n_casts, 3)


def _allowed_box(scenario: Scenario) -> tuple[Array, Array]:
    """Return the corners, each of shape (3,), of the smallest box that holds every allowed cast."""
    lower, upper = cast_bounds(scenario)
    shortest = scenario.motion.min_move_duration
    lower[0] = max(lower[0], lower[1] * shortest)
    upper[1] = min(upper[1], upper[0] / shortest)
    return lower, upper
