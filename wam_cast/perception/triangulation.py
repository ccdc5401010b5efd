"""Where the ball is at first sight: least squares over what the cameras see, the string's length, and the plane of the cast.

Two cameras say where it is; the rest then matters little. One camera alone knows the direction, and string and plane the distance.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from wam_cast.perception.pinhole import Camera
from wam_cast.types import Array

CENTRE_STD = 0.05
"""Standard deviation of a detected centre without noise of pixels [pixels]: its edge is drawn in whole ones, and what is around it
differs from side to side."""

LENGTH_STD = 0.02
"""Of the string's length [m], as far as it is known; what is known wrong of the hand's place is in it."""

STRING_STD = 0.003
"""Of the distance between hand and ball from that length while the string is taut [m]: it is bent a little."""

ACROSS_STD = 0.005
"""Of the ball's distance from the casting plane, that through the base axis and the hand [m]: a cast swings in it."""

SEARCH_STD = 1.0
"""Of where the ball is before anything is seen [m], so that there is an answer at all."""


def visible_part(detections: Array) -> NDArray[np.bool_]:
    """Return which cameras see the ball, shape (n,), of their detections, shape (n, 4)."""
    return np.asarray(np.isfinite(detections).all(axis=1))


def pixel_std(detections: Array) -> Array:
    """Return the standard deviation of detected centres, in each direction [pixels], shape (n,), of detections, shape (n, 4)."""
    return np.asarray(np.hypot(CENTRE_STD, detections[:, 2]))


def across_plane(p_WE: Array) -> Array:
    """Return the unit vector across the casting plane, (3,), for a hand at p_WE [m], (3,)."""
    return np.asarray(np.array([-p_WE[1], p_WE[0], 0.0]) / np.hypot(p_WE[0], p_WE[1]))


def triangulate(cameras: Sequence[Camera], detections: Array, p_WE: Array, length: float) -> tuple[Array, Array]:
    """Return where the ball on a taut string is, and the string's length: the likeliest (4,) [m], and its covariance (4, 4) [m^2].

    Parameters
    ----------
    cameras
        As they are believed to stand, n of them.
    detections
        Of each: column, row, standard deviation, radius, shape (n, 4) [pixels]; nan where it sees none.
    p_WE
        The hand [m], (3,).
    length
        Of the string, to within `LENGTH_STD` [m].
    """
    from scipy.optimize import least_squares  # takes a quarter of a second, which robots without cameras do without

    seen = visible_part(detections)
    std = pixel_std(detections)
    across = across_plane(p_WE)
    below = p_WE - [0.0, 0.0, length]

    def residuals(unknown: Array) -> Array:
        p_WL = unknown[:3]
        parts = [
            (camera.project(p_WL[np.newaxis])[0] - detection[:2]) / own
            for camera, detection, own, is_seen in zip(cameras, detections, std, seen, strict=True)
            if is_seen
        ]
        straight = (np.linalg.norm(p_WL - p_WE) - unknown[3]) / STRING_STD
        known = [straight, (unknown[3] - length) / LENGTH_STD, across @ p_WL / ACROSS_STD]
        return np.concatenate([*parts, known, (p_WL - below) / SEARCH_STD])

    found = least_squares(residuals, np.append(below, length), method="lm")
    return found.x, np.linalg.inv(found.jac.T @ found.jac)
