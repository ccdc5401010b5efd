"""Whether a ball that fell into a cup can lie there, or hangs in a string that is too short for it."""

from __future__ import annotations

import math

from wam_cast.scenario import Scenario

USABLE_LENGTH = 0.995
"""Share of the string's length within which it holds nothing."""


def needed_length(scenario: Scenario, hand_radius: float, cup_radius: float) -> float:
    """Return how long a string [m] lets the ball lie wherever it rolls on the bottom of a cup.

    The hand is at its lowest, `hand_radius` from the base axis, and the cup's axis `cup_radius` [m], both in the casting plane.
    """
    cup, motion = scenario.cup, scenario.motion
    across = abs(hand_radius - cup_radius) + cup.inner_radius - scenario.ball.radius
    down = motion.start_height - motion.drop_distance - cup.floor_height - scenario.ball.radius
    return math.hypot(across, down) / USABLE_LENGTH


def can_rest(scenario: Scenario, hand_radius: float, cup_radius: float) -> bool:
    """Return whether the string is long enough for that."""
    return needed_length(scenario, hand_radius, cup_radius) <= scenario.string.length
