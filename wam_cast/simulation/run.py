"""Run: what one simulated cast carries from phase to phase, and where it starts."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

from wam_cast.cast import Cast
from wam_cast.motion.stages import CastMotion


@dataclass(frozen=True, eq=False)
class Start:
    """Where the cast before left the robot: a context of the station with contact, and the bearing [rad]."""

    context: Any
    bearing: float


@dataclass
class Run:
    """What one simulation carries from phase to phase.

    Attributes
    ----------
    cast, cup, noise_seed, motion, start
        What is simulated; `start` is none at rest at home.
    high_until
        When the flying ball was last seen above the rim plane [s].
    was_low
        Whether it was seen below.
    scene_start
        When the station with contact took over [s], if it did.
    is_at_rest, is_carried
        Whether the ball rests inside the cup, and whether the cup carries it.
    breakdown
        What Drake said of numbers that left all bounds, if they did.
    """

    cast: Cast
    cup: tuple[float, float] | None
    noise_seed: int
    motion: CastMotion
    start: Start | None
    high_until: float = 0.0
    was_low: bool = False
    scene_start: float | None = None
    is_at_rest: bool = False
    is_carried: bool = False
    breakdown: str | None = None
