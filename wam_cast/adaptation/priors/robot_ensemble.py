"""What became of the same casts on many robots that were drawn at random, beside what the believed robot makes of them."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from wam_cast.adaptation.priors.filling import filling_casts
from wam_cast.adaptation.robot_distribution import TILT, RobotDistribution
from wam_cast.batch.arguments import Precision
from wam_cast.batch.derivatives import batch_derivatives
from wam_cast.batch.engine import simulate_batch
from wam_cast.errors import InputError
from wam_cast.planning.prediction import OUTPUTS
from wam_cast.scenario import Scenario
from wam_cast.types import Array

FIRST_SEED = 1_000_000
"""Of the robots of an ensemble, which are others than those that are drawn to be learned about."""

ROBOTS_AT_ONCE = 8
"""That are simulated in one batch: between two batches a caller hears how far it is."""


@dataclass(frozen=True, eq=False)
class RobotEnsemble:
    """Casts, and what became of them on robots that differ.

    Attributes
    ----------
    casts
        `[distance, speed, wait]`, shape (m, 3), which land on every robot.
    offsets
        By robot how far each of the `.OUTPUTS` is from the believed robot's, shape (n, m, 7); without the base's tilt.
    by_tilt
        Derivative of landing and entry by the base's tilt about the world's x and y axes at bearing 0 [1/rad], shape (2, m, 7);
        0 of the other outputs.
    tilt_std
        Standard deviation of each of the two over robots [rad].
    """

    casts: Array
    offsets: Array
    by_tilt: Array
    tilt_std: float


def simulate_ensemble(
    robots: RobotDistribution, n_robots: int, n_casts: int, precision: Precision = "float32"
) -> RobotEnsemble:
    """Simulate the same casts, without noise, on many robots, by the batched engine.

    The casts fill the bounds evenly, by Sobol's sequence. Those that do not land on every robot are left out. Single precision is
    enough: it moves a landing by a thousandth of a millimetre.

    Raises
    ------
    InputError
        If fewer than half of the casts land everywhere, or the batched engine is missing.
    """
    believed = robots.believed.without_noise
    upright = robots.without(TILT)
    casts = filling_casts(believed, n_casts)
    truths = [upright.draw(FIRST_SEED + number).without_noise for number in range(n_robots)]
    expected = _outputs([believed], casts, believed, precision)
    groups = (truths[first : first + ROBOTS_AT_ONCE] for first in range(0, n_robots, ROBOTS_AT_ONCE))
    outputs = np.concatenate([_outputs(group, casts, believed, precision) for group in groups])
    lands = np.isfinite(np.concatenate([expected, outputs])).all(axis=(0, 2))
    if lands.mean() < 0.5:
        raise InputError(f"robots: {lands.sum()} of {len(casts)} casts land on all of them; choose narrower ranges")
    slopes = batch_derivatives(believed, casts[lands], [f"{TILT}[1]", f"{TILT}[2]"], belief=believed)
    by_tilt = np.array([slope.reindex(columns=list(OUTPUTS), fill_value=0.0).to_numpy() for slope in slopes.values()])
    size = next((one.size for one in robots.ranges if one.name == TILT), 0.0)
    return RobotEnsemble(
        casts[lands], outputs[:, lands] - expected[:, lands], by_tilt, robots.scale * size / np.sqrt(3)
    )


def _outputs(scenarios: list[Scenario], casts: Array, belief: Scenario, precision: Precision) -> Array:
    """Return what becomes of the casts with each scenario, shape (n_scenarios, m, 7); nan if they do not land."""
    one_a_cast = [scenario for scenario in scenarios for _ in casts]
    frame = simulate_batch(one_a_cast, np.tile(casts, (len(scenarios), 1)), precision=precision, belief=belief)
    return frame[list(OUTPUTS)].to_numpy(dtype=float).reshape(len(scenarios), len(casts), len(OUTPUTS))
