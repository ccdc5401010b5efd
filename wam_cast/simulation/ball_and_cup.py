"""Where the ball is about the cup: pure geometry, without Drake."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from wam_cast.motion.polling import SLACK_MARGIN
from wam_cast.scenario import Cup, Scenario
from wam_cast.tether import lifting_share
from wam_cast.types import Array, Position

REST_RISE = 0.005
"""A ball in the cup rests once its energy could lift it no higher above the bottom than this [m]."""


def gap_to_contact(p_WL: Array, cup: Position, scenario: Scenario) -> float:
    """Return the distance [m] of a ball at `p_WL` (3,) from the floor and from solid cylinders as large as cup and stand."""
    shape, radius = scenario.cup, scenario.ball.radius
    from_axis = math.hypot(p_WL[0] - cup[0], p_WL[1] - cup[1])

    def to_cylinder(cylinder_radius: float, height: float) -> float:
        return math.hypot(max(from_axis - cylinder_radius, 0.0), max(p_WL[2] - height, 0.0))

    to_stand = to_cylinder(shape.base_radius, shape.base_height) if shape.base_height > 0 else math.inf
    return float(min(to_cylinder(shape.outer_radius, shape.rim_height), to_stand, p_WL[2]) - radius)


def height_above_support(p_WL: Array, position: Position, cup: Cup) -> float:
    """Return the height [m] of `p_WL`, shape (3,), above the stand of a cup at `position`, or above the floor beside it."""
    is_over_stand = math.hypot(p_WL[0] - position[0], p_WL[1] - position[1]) < cup.base_radius
    return float(p_WL[2] - (cup.base_height if is_over_stand and p_WL[2] > cup.base_height else 0.0))


def taut_distance(scenario: Scenario) -> float:
    """Return from which distance between hand and ball [m] on the string can hold the ball."""
    string = scenario.string
    return (1 - SLACK_MARGIN - lifting_share(string.mass, scenario.ball.mass)) * string.length


def is_inside(p_CL: Array, cup: Cup) -> NDArray[np.bool_]:
    """Return where the ball's centre `p_CL`, shape (..., 3), is inside the cup, below its rim."""
    radial = np.hypot(p_CL[..., 0], p_CL[..., 1])
    return np.asarray((p_CL[..., 2] < 0) & (radial < cup.inner_radius))


def possible_rise(p_CL: Array, speed: float, scenario: Scenario) -> float:
    """Return how far above its resting place on the cup's bottom [m] a free ball at `p_CL`, shape (3,), would rise."""
    height = p_CL[2] + scenario.cup.height - scenario.cup.bottom_thickness - scenario.ball.radius
    return float(height + speed**2 / (2 * scenario.gravity))


def touches_rim(p_CL: Array, cup: Cup, ball_radius: float, tolerance: float = 5e-4) -> NDArray[np.bool_]:
    """Return where a ball at `p_CL`, shape (..., 3), touches the rim: the flat ring on top of the wall."""
    radial = np.hypot(p_CL[..., 0], p_CL[..., 1])
    nearest = np.clip(radial, cup.inner_radius, cup.outer_radius)
    distance = np.hypot(radial - nearest, p_CL[..., 2])
    return np.asarray((p_CL[..., 2] > 0) & (distance < ball_radius + tolerance))
