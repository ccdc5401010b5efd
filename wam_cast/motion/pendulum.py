"""String and ball as a pendulum: how they swing, and the hand's path that makes the ball follow a given one. No Drake."""

from __future__ import annotations

import math
from functools import lru_cache
from typing import NamedTuple, Self

import numpy as np
from scipy.linalg import eigh

from wam_cast.motion.string_chain import string_chain
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
    inertia, _, stiffness = string_matrices(scenario)
    return float(np.sqrt(eigh(stiffness, inertia, eigvals_only=True, subset_by_index=(0, 0))[0]))


def string_matrices(scenario: Scenario) -> tuple[Array, Array, Array]:
    """Return A, D and G + B of `swing_frequency`, (n_links + 1, n_links + 1) each: D is the joints' damping, by angles as well."""
    n, chain = scenario.string.n_links, string_chain(scenario.string, scenario.ball)
    below = np.r_[np.cumsum(chain.mass[::-1])[::-1][1:], 0.0]
    carried = chain.moment + below * chain.length
    i = np.arange(n + 1)
    inertia = chain.length[np.minimum.outer(i, i)] * carried[np.maximum.outer(i, i)]
    inertia[i, i] = chain.inertia + below * chain.length**2
    bends = np.diff(np.eye(n + 1), axis=0, prepend=0)  # what a joint's angle is of the bodies' angles
    damping = bends.T @ np.diag(chain.damping) @ bends
    stiffness = scenario.gravity * np.diag(carried) + bends.T @ np.diag(chain.stiffness) @ bends
    return inertia, damping, stiffness


@lru_cache(maxsize=64)
def fastest_swing(scenario: Scenario) -> float:
    """Return the largest absolute eigenvalue [1/s] of small swings below a hook at rest, with damping."""
    inertia, damping, stiffness = string_matrices(scenario)
    n = len(inertia)
    lower = -np.linalg.solve(inertia, np.hstack([stiffness, damping]))
    return float(np.abs(np.linalg.eigvals(np.vstack([np.eye(n, 2 * n, n), lower]))).max())


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

    Or of many at once, (3, n) each; arrays of another library will do.

    Hand and ball are a flat system, whose flat output is the ball: a taut string pulls along a + g z, so the hand is the pendulum's
    length up in that direction. For small angles that is p_WL + a_WL / frequency^2 (with the length above it). Where the ball's
    velocity, acceleration and jerk are zero, so is the hand's velocity; where its next derivative is as well, so is the hand's
    acceleration.
    """
    up = np.array([0.0, 0.0, 1.0]).reshape(3, *(1,) * (a_WL.ndim - 1))
    pull = a_WL + up * pendulum.gravity
    size = (pull * pull).sum(0) ** 0.5
    direction = pull / size
    turning = (jerk_WL - direction * (direction * jerk_WL).sum(0)) / size
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
