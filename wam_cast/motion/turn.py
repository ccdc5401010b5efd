"""Turn: the hand's way from one bearing to the next, at whose end the ball hangs at rest."""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from wam_cast.motion.pendulum import Pendulum, hand_above
from wam_cast.motion.spline import nonic_step
from wam_cast.scenario import Scenario
from wam_cast.types import Array


class Turn:
    """Joint 1 turns from `start` to `end` [rad], and the ball goes with it, at rest before and after.

    Nothing measures the string: the ball is given a path, an arc at the starting radius whose angle has four zero derivatives at
    both ends, and the hand goes where the ball's motion asks for it (`.hand_above`). That is not quite an arc.

    Attributes
    ----------
    duration
        Of the turn [s]: `motion.turn_duration` for one radian. It goes with the fourth root of a smaller angle, which
        keeps the fourth derivative of the ball's path, on which the shaping's acceleration depends, and with the square root of
        a larger one, which keeps its acceleration. An integer number of control periods, so that a cast meets the controller's
        samples as it would without a turn before it.
    """

    def __init__(self, scenario: Scenario, start: float, end: float) -> None:
        self.duration = turn_duration(scenario, end - start)
        self._start, self._end = start, end
        self._radius, self._pendulum = scenario.motion.start_radius, Pendulum.like(scenario)
        self._ball_height = scenario.motion.start_height - self._pendulum.length

    def evaluate(self, t: float) -> tuple[Array, Array]:
        """Return p_WE_desired [m] and v_WE_desired [m/s], each (3,), at a time `t` [s] before the turn's end."""
        angles = turned(t, self._start, self._end, self.duration)
        return swung_hand(angles, self._radius, self._ball_height, self._pendulum)

    def bearing(self, t: float) -> tuple[float, float]:
        """Return the angle of the ball [rad] and its rate [rad/s] at time `t` [s]."""
        if t >= self.duration:
            return self._end, 0.0
        angle, rate, _, _ = turned(t, self._start, self._end, self.duration)
        return angle, rate


def turn_duration(scenario: Scenario, angle: float) -> float:
    """Return how long a turn by `angle` [rad] takes [s]: see `Turn.duration`; angles so small that they take no time are none."""
    angle, period = abs(angle), scenario.controller.period
    wanted = scenario.motion.turn_duration * max(angle**0.25, angle**0.5)
    return float(period * math.ceil(wanted / period - 1e-9))


def turned(t: float, start: float, end: float, duration: float) -> tuple[float, float, float, float]:
    """Return the angle [rad] at time `t` [s] of a turn that takes `duration` [s], and three derivatives of it."""
    value, first, second, third = nonic_step(min(max(t / duration, 0.0), 1.0))
    change = end - start
    return (
        start + change * value,
        change / duration * first,
        change / duration**2 * second,
        change / duration**3 * third,
    )


def swung_hand(
    angles: tuple[Any, ...], radius: Any, ball_height: Any, pendulum: Pendulum, xp: Any = np
) -> tuple[Any, Any]:
    """Return p_WE [m] and v_WE [m/s], each (3,), of the hand whose ball goes round at a radius and a height [m].

    `angles`: the ball's angle [rad] and three derivatives. Or of many at once, (3, n) each, arrays of the library `xp`.
    """
    angle, rate, acceleration, jerk = angles
    zero = 0.0 * angle
    outward = xp.stack([xp.cos(angle), xp.sin(angle), zero])
    onward = xp.stack([-outward[1], outward[0], zero])
    p_WL = radius * outward + xp.stack([zero, zero, ball_height + zero])
    v_WL = radius * rate * onward
    a_WL = radius * (acceleration * onward - rate**2 * outward)
    jerk_WL = radius * ((jerk - rate**3) * onward - 3 * rate * acceleration * outward)
    return hand_above(p_WL, v_WL, a_WL, jerk_WL, pendulum)
