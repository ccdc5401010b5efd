"""String and ball as a pendulum: how they swing, and the hand's path that makes the ball follow a given one. No Drake."""

from __future__ import annotations

import math
from functools import lru_cache
from typing import NamedTuple, Self

import numpy as np
from scipy.linalg import eigh

from wam_cast.scenario import Scenario
from wam_cast.types import Array


@lru_cache(maxsize=16)
def swing_frequency(scenario: Scenario) -> float:
    """Return the lowest frequency [rad/s] of small swings below a hook at rest, without damping.

    Let theta_i be the angle from the vertical of the string's links, from i = 0, and last of the ball, which hangs at its surface:
    a link like the others, of the ball's radius, whose mass is at its end. With l_i their lengths, m_i their masses, I_i their
    moments of inertia about their centres, which are c_i from their upper ends, and M_i the mass below each, the energies for small
    angles are theta' A theta' / 2 and theta (G + B) theta / 2, where A_ij = l_i (m_j c_j + M_j l_j) for i above j,
    A_ii = m_i c_i^2 + M_i l_i^2 + I_i, G_ii = g (m_i c_i + M_i l_i), and B is the bending stiffness between links.
    """
    string, ball, n = scenario.string, scenario.ball, scenario.string.n_links
    link, mass = string.link_length(ball), string.mass / n
    length = np.r_[np.full(n, link), ball.radius]
    masses = np.r_[np.full(n, mass), ball.mass]
    below = np.r_[np.cumsum(masses[::-1])[::-1][1:], 0.0]
    centre = np.r_[np.full(n, link / 2), ball.radius]
    own = np.r_[np.full(n, mass * link**2 / 12), ball.inertia_factor * ball.mass * ball.radius**2]
    carried = masses * centre + below * length
    i = np.arange(n + 1)
    inertia = length[np.minimum.outer(i, i)] * carried[np.maximum.outer(i, i)]
    inertia[i, i] = masses * centre**2 + below * length**2 + own
    bends = np.diff(np.eye(n), axis=0)
    stiffness = scenario.gravity * np.diag(carried)
    stiffness[:n, :n] += string.bending_stiffness / link * bends.T @ bends
    return float(np.sqrt(eigh(stiffness, inertia, eigvals_only=True, subset_by_index=(0, 0))[0]))


class Pendulum(NamedTuple):
    """A point mass on a massless string of a length [m], under gravity [m/s^2]."""

    length: float
    gravity: float

    @classmethod
    def like(cls, scenario: Scenario) -> Self:
        """Return the pendulum that swings as string and ball do."""
        return cls(scenario.gravity / swing_frequency(scenario) ** 2, scenario.gravity)


def hand_above(p_WL: Array, v_WL: Array, a_WL: Array, jerk_WL: Array, pendulum: Pendulum) -> tuple[Array, Array]:
    """Return p_WE [m] and v_WE [m/s], each (3,), of the hand whose ball moves with the given position and its derivatives, (3,).

    Hand and ball are a flat system, whose flat output is the ball: a taut string pulls along a + g z, so the hand is the pendulum's
    length up in that direction. For small angles that is p_WL + a_WL / frequency^2 (with the length above it). Where the ball's
    velocity, acceleration and jerk are zero, so is the hand's velocity; where its next derivative is as well, so is the hand's
    acceleration.
    """
    pull = a_WL + np.array([0.0, 0.0, pendulum.gravity])
    size = float(np.linalg.norm(pull))
    direction = pull / size
    turning = (jerk_WL - direction * float(direction @ jerk_WL)) / size
    return p_WL + pendulum.length * direction, v_WL + pendulum.length * turning


def pendulum_derivatives(slant: float, rate: float, pendulum: Pendulum) -> Array:
    """Return a free pendulum's place below its hook [m] and four derivatives of it, shape (5, 2): outward and up.

    It hangs `slant` [rad] outward of its hook, and turns outward at `rate` [rad/s]. With theta'' = -omega^2 sin(theta), the place
    is the complex number -i l exp(i theta), from whose derivatives these follow.
    """
    s, c, stiffness = math.sin(slant), math.cos(slant), pendulum.gravity / pendulum.length
    first, second = rate, -stiffness * s
    third = -stiffness * c * first
    fourth = -stiffness * (c * second - s * first**2)
    factors = [
        1.0,
        1j * first,
        1j * second - first**2,
        1j * third - 3 * first * second - 1j * first**3,
        1j * fourth - 4 * first * third - 3 * second**2 - 6j * first**2 * second + first**4,
    ]
    place = -1j * pendulum.length * complex(c, s) * np.array(factors)
    return np.column_stack([place.real, place.imag])
