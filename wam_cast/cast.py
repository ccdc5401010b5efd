"""Cast: the decision vector of one cast, its bounds, to and from an array."""

from __future__ import annotations

import math
from collections.abc import Mapping, Set
from dataclasses import astuple, dataclass

import numpy as np
from numpy.typing import NDArray

from wam_cast.errors import InputError, is_finite, quoted
from wam_cast.scenario import Scenario
from wam_cast.types import Array, Position

PARAMETERS = ("distance", "speed", "wait")
"""The parameters that the forward model learns, in the order of every array of casts."""

FARTHEST_CUP = 100.0
"""Along either axis of the world [m]; no arm reaches a tenth of it."""

LONGEST_CAST = 300.0
"""Of move and wait [s]."""

LARGEST = {"distance": 100.0, "speed": 1000.0, "bearing": 2 * math.pi}
"""Of a cast, either way [m, m/s, rad]; no arm reaches a tenth of the first two, and no joint turns farther."""

LANDS_BEYOND = 0.18
"""How far beyond the hand the ball of the default cast comes down, as a share of the string's length."""


@dataclass(frozen=True)
class Cast:
    """One cast (Section 2.2 of the paper).

    Attributes
    ----------
    distance
        Of the hand's horizontal move [m].
    speed
        Mean speed of that move [m/s]: it lasts `distance / speed`, and its peak is 15/8 of `speed`.
    wait
        Between the end of the move and the start of the drop [s].
    bearing
        Of the casting plane about the base axis, from the world's x axis toward y [rad].

    Raises
    ------
    InputError
        If a value is not finite, distance or speed not positive, wait negative, one beyond `.LARGEST`, or the cast takes minutes.
    """

    distance: float
    speed: float
    wait: float
    bearing: float = 0.0

    def __post_init__(self) -> None:
        for name, value in zip((*PARAMETERS, "bearing"), astuple(self), strict=True):
            if not is_finite(value):
                raise InputError(f"cast: {name} = {quoted(value)} is not a finite number")
        if self.distance <= 0 or self.speed <= 0 or self.wait < 0:
            raise InputError(
                f"cast: distance = {self.distance:g} m and speed = {self.speed:g} m/s must be positive, "
                f"wait = {self.wait:g} s not negative"
            )
        for name, largest in LARGEST.items():
            if abs(value := getattr(self, name)) > largest:
                raise InputError(f"cast: {name} = {value:g} is more than any arm can do; choose at most {largest:.4g}")
        if self.move_duration + self.wait > LONGEST_CAST:
            raise InputError(
                f"cast: move and wait of {self.move_duration:g} and {self.wait:g} s are longer than {LONGEST_CAST:g} s; choose a "
                "higher speed or a shorter wait"
            )

    def __str__(self) -> str:
        bearing = round(math.degrees(self.bearing), 1) + 0.0  # adding 0 turns a rounded -0 into 0
        return f"distance {self.distance:.3f} m, speed {self.speed:.3f} m/s, wait {self.wait:.3f} s, bearing {bearing:.1f}°"

    @property
    def move_duration(self) -> float:
        """Duration of the horizontal move [s]."""
        return self.distance / self.speed

    def to_array(self) -> Array:
        """Return `[distance, speed, wait]`, shape (3,)."""
        return np.array([self.distance, self.speed, self.wait])

    @classmethod
    def from_array(cls, parameters: Array, bearing: float = 0.0) -> Cast:
        """Return the cast with parameters `[distance, speed, wait]`, shape (3,). Raises `.InputError`."""
        try:
            distance, speed, wait = (float(value) for value in parameters)
        except (TypeError, ValueError):
            raise InputError(f"parameters = {quoted(parameters)} must be [distance, speed, wait] [m, m/s, s]") from None
        return cls(distance, speed, wait, bearing)


def cast_bounds(scenario: Scenario) -> tuple[Array, Array]:
    """Return the lower and the upper bounds of `[distance, speed, wait]`, each of shape (3,)."""
    bounds = np.array([getattr(scenario.bounds, name) for name in PARAMETERS], dtype=float)
    return bounds[:, 0], bounds[:, 1]


