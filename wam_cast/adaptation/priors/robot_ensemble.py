"""What became of the same casts on many robots that were drawn at random, beside what the believed robot makes of them."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from wam_cast.adaptation.priors.filling import filling_casts
from wam_cast.adaptation.robot_distribution import TILT, RobotDistribution
from wam_cast.batch.arguments import Precision
from wam_cast.batch.engine import simulate_batch
from wam_cast.errors import InputError
from wam_cast.planning.prediction import OUTPUTS
from wam_cast.scenario import Scenario
from wam_cast.types import Array

FIRST_SEED = 1_000_000
"""Of the robots of an ensemble, which are others than those that are drawn to be learned about."""

TILT_STEP = 1e-3
"""Of the base to either side [rad], over which its effect is taken; landings move by a millimetre or two."""

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
        Derivative of each of the `.OUTPUTS` by the base's tilt about the world's x and y axes at bearing 0 [1/rad], shape
        (2, m, 7).
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
    tilted = [_tilted(believed, axis, by) for axis in (0, 1) for by in (TILT_STEP, -TILT_STEP)]
    each = [believed, *tilted, *truths]
    groups = (each[first : first + ROBOTS_AT_ONCE] for first in range(0, len(each), ROBOTS_AT_ONCE))
    outputs = np.concatenate([_outputs(group, casts, believed, precision) for group in groups])
    lands = np.isfinite(outputs).all(axis=(0, 2))
    if lands.mean() < 0.5:
        raise InputError(f"robots: {lands.sum()} of {len(casts)} casts land on all of them; choose narrower ranges")
    expected, of_tilted, of_truths = np.split(outputs[:, lands], [1, 5])
    size = next((one.size for one in robots.ranges if one.name == TILT), 0.0)
    return RobotEnsemble(
        casts[lands],
        of_truths - expected,
        (of_tilted[::2] - of_tilted[1::2]) / (2 * TILT_STEP),
        robots.scale * size / np.sqrt(3),
    )


def _tilted(scenario: Scenario, axis: int, by: float) -> Scenario:
    tilt = list(scenario.arm.base_tilt)
    tilt[axis] += by
    return scenario.model_copy(update={"arm": scenario.arm.model_copy(update={"base_tilt": tuple(tilt)})})


def _outputs(scenarios: list[Scenario], casts: Array, belief: Scenario, precision: Precision) -> Array:
    """Return what becomes of the casts with each scenario, shape (n_scenarios, m, 7); nan if they do not land."""
    one_a_cast = [scenario for scenario in scenarios for _ in casts]
    frame = simulate_batch(one_a_cast, np.tile(casts, (len(scenarios), 1)), precision=precision, belief=belief)
    return frame[list(OUTPUTS)].to_numpy(dtype=float).reshape(len(scenarios), len(casts), len(OUTPUTS))
