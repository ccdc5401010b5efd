"""Landings of many robots that were drawn at random: how far the same casts land from where the believed robot's do."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.stats import qmc

from wam_cast.adaptation.robot_distribution import RobotDistribution
from wam_cast.batch.derivatives import batch_derivatives
from wam_cast.batch.engine import simulate_batch
from wam_cast.cast import cast_bounds, is_allowed
from wam_cast.errors import InputError
from wam_cast.scenario import Scenario
from wam_cast.types import Array

TILT = "arm.base_tilt"
"""What turns with the world and not with the casting plane: its effect is taken apart, for a bearing at a time."""

LANDING = ["landing_along", "landing_across"]


@dataclass(frozen=True, eq=False)
class LandingEnsemble:
    """Casts, and what became of them on robots that differ.

    Attributes
    ----------
    casts
        `[distance, speed, wait]`, shape (m, 3), which land on every robot.
    offsets
        By robot how far each lands from the believed robot's landing, along and across the casting plane [m], shape (n, m, 2);
        without the base's tilt.
    by_tilt
        Derivative of the landing by the base's tilt about the world's x and y axes at bearing 0 [m/rad], shape (2, m, 2).
    tilt_std
        Standard deviation of each of the two over robots [rad].
    """

    casts: Array
    offsets: Array
    by_tilt: Array
    tilt_std: float


def simulate_ensemble(robots: RobotDistribution, n_robots: int, n_casts: int, seed: int = 0) -> LandingEnsemble:
    """Simulate the same casts, without noise, on robots of a seed, by the batched engine.

    The casts fill the bounds evenly, by Sobol's sequence. Those that do not land on every robot are left out.

    Raises
    ------
    InputError
        If fewer than half of the casts land everywhere, or the batched engine is missing.
    """
    believed = robots.believed.without_noise
    upright = RobotDistribution(
        believed, tuple(one for one in robots.ranges if one.name != TILT), robots.scale, robots.shifts
    )
    casts = _filling(believed, n_casts, seed)
    truths = [upright.draw(seed + number) for number in range(n_robots)]
    landings = _landings([believed, *truths], casts, believed)
    lands = np.isfinite(landings).all(axis=(0, 2))
    if lands.mean() < 0.5:
        raise InputError(f"robots: {lands.sum()} of {len(casts)} casts land on all of them; choose narrower ranges")
    slopes = batch_derivatives(believed, casts[lands], [f"{TILT}[1]", f"{TILT}[2]"], belief=believed)
    by_tilt = np.array([slope[LANDING].to_numpy() for slope in slopes.values()])
    size = next((one.size for one in robots.ranges if one.name == TILT), 0.0)
    return LandingEnsemble(
        casts[lands], landings[1:, lands] - landings[0, lands], by_tilt, robots.scale * size / np.sqrt(3)
    )


def _filling(believed: Scenario, n_casts: int, seed: int) -> Array:
    """Return casts that fill the bounds evenly, (n_casts, 3)."""
    lower, upper = cast_bounds(believed)
    drawn = qmc.Sobol(3, seed=seed).random_base2((4 * n_casts - 1).bit_length())  # of a power of two they are even
    casts = qmc.scale(drawn, lower, upper)
    return np.asarray(casts[is_allowed(believed, casts)][:n_casts])


def _landings(scenarios: list[Scenario], casts: Array, belief: Scenario) -> Array:
    """Return where the casts land with each scenario, along and across [m], shape (n_scenarios, m, 2); nan if they do not."""
    one_a_cast = [scenario for scenario in scenarios for _ in casts]
    frame = simulate_batch(one_a_cast, np.tile(casts, (len(scenarios), 1)), belief=belief)
    return frame[LANDING].to_numpy(dtype=float).reshape(len(scenarios), len(casts), 2)
