"""Where on the floor a cup can be reached: an annular sector about the base axis."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from itertools import product

from wam_cast.arm.arm_model import arm_model
from wam_cast.casting_plane import from_polar, to_polar
from wam_cast.errors import InputError
from wam_cast.planning.prediction import Predictor
from wam_cast.types import Position

BEARING_MARGIN = 0.01
"""How far from its stops [rad] joint 1 stays: a cast moves it by a little."""

N_DIGITS = 3
"""Positions are named in millimetres."""


@dataclass(frozen=True)
class Reach:
    """The region between two distances from the base axis [m] and two bearings from the x axis toward y [rad]."""

    nearest: float
    farthest: float
    lowest: float
    highest: float

    @classmethod
    def of(cls, model: Predictor) -> Reach:
        """Return where the landings lie that `model` knows, turned as far as joint 1 turns."""
        lowest, highest = arm_model(model.scenario.arm).bearing_limits
        return cls(*model.reach, lowest + BEARING_MARGIN, highest - BEARING_MARGIN)

    def has_distance(self, distance: float) -> bool:
        """Return whether there is a cup that far from the base axis [m]."""
        return self.nearest <= distance <= self.farthest

    def has_bearing(self, bearing: float) -> bool:
        """Return whether joint 1 turns to that bearing [rad]."""
        return self.lowest <= bearing <= self.highest

    def has(self, cup: Position) -> bool:
        """Return whether world (x, y) [m] is within reach."""
        distance, bearing = to_polar(cup)
        return self.has_distance(distance) and self.has_bearing(bearing)

    def nearest_position(self, cup: Position) -> Position:
        """Return the world (x, y) within reach, in whole millimetres, that is nearest to `cup` [m].

        Where the region is too thin to hold whole millimetres, it is the nearest position of all.
        """
        x, y = exact = self._nearest_of_all(cup)
        # However a corner of the region is turned, there are whole millimetres in it within two of its tip.
        steps = [step * 10**-N_DIGITS for step in range(-2, 3)]
        around = [(round(x + i, N_DIGITS), round(y + j, N_DIGITS)) for i, j in product(steps, repeat=2)]
        return min(filter(self.has, around), key=lambda position: math.dist(position, cup), default=exact)

    def _nearest_of_all(self, cup: Position) -> Position:
        distance, bearing = to_polar(cup)
        if self.has_bearing(bearing):
            return from_polar(self._clip(distance), bearing)
        # From between the stops the way is to the nearer one of the two edges, at a right angle if it meets the edge there.
        edges = [
            from_polar(self._clip(distance * math.cos(bearing - edge)), edge) for edge in (self.lowest, self.highest)
        ]
        return min(edges, key=lambda position: math.dist(position, cup))

    def _clip(self, distance: float) -> float:
        return min(max(distance, self.nearest), self.farthest)


def checked_polar(reach: Reach, cup: Position, why: Callable[[float], str] = lambda _: "") -> tuple[float, float]:
    """Return the cup's distance from the base axis [m] and its bearing [rad].

    `why` says in words why there is no cup at a distance [m]; "" if it does not know.

    Raises
    ------
    InputError
        If the cup is out of reach: the line says what of it, what is within reach, and which position is the nearest.
    """
    distance, bearing = to_polar(cup)
    wrong = []
    if not reach.has_distance(distance):
        reason = f" ({words})" if (words := why(distance)) else ""
        wrong.append(
            f"{distance:.4g} m from the base axis, out of reach{reason}: "
            f"choose a distance from {_inside(reach.nearest, reach.farthest, N_DIGITS)} m"
        )
    if not reach.has_bearing(bearing):
        wrong.append(
            f"at a bearing of {math.degrees(bearing):.4g} degrees, where joint 1 cannot turn: choose one from "
            f"{_inside(math.degrees(reach.lowest), math.degrees(reach.highest), 1)} degrees from the x axis"
        )
    if wrong:
        x, y = reach.nearest_position(cup)
        raise InputError(
            f"cup = ({cup[0]:g}, {cup[1]:g}) is {'; and '.join(wrong)}; the nearest is {x + 0.0!r},{y + 0.0!r}"
        )
    return distance, bearing


def _inside(lowest: float, highest: float, n_digits: int) -> str:
    """Return a range in words, rounded so that its ends are inside."""
    scale = 10**n_digits
    lowest, highest = math.ceil(lowest * scale) / scale, math.floor(highest * scale) / scale
    return f"{lowest:.{n_digits}f} to {highest:.{n_digits}f}"
