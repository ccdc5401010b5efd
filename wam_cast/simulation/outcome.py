"""Outcome of a cast and its status; pure functions of the ball's trajectory, without Drake."""

from __future__ import annotations

import math
from dataclasses import dataclass
from enum import StrEnum

import numpy as np
from numpy.typing import NDArray
from scipy.interpolate import CubicHermiteSpline
from scipy.optimize import brentq

from wam_cast.constants import GRAVITY
from wam_cast.scenario import Cup
from wam_cast.types import Array

REST_RISE = 0.005
"""A ball in the cup rests once its energy could lift it no higher above the bottom than this [m]."""

SLACK_MARGIN = 0.005
"""The string is slack when hand and ball are closer than its length by more than this share of it."""


class Status(StrEnum):
    """What became of a cast."""

    CAUGHT = "caught"
    """The ball rests inside the cup, carried by it."""
    LANDED = "landed"
    """Without a cup: the ball crossed the rim plane."""
    SHORT = "short"
    """It missed on the side toward the base."""
    LONG = "long"
    """It missed on the far side."""
    SIDE = "side"
    """It missed to the left or right of the casting plane."""
    RIM_BOUNCE = "rim_bounce"
    """It missed after it had touched the rim."""
    CAME_OUT = "came_out"
    """It was inside and came out again."""
    NOT_SETTLED = "not_settled"
    """At the end of the hold it was still moving inside the cup, or had not come to lie anywhere."""
    NEVER_CROSSED = "never_crossed"
    """The ball did not come down to the rim plane before the end of the hold."""
    LIMIT_HIT = "limit_hit"
    """A joint left its range or its speed limit, or a motor saturated, wherever the ball went: see `Outcome.limits_hit`."""
    DIVERGED = "diverged"
    """The simulation broke down."""


@dataclass(frozen=True, eq=False)
class BallTrack:
    """The ball over time: times (n,) [s], p_WL (n, 3) [m], v_WL (n, 3) [m/s], world frame."""

    times: Array
    p_WL: Array
    v_WL: Array


@dataclass(frozen=True, eq=False)
class Crossing:
    """Where the ball's centre first came down through a horizontal plane: time [s], p_WL and v_WL (3,)."""

    time: float
    p_WL: Array
    v_WL: Array


@dataclass(frozen=True, eq=False)
class Outcome:
    """What became of one cast.

    Attributes
    ----------
    status
        See `Status`.
    landing
        World (x, y) [m] where the ball's centre first came down through the rim plane, shape (2,); nan if it never did. The cup
        does not count: it is where the ball would have come down without one, though the rim turned it aside before.
    landing_along, landing_across
        The same in the casting plane's axes [m]: from the base axis outward, and to its left.
    crossing_time
        Of the landing, from the start of the move [s]: how long the turn before it took does not count.
    entry_velocity
        v_WL at the landing [m/s], shape (3,), world frame.
    entry_angle
        Between that velocity and the downward vertical [rad].
    is_slack
        Whether the string was slack at the landing.
    slack
        By how much hand and ball were closer than the string is long [m]: the least from the landing until the whole ball was
        below the rim plane, as if there were no cup; nan if it never landed.
    miss
        Horizontal distance from the landing to the cup's axis [m]; nan without a cup.
    peak_load, peak_speed
        Per joint, the largest share of the motors' torque and of the speed limit that the cast used, each of shape (7,).
    peak_tracking_error
        The hand's largest distance from its reference [m].
    limits_hit
        Which limits the arm met, such as `("joint 4 speed",)`.
    end_time
        When the outcome was known, from the start of the turn [s].
    return_faults
        What went wrong after that, on the way home, where it was simulated: limits that the arm met, as in `limits_hit`, or
        `"diverged"`. They do not change the status, which is the cast's.
    """

    status: Status
    landing: Array
    landing_along: float
    landing_across: float
    crossing_time: float
    entry_velocity: Array
    entry_angle: float
    is_slack: bool
    slack: float
    miss: float
    peak_load: Array
    peak_speed: Array
    peak_tracking_error: float
    limits_hit: tuple[str, ...]
    end_time: float
    return_faults: tuple[str, ...] = ()

    @property
    def is_caught(self) -> bool:
        """Whether the ball rests inside the cup, and the arm kept its limits on the way."""
        return self.status is Status.CAUGHT

    @property
    def entry_speed(self) -> float:
        """Speed of the ball at the landing [m/s]."""
        return float(np.linalg.norm(self.entry_velocity))


def find_crossing(track: BallTrack, height: float) -> Crossing | None:
    """Return the first downward crossing of the plane at `height` [m], or none.

    Between samples the ball follows the cubic that has their positions and velocities.
    """
    z = track.p_WL[:, 2]
    (falling,) = np.nonzero((z[:-1] > height) & (z[1:] <= height))
    if len(falling) == 0:
        return None
    pair = slice(falling[0], falling[0] + 2)
    times = track.times[pair]
    path = CubicHermiteSpline(times, track.p_WL[pair], track.v_WL[pair])
    time = float(brentq(lambda t: path(t)[2] - height, times[0], times[1], xtol=1e-12))
    return Crossing(time, path(time), path(time, 1))


def angle_from_vertical(velocity: Array) -> float:
    """Return the angle between `velocity`, shape (3,), and straight down [rad]."""
    return math.atan2(math.hypot(velocity[0], velocity[1]), -velocity[2])


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


def judge(p_CL: Array, is_at_rest: bool, is_carried: bool, cup: Cup, ball_radius: float) -> Status:
    """Return what became of a ball whose path about the cup was `p_CL`, shape (n, 3), x along the casting plane, y to its left.

    `is_at_rest` and `is_carried` (the cup was touched since it came to rest) describe the end of the path.
    """
    inside = is_inside(p_CL, cup)
    last = p_CL[-1]
    if inside[-1]:
        return Status.CAUGHT if is_at_rest and is_carried else Status.NOT_SETTLED
    if last[2] >= 0:
        return Status.NOT_SETTLED
    if np.any(inside):
        return Status.CAME_OUT
    if np.any(touches_rim(p_CL, cup, ball_radius)):
        return Status.RIM_BOUNCE
    below = p_CL[int(np.argmax(p_CL[:, 2] < 0))]
    if abs(below[1]) > abs(below[0]):
        return Status.SIDE
    return Status.SHORT if below[0] < 0 else Status.LONG
