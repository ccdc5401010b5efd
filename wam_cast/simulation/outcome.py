"""What is told of a simulated cast: its status and its numbers."""

from __future__ import annotations

from dataclasses import dataclass
from enum import StrEnum

import numpy as np

from wam_cast.deprecation import renamed
from wam_cast.types import Array


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
    HANGING = "hanging"
    """At the end of the hold it was inside the cup, but in a taut string: too short to let it rest on the bottom."""
    NOT_SETTLED = "not_settled"
    """At the end of the hold it was still moving inside the cup, or had not come to lie anywhere."""
    NEVER_CROSSED = "never_crossed"
    """The ball did not come down to the rim plane before the end of the hold."""
    LIMIT_HIT = "limit_hit"
    """A joint left its range or its velocity limit, or a motor saturated, wherever the ball went: see `Outcome.limits_hit`."""
    DIVERGED = "diverged"
    """The simulation diverged."""
    STOPPED = "stopped"
    """The arm's side of a wire stopped it: see `Outcome.stop_reason`."""


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
    peak_torque_utilization, peak_velocity_utilization
        Per joint, the peak utilization of the motors' torque and of the velocity limit, each of shape (7,): up to the end of the
        drop, as a model predicts them, whether there is a cup or not. From the landing on they are those of the arm alone.
    peak_tracking_error
        The hand's largest distance from what the controller says by `hand_desired` [m]; nan if it does not say.
    limits_hit
        Which limits the arm met up to the end of the drop, and with a cup on to `end_time`, such as `("joint 4 speed",)`.
    end_time
        When the outcome was known, from the start of the turn [s].
    return_faults
        What went wrong after that, on the way home, where it was simulated: limits that the arm met, as in `limits_hit`, or
        `"diverged"`. They do not change the status, which is the cast's.
    stop_reason
        Why the arm's side of a wire stopped the cast, if it did: of what became of the ball nothing is known then.
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
    peak_torque_utilization: Array
    peak_velocity_utilization: Array
    peak_tracking_error: float
    limits_hit: tuple[str, ...]
    end_time: float
    return_faults: tuple[str, ...] = ()
    stop_reason: str = ""

    peak_load = renamed("peak_load", "peak_torque_utilization")
    peak_speed = renamed("peak_speed", "peak_velocity_utilization")

    @property
    def is_caught(self) -> bool:
        """Whether the ball rests inside the cup, and the arm kept its limits on the way."""
        return self.status is Status.CAUGHT

    @property
    def entry_speed(self) -> float:
        """Speed of the ball at the landing [m/s]."""
        return float(np.linalg.norm(self.entry_velocity))
