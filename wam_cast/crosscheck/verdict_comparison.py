"""The same casts into cups that stand off their landings, in Drake and in MuJoCo: what becomes of the balls, side by side."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from wam_cast.crosscheck.mujoco_contact import ByHand, Own, cast_into_cup
from wam_cast.crosscheck.mujoco_flight import MujocoSimulator
from wam_cast.generation.sampling import row_noise_seed, sample_cast
from wam_cast.scenario import Scenario
from wam_cast.simulation.ball_and_cup import touches_rim
from wam_cast.simulation.outcome import Status
from wam_cast.simulation.simulator import CastSimulator
from wam_cast.types import Array, Position, checks_types

OFFSETS = (0.0, 0.010, 0.020, 0.025)
"""Of the cup's axis from the landing [m]."""


@dataclass(frozen=True)
class Verdicts:
    """A cast into a cup, in both engines.

    Attributes
    ----------
    cast, offset, cup
        The cast's row, how far from its landing the cup's axis is [m], and world (x, y) of it [m].
    drake, mujoco, mujoco_own
        What became of the ball: in Drake, in MuJoCo by Drake's law of contact, and by MuJoCo's own.
    touched_rim
        Whether it touched the rim in any of them.
    """

    cast: int
    offset: float
    cup: Position
    drake: Status
    mujoco: Status
    mujoco_own: Status
    touched_rim: bool

    @property
    def is_same(self) -> bool:
        """Whether all say the same."""
        return self.drake == self.mujoco == self.mujoco_own


@checks_types
def compare_verdicts(
    scenario: Scenario,
    n_casts: int,
    seed: int = 0,
    *,
    offsets: Sequence[float] = OFFSETS,
    on_progress: Callable[[int], None] | None = None,
) -> list[Verdicts]:
    """Simulate the first `n_casts` casts of a `seed`, each into a cup at each of the `offsets` [m] from where it lands.

    The directions are drawn from the seed. Casts that do not land, or meet a limit of the arm, are left out. `on_progress` is
    called with the number of finished casts. Raises `.InputError` as `.compare_engines` does.
    """
    drake, mujoco = CastSimulator(scenario), MujocoSimulator(scenario)
    found = []
    for row in range(n_casts):
        cast, noise_seed = sample_cast(scenario, seed, row), row_noise_seed(seed, row)
        free = drake.simulate(cast, noise_seed=noise_seed)
        directions = np.random.default_rng((seed, row)).uniform(-math.pi, math.pi, len(offsets))
        for offset, direction in zip(offsets, directions, strict=True):
            if free.status is not Status.LANDED:
                continue
            x, y = free.landing + offset * np.array([math.cos(direction), math.sin(direction)])
            cup = (float(x - scenario.cup.offset[0]), float(y - scenario.cup.offset[1]))
            recording = drake.record(cast, cup, noise_seed=noise_seed, returns=False)
            by_hand, own = (cast_into_cup(mujoco, cast, cup, noise_seed, law) for law in (ByHand, Own))
            paths = np.vstack([recording.p_WL, by_hand[1].p_WL, own[1].p_WL])
            touched = _touches_rim(paths, (x, y), scenario)
            found.append(Verdicts(row, offset, cup, recording.outcome.status, by_hand[0], own[0], touched))
        if on_progress is not None:
            on_progress(row + 1)
    return found


def _touches_rim(p_WL: Array, place: Position, scenario: Scenario) -> bool:
    return bool(np.any(touches_rim(p_WL - [*place, scenario.cup.rim_height], scenario.cup, scenario.ball.radius)))
