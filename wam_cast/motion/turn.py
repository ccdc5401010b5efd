"""Turn: the hand's way from one bearing to the next, at whose end the ball hangs at rest."""

from __future__ import annotations

import math

import numpy as np
from scipy.interpolate import BPoly

from wam_cast.motion.pendulum import Pendulum, hand_above
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
        motion, period = scenario.motion, scenario.controller.period
        angle = abs(end - start)
        wanted = motion.turn_duration * max(angle**0.25, angle**0.5)
        self.duration = period * math.ceil(wanted / period - 1e-9)
        self._end = end
        self._radius = motion.start_radius
        self._pendulum = Pendulum.like(scenario)
        self._ball_height = motion.start_height - self._pendulum.length
        # Angles so small that they take no time are none.
        if self.duration > 0:
            angles = BPoly.from_derivatives([0.0, self.duration], [[start, 0, 0, 0, 0], [end, 0, 0, 0, 0]])
            self._angles = [angles.derivative(order) for order in range(4)]

    def evaluate(self, t: float) -> tuple[Array, Array]:
        """Return p_WE_desired [m] and v_WE_desired [m/s], each (3,), at a time `t` [s] before the turn's end."""
        t = max(t, 0.0)
        angle, rate, acceleration, jerk = (float(derivative(t)) for derivative in self._angles)
        outward = np.array([math.cos(angle), math.sin(angle), 0.0])
        onward = np.array([-outward[1], outward[0], 0.0])
        p_WL = self._radius * outward + np.array([0.0, 0.0, self._ball_height])
        v_WL = self._radius * rate * onward
        a_WL = self._radius * (acceleration * onward - rate**2 * outward)
        jerk_WL = self._radius * ((jerk - rate**3) * onward - 3 * rate * acceleration * outward)
        return hand_above(p_WL, v_WL, a_WL, jerk_WL, self._pendulum)

    def bearing(self, t: float) -> tuple[float, float]:
        """Return the angle of the ball [rad] and its rate [rad/s] at time `t` [s]."""
        if t >= self.duration:
            return self._end, 0.0
        t = max(t, 0.0)
        return float(self._angles[0](t)), float(self._angles[1](t))
