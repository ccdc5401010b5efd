"""Tether: whether the string leaves the ball free to rest in a cup once the hand is down. Geometry in the casting plane.

After the drop the hand stays at a radius and a height. The ball rests anywhere on the cup's bottom if the string, which touches
nothing here, spans the way from the hand to the farthest such place and is still slack. For a cup at a radius that is an interval
of the cast's distance.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

LOOSE_MARGIN = 0.01
"""Share of its length by which a string is to be slack where the ball rests: twice what counts as slack. It covers by how much
the hand stays off its reference under joint friction, and the ball off the casting plane."""

ROUNDING = 1e-6
"""By how much a distance [m] may be outside its interval: to within this a solver keeps its bounds."""


def lifting_share(string_mass: float, ball_mass: float) -> float:
    """Return by which share of its length a string may still be slack where its own weight lifts the ball.

    A string of weight w that is almost straight, at an angle a from the horizontal, with tension T, is slack by the share
    (w cos a / T)^2 / 24. It lifts a ball of weight m where T sin a = m + w / 2, most slack at 45 degrees. Masses in one unit.
    """
    return (string_mass / (2 * ball_mass + string_mass)) ** 2 / 24


@dataclass(frozen=True)
class Tether:
    """String, hand and cup at the end of a cast.

    Attributes
    ----------
    start_radius
        Of the hand before the cast [m].
    height
        Of the lowered hand above the centre of a ball that rests in the cup [m].
    play
        How far from the cup's axis that centre may be [m].
    length
        Of the string [m].
    margin
        Share of the length by which it is to be slack.
    """

    start_radius: float
    height: float
    play: float
    length: float
    margin: float

    @property
    def span(self) -> float:
        """How far the hand may be from the cup's axis, horizontally [m]; negative if it may be nowhere."""
        squared = ((1 - self.margin) * self.length) ** 2 - self.height**2
        return (math.sqrt(squared) if squared >= 0 else -math.inf) - self.play

    @property
    def least_length(self) -> float:
        """Of a string with which the ball is free in a cup right below the hand [m]."""
        return math.hypot(self.height, self.play) / (1 - self.margin)

    @property
    def greatest_height(self) -> float:
        """Of the hand, as `height`, for the same with the string as it is [m]; negative if there is none."""
        squared = ((1 - self.margin) * self.length) ** 2 - self.play**2
        return math.sqrt(squared) if squared >= 0 else -math.inf

    def distances(self, radius: float) -> tuple[float, float]:
        """Return the least and the greatest distance of a cast [m] that leaves the ball free in a cup at `radius` [m].

        The first is the greater one if there is none.
        """
        above = radius - self.start_radius
        return above - self.span, above + self.span

    def leaves_free(self, distance: ArrayLike, radius: ArrayLike) -> NDArray[np.bool_]:
        """Return whether casts of that distance [m] leave the ball free to rest anywhere in a cup at `radius` [m]."""
        apart = np.abs(self.start_radius + np.asarray(distance) - np.asarray(radius))
        return np.asarray(apart <= self.span + ROUNDING)
