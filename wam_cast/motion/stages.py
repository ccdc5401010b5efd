"""Cast -> the staged reference of the hand: p_WE_desired(t), v_WE_desired(t) and the stage, as pure functions of time."""

from __future__ import annotations

import math
from enum import IntEnum
from functools import lru_cache

import numpy as np

from wam_cast.arm.arm_model import arm_model
from wam_cast.cast import Cast
from wam_cast.motion.return_path import Return
from wam_cast.motion.spline import QuinticSpline
from wam_cast.motion.turn import Turn
from wam_cast.scenario import Scenario
from wam_cast.types import Array


class Stage(IntEnum):
    """The turn, the stages of a cast (Section 2.2 of the paper), then the hold and the return."""

    TURN = 0
    MOVE = 1
    WAIT = 2
    DROP = 3
    HOLD = 4
    RETURN = 5


class CastMotion:
    """The hand's reference for one cast.

    The hand goes round to the casting plane (TURN), out along it (MOVE), rests (WAIT), goes down (DROP), rests while the ball
    settles (HOLD), lifts the ball out of the cup and goes back to where the turn ended (RETURN).

    Parameters
    ----------
    scenario, cast
        What is cast, and how.
    start_bearing
        Of the hand before the turn [rad]; home by default. From there to the cast's own bearing there may be nothing to turn.
    cup_radius
        Distance of the cup's axis from the base axis [m], along the casting plane: where the ball is to be lifted out. None
        if there is no cup.

    Attributes
    ----------
    cast, start_bearing, cup_radius
        As given.
    stage_ends
        When each stage ends [s], shape (6,), from the start of the turn.
    """

    def __init__(
        self, scenario: Scenario, cast: Cast, *, start_bearing: float = 0.0, cup_radius: float | None = None
    ) -> None:
        self.cast, self.start_bearing, self.cup_radius = cast, start_bearing, cup_radius
        motion = scenario.motion
        near, far = motion.start_radius, motion.start_radius + cast.distance
        high, low = motion.start_height, motion.start_height - motion.drop_distance
        self._turn = Turn(scenario, start_bearing, cast.bearing)
        self._return = Return(scenario, far, cup_radius)
        # From here on time counts from the end of the turn.
        stages = (cast.move_duration, cast.wait, motion.drop_duration, motion.hold_duration)
        ends = np.cumsum([*stages, self._return.duration])
        self.stage_ends: Array = np.r_[0.0, ends] + self._turn.duration
        move_end, wait_end, drop_end, self._hold_end, _ = (float(end) for end in ends)
        self._out = QuinticSpline(0.0, move_end, near, far)
        self._down = QuinticSpline(wait_end, drop_end, high, low)
        self._cos, self._sin = math.cos(cast.bearing), math.sin(cast.bearing)
        self._ends = [float(end) for end in self.stage_ends[:-1]]

    def evaluate(self, t: float) -> tuple[Array, Array]:
        """Return p_WE_desired [m] and v_WE_desired [m/s] at time `t` [s], each of shape (3,), in the world frame."""
        if 0 < self._turn.duration > t:
            return self._turn.evaluate(t)
        t -= self._turn.duration
        if t <= self._hold_end:
            radius, radial_velocity = self._out.evaluate(t)
            height, vertical_velocity = self._down.evaluate(t)
        else:
            (radius, height), (radial_velocity, vertical_velocity) = self._return.evaluate(t - self._hold_end)
        position = np.array([radius * self._cos, radius * self._sin, height])
        velocity = np.array([radial_velocity * self._cos, radial_velocity * self._sin, vertical_velocity])
        return position, velocity

    def bearing(self, t: float) -> tuple[float, float]:
        """Return the bearing of the plane that the arm is in at time `t` [s], as it turns: [rad] and [rad/s]."""
        return self._turn.bearing(t)

    def stage(self, t: float) -> Stage:
        """Return the stage at time `t` [s]; a stage begins where the one before it ends."""
        return Stage(sum(t >= end for end in self._ends))


def cast_motion(
    scenario: Scenario, cast: Cast, *, start_bearing: float = 0.0, cup_radius: float | None = None
) -> CastMotion:
    """Return a `CastMotion`, the same one to all who ask in turn, as the phases of a cast do: it takes a while to make."""
    return _cast_motion(scenario, arm_model(scenario.arm).urdf, cast, start_bearing, cup_radius)


@lru_cache(maxsize=8)
def _cast_motion(
    scenario: Scenario, _urdf: str, cast: Cast, start_bearing: float, cup_radius: float | None
) -> CastMotion:
    return CastMotion(scenario, cast, start_bearing=start_bearing, cup_radius=cup_radius)
