"""Where the ball is about the cup: pure geometry, without Drake."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from wam_cast.constants import GRAVITY
from wam_cast.scenario import Cup, Scenario
from wam_cast.tether import lifting_share
from wam_cast.types import Array, Position

REST_RISE = 0.005
"""A ball in the cup rests once its energy could lift it no higher above the bottom than this [m]."""

SLACK_MARGIN = 0.005
"""The string is slack when hand and ball are closer than its length by more than this share of it."""


def gap_to_contact(p_WL: Array, cup: Position, scenario: Scenario) -> float:
    """Return the distance [m] of a ball with its centre at `p_WL` (3,) from the floor or a solid cylinder as large as the cup."""
    shape, radius = scenario.cup, scenario.ball.radius
    outside = math.hypot(p_WL[0] - cup[0], p_WL[1] - cup[1]) - shape.outer_radius
    above = p_WL[2] - shape.rim_height
    to_cup = math.hypot(max(outside, 0.0), max(above, 0.0))
    return float(min(to_cup, p_WL[2]) - radius)


def taut_distance(scenario: Scenario) -> float:
    """Return from which distance between hand and ball [m] on the string can hold the ball."""
    string = scenario.string
    return (1 - SLACK_MARGIN - lifting_share(string.mass, scenario.ball.mass)) * string.length


def is_inside(p_CL: Array, cup: Cup) -> NDArray[np.bool_]:
    """Return where the ball's centre `p_CL`, shape (..., 3), is inside the cup, below its rim."""
    radial = np.hypot(p_CL[..., 0], p_CL[..., 1])
    return np.asarray((p_CL[..., 2] < 0) & (radial < cup.inner_radius))


def possible_rise(p_CL: Array, speed: float, cup: Cup, ball_radius: float) -> float:
    """Return how far above its resting place on the cup's bottom [m] a free ball at `p_CL`, shape (3,), would rise."""
    height = p_CL[2] + cup.rim_height - cup.bottom_thickness - ball_radius
    return float(height + speed**2 / (2 * GRAVITY))


def touches_rim(p_CL: Array, cup: Cup, ball_radius: float, tolerance: float = 5e-4) -> NDArray[np.bool_]:
    """Return where a ball at `p_CL`, shape (..., 3), touches the rim: the flat ring on top of the wall."""
    radial = np.hypot(p_CL[..., 0], p_CL[..., 1])
    nearest = np.clip(radial, cup.inner_radius, cup.outer_radius)
    distance = np.hypot(radial - nearest, p_CL[..., 2])
    return np.asarray((p_CL[..., 2] > 0) & (distance < ball_radius + tolerance))
