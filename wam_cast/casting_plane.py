"""The casting plane: the vertical plane of a cast, which holds the base axis, and polar coordinates about that axis."""

from __future__ import annotations

import math

import numpy as np

from wam_cast.types import Array, Position


def to_casting_plane(landing: Array, bearing: float) -> tuple[float, float]:
    """Return a world (x, y) [m] as the distances along the casting plane of `bearing` [rad] and across it, to the left."""
    c, s = math.cos(bearing), math.sin(bearing)
    return float(c * landing[0] + s * landing[1]), float(-s * landing[0] + c * landing[1])


def from_casting_plane(along: float, across: float, bearing: float) -> Array:
    """Return the world (x, y) [m], shape (2,), of a point along the casting plane of `bearing` [rad] and across it [m]."""
    c, s = math.cos(bearing), math.sin(bearing)
    return np.array([c * along - s * across, s * along + c * across])


def to_polar(position: Position) -> tuple[float, float]:
    """Return the distance of world (x, y) from the base axis [m] and its bearing [rad], which on the axis is 0."""
    distance = math.hypot(*position)
    return distance, math.atan2(position[1], position[0]) if distance else 0.0


def from_polar(distance: float, bearing: float) -> Position:
    """Return the world (x, y) [m] at a distance from the base axis [m] and a bearing [rad]."""
    return distance * math.cos(bearing), distance * math.sin(bearing)