def is_allowed(scenario: Scenario, parameters: Array) -> NDArray[np.bool_]:
    """Return which rows of `parameters`, shape (..., 3), keep the bounds and the move's shortest duration."""
    lower, upper = cast_bounds(scenario)
    inside = np.all((parameters >= lower) & (parameters <= upper), axis=-1)
    # The tolerance keeps a cast on the boundary allowed after a round trip through scaled coordinates.
    slow_enough = parameters[..., 0] >= parameters[..., 1] * scenario.motion.min_move_duration - 1e-12
    return np.asarray(inside & slow_enough)


def nearest_allowed(scenario: Scenario, parameters: Array) -> Array:
    """Return `parameters`, shape (3,), moved within the bounds, and slowed down where the move would be too short."""
    lower, upper = cast_bounds(scenario)
    distance, speed, wait = np.clip(parameters, lower, upper)
    shortest = scenario.motion.min_move_duration
    speed = max(min(speed, distance / shortest), lower[1])
    # Rounding may take the product beyond the bound.
    return np.array([min(max(distance, speed * shortest), upper[0]), speed, wait])


def cast_at(scenario: Scenario, point: Array) -> Array:
    """Return the allowed cast at a point of the unit cube, both of shape (3,).

    The cube is mapped onto all allowed casts: linearly but for the speed, whose range ends where the move, at this distance, would
    be too short.
    """
    lower, upper = _allowed_bounds(scenario)
    upper[1] = min(upper[1], (lower[0] + (upper[0] - lower[0]) * point[0]) / scenario.motion.min_move_duration)
    # The sum may miss a bound by rounding.
    return nearest_allowed(scenario, lower + (upper - lower) * point)


def point_of(scenario: Scenario, parameters: Array) -> Array:
    """Return the point of the unit cube at which `cast_at` has an allowed cast, both of shape (3,)."""
    lower, upper = _allowed_bounds(scenario)
    upper[1] = min(upper[1], parameters[0] / scenario.motion.min_move_duration)
    width = upper - lower
    # At the shortest distance a single speed may be allowed.
    share = np.divide(parameters - lower, width, out=np.full(3, 0.5), where=width > 0)
    return np.asarray(np.clip(share, 0.0, 1.0))


def _allowed_bounds(scenario: Scenario) -> tuple[Array, Array]:
    """Return the bounds, (3,) each, without distances that at the lowest speed take too little time."""
    lower, upper = cast_bounds(scenario)
    lower[0] = max(lower[0], lower[1] * scenario.motion.min_move_duration)
    return lower, upper


def default_cast(scenario: Scenario) -> Cast:
    """Return the cast of those who ask for none: 0.3 m at 0.6 m/s and 0.1 s of wait, or the nearest that is allowed."""
    return Cast.from_array(nearest_allowed(scenario, np.array([0.3, 0.6, 0.1])))


def default_cup(scenario: Scenario) -> Position:
    """Return world (x, y) [m] of a cup that nobody placed.

    There the reference scenario's `default_cast` comes down, and another one's roughly: beyond the hand by a share of the string.
    """
    far = scenario.motion.start_radius + default_cast(scenario).distance
    return far + LANDS_BEYOND * scenario.string.length, 0.0


def checked_cup(cup: tuple[float, float]) -> tuple[float, float]:
    """Return world (x, y) of a cup's axis as two floats; raises `.InputError` if they are not finite numbers."""
    try:
        x, y = map(_number, () if isinstance(cup, (Mapping, Set)) else cup)
    except (TypeError, ValueError, OverflowError):
        raise InputError(f"cup = {quoted(cup)} must be the pair (x, y) of its axis in metres") from None
    if not (math.isfinite(x) and math.isfinite(y)):
        raise InputError(f"cup = ({x}, {y}) must be finite: world x and y of its axis in metres")
    if max(abs(x), abs(y)) > FARTHEST_CUP:
        raise InputError(
            f"cup = ({x:g}, {y:g}) must be within {FARTHEST_CUP:g} m of the robot: world x and y of its axis in metres"
        )
    return x, y


def _number(value: object) -> float:
    if isinstance(value, (str, bool)):
        raise TypeError
    return float(value)  # type: ignore[arg-type]
