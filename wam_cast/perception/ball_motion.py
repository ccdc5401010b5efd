"""How a ball moves that hangs on a string or falls: a spherical pendulum below a moving hand, or a parabola."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from wam_cast.types import Array

N_STEPS = 4
"""Of the integration from one picture to the next."""

SLACK = 0.003
"""A string whose ends are closer by more than this than it is long does not pull [m]."""


@dataclass(frozen=True)
class Hand:
    """The hand between two pictures, under a constant acceleration.

    Attributes
    ----------
    p_WE, v_WE, a_WE
        Position [m], velocity [m/s] and acceleration [m/s^2], (3,) each, at the first one.
    """

    p_WE: Array
    v_WE: Array
    a_WE: Array

    @classmethod
    def between(cls, before: Array, after: Array, duration: float) -> Hand:
        """Return the hand that goes from one position and velocity, (6,), to another in a time [s]."""
        return cls(before[:3], before[3:], (after[3:] - before[3:]) / duration)

    def at(self, time: float) -> tuple[Array, Array]:
        """Return its position and velocity after a time [s]."""
        return self.p_WE + time * (self.v_WE + 0.5 * time * self.a_WE), self.v_WE + time * self.a_WE


def pull(r: Array, v: Array, a_WE: Array, gravity: float) -> Array:
    """Return by how much a taut string pulls a ball toward the hand, for its distance [1/s^2], shape (n,); never less than 0.

    For a ball at r [m] from the hand that moves at v [m/s] relative to it, (n, 3) each, the distance stays if
    r . (g - a_WE - pull r) + v . v = 0.
    """
    falls = np.array([0.0, 0.0, -gravity]) - a_WE
    return np.asarray(np.maximum((np.sum(v * v, axis=1) + r @ falls) / np.sum(r * r, axis=1), 0.0))


def moved(states: Array, hand: Hand, duration: float, gravity: float) -> Array:
    """Return states of the ball, shape (n, 7), a time [s] later: p_WL [m], v_WL [m/s] and the string's length [m].

    The string pulls those that are as far from the hand as it is long, to within `SLACK`; the others fall freely, in parabolas.
    """
    step = duration / N_STEPS

    def rate(ball: Array, time: float) -> Array:
        p_WE, v_WE = hand.at(time)
        r, v = ball[:, :3] - p_WE, ball[:, 3:6] - v_WE
        is_taut = np.linalg.norm(r, axis=1) > ball[:, 6] - SLACK
        a_WL = -(is_taut * pull(r, v, hand.a_WE, gravity))[:, np.newaxis] * r
        a_WL[:, 2] -= gravity
        return np.hstack([ball[:, 3:6], a_WL, np.zeros((len(ball), 1))])

    for i in range(N_STEPS):  # the midpoint rule, exact for a parabola
        middle = states + 0.5 * step * rate(states, i * step)
        states = states + step * rate(middle, (i + 0.5) * step)
    return states
