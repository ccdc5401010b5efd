"""CastTask: what the environments have in common: where cups stand, which casts there are, and what they are worth."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from gymnasium.spaces import Box
from numpy.typing import ArrayLike

from wam_cast.arm.arm_model import arm_model
from wam_cast.cast import FARTHEST_CUP, Cast, cast_at, checked_cup, point_of
from wam_cast.casting_plane import from_polar
from wam_cast.errors import InputError, is_finite, quoted
from wam_cast.scenario import Scenario
from wam_cast.types import Array, Position

BEARING_MARGIN = 0.01
"""How far from its stops [rad] joint 1 stays: a cast moves it by a little."""

RADII = (0.30, 0.95)
"""Distances of cups from the base axis [m] that the reference scenario's casts reach, with a margin."""

FARTHEST_MISS = 1.0
"""What a cast misses by that has no landing, or breaks a limit [m]; no other counts for more."""

N_NOISE_SEEDS = 2**31
"""From which an episode's noise is drawn."""


@dataclass(frozen=True)
class CastTask:
    """A cup somewhere on the floor, and one cast to hit it.

    Attributes
    ----------
    scenario
        What is cast with.
    radii
        The smallest and the largest distance of a cup from the base axis [m].

    Raises
    ------
    InputError
        If the radii are no two numbers, the first above zero and below the second.
    """

    scenario: Scenario
    radii: tuple[float, float] = RADII

    def __post_init__(self) -> None:
        radii = self.radii
        if not (isinstance(radii, (tuple, list)) and len(radii) == 2 and all(map(is_finite, radii))):
            raise InputError(f"radii = {quoted(radii)} must be two distances from the base axis [m], such as {RADII}")
        if not 0 < radii[0] < radii[1] <= FARTHEST_CUP:
            raise InputError(
                f"radii = {quoted(radii)} must rise, from above 0 to at most {FARTHEST_CUP:g} m: distances from the base axis"
            )

    @property
    def bearings(self) -> tuple[float, float]:
        """The smallest and the largest bearing of a cup, to which joint 1 turns [rad]."""
        lowest, highest = arm_model(self.scenario.arm).bearing_limits
        return lowest + BEARING_MARGIN, highest - BEARING_MARGIN

    @property
    def cup_space(self) -> Box:
        """Of the cup's world (x, y) [m]: the square about all places where one may stand."""
        return Box(-self.radii[1], self.radii[1], (2,), np.float64)

    @property
    def cast_space(self) -> Box:
        """Of actions: distance, speed, wait and bearing, each from -1 to 1."""
        return Box(-1.0, 1.0, (4,), np.float64)

    def draw_cup(self, rng: np.random.Generator) -> Position:
        """Return world (x, y) [m] of a cup: distance and bearing are evenly distributed."""
        x, y = from_polar(rng.uniform(*self.radii), rng.uniform(*self.bearings))
        return float(x), float(y)

    def cup_of(self, options: dict[str, object] | None) -> Position | None:
        """Return the cup that `reset(options={"cup": (x, y)})` asks for, or none. Raises `.InputError`."""
        if not options:
            return None
        unknown = set(options) - {"cup"}
        if unknown:
            raise InputError(f'options: {quoted(min(map(str, unknown)))} is unknown; {{"cup": (x, y)}} is allowed')
        cup = checked_cup(options["cup"])  # type: ignore[arg-type]
        if max(map(abs, cup)) > self.radii[1]:
            raise InputError(f"options: cup = {cup} is outside the observations' space; make it with larger radii")
        return cup

    def cast(self, action: ArrayLike) -> Cast:
        """Return the cast that an action, shape (4,), asks for; what is beyond -1 or 1 counts as that.

        All actions are casts that the scenario allows: `.cast_at` has the first three, between the bearings the fourth lies
        linearly. Raises `.InputError` if they are not four finite numbers.
        """
        share = (checked_action(action, self.cast_space) + 1) / 2
        lowest, highest = self.bearings
        return Cast.from_array(cast_at(self.scenario, share[:3]), lowest + (highest - lowest) * share[3])

    def action(self, cast: Cast) -> Array:
        """Return the action, shape (4,), that asks for an allowed cast."""
        lowest, highest = self.bearings
        share = np.append(point_of(self.scenario, cast.to_array()), (cast.bearing - lowest) / (highest - lowest))
        return np.asarray(2 * share - 1)


def checked_action(action: ArrayLike, space: Box) -> Array:
    """Return an action within its space. Raises `.InputError` if it has another shape, or is not finite."""
    try:
        numbers = np.asarray(action, dtype=float)
    except (TypeError, ValueError):
        numbers = np.empty(0)
    if numbers.shape != space.shape or not np.isfinite(numbers).all():
        raise InputError(f"action = {quoted(action)} must be {space.shape[0]} finite numbers from -1 to 1")
    return np.asarray(np.clip(numbers, space.low, space.high))


def reward(is_success: bool, miss: float) -> float:
    """Return what a cast is worth, from -1 to 1: 1 for a hit, less the distance of its landing from the cup's axis [m].

    `miss` counts for at most `FARTHEST_MISS`, and for that if it is nan.
    """
    return float(is_success) - (FARTHEST_MISS if math.isnan(miss) else min(miss, FARTHEST_MISS))
