"""Cast -> the staged reference of the hand: p_WE_desired(t), v_WE_desired(t) and the stage, as pure functions of time."""

from __future__ import annotations

import math
from dataclasses import dataclass
from enum import IntEnum

import numpy as np
from numpy.typing import NDArray

from wam_cast.cast import Cast
from wam_cast.scenario import Motion


class Stage(IntEnum):
    """The stages of a cast (Section 2.2 of the paper), then the hold and the return."""

    MOVE = 0
    WAIT = 1
    DROP = 2
    HOLD = 3
    RETURN = 4


@dataclass(frozen=True)
class QuinticSpline:
    """x(t) from `start` to `end` between two times, with zero velocity and acceleration at both (Section 2.3 of the paper).

    The paper's six boundary conditions give x = start + (end - start) (10 u^3 - 15 u^4 + 6 u^5), with u the share of the
    duration. Before and after, x rests at its end points.
    """

    start_time: float
    end_time: float
    start: float
    end: float

    def evaluate(self, t: float) -> tuple[float, float]:
        """Return position and velocity at time `t`."""
        if t <= self.start_time:
            return self.start, 0.0
        if t >= self.end_time:
            return self.end, 0.0
        duration = self.end_time - self.start_time
        u = (t - self.start_time) / duration
        change = self.end - self.start
        position = self.start + change * u * u * u * (10.0 + u * (-15.0 + 6.0 * u))
        velocity = change / duration * 30.0 * u * u * (1.0 - u) * (1.0 - u)
        return position, velocity

    def acceleration(self, t: float) -> float:
        """Return the acceleration at time `t`."""
        duration = self.end_time - self.start_time
        u = min(max((t - self.start_time) / duration, 0.0), 1.0)
        return (self.end - self.start) / duration**2 * 60.0 * u * (1.0 - u) * (1.0 - 2.0 * u)


class CastMotion:
    """The hand's reference for one cast.

    The hand moves out along the casting plane (MOVE), rests (WAIT), goes down (DROP), rests while the ball settles (HOLD), and
    goes back the way that it came, up and then in (RETURN).

    Attributes
    ----------
    stage_ends
        When each stage ends [s], shape (5,).
    """

    def __init__(self, motion: Motion, cast: Cast) -> None:
        self.cast = cast
        durations = (
            cast.move_duration,
            cast.wait,
            motion.drop_duration,
            motion.hold_duration,
            motion.lift_duration + motion.retreat_duration,
        )
        self.stage_ends: NDArray[np.float64] = np.cumsum(durations)
        move_end, wait_end, drop_end, hold_end, return_end = (float(end) for end in self.stage_ends)
        lift_end = hold_end + motion.lift_duration
        near, far = motion.start_radius, motion.start_radius + cast.distance
        high, low = motion.start_height, motion.start_height - motion.drop_distance
        # Each coordinate is a pair of splines, out and back: the second one rests at the first one's end until it starts.
        self._turn = hold_end
        self._out = QuinticSpline(0.0, move_end, near, far)
        self._down = QuinticSpline(wait_end, drop_end, high, low)
        self._up = QuinticSpline(hold_end, lift_end, low, high)
        self._back = QuinticSpline(lift_end, return_end, far, near)
        self._cos, self._sin = math.cos(cast.bearing), math.sin(cast.bearing)
        self._ends = (move_end, wait_end, drop_end, hold_end)

    def evaluate(self, t: float) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """Return p_WE_desired [m] and v_WE_desired [m/s] at time `t` [s], each of shape (3,), in the world frame."""
        radial, vertical = (self._out, self._down) if t <= self._turn else (self._back, self._up)
        radius, radial_velocity = radial.evaluate(t)
        height, vertical_velocity = vertical.evaluate(t)
        position = np.array([radius * self._cos, radius * self._sin, height])
        velocity = np.array([radial_velocity * self._cos, radial_velocity * self._sin, vertical_velocity])
        return position, velocity

    def stage(self, t: float) -> Stage:
        """Return the stage at time `t` [s]; a stage begins where the one before it ends."""
        return Stage(sum(t >= end for end in self._ends))
