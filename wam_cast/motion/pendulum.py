"""String and ball as a pendulum: how they swing, and the hand's path that makes the ball follow a given one. No Drake."""

from __future__ import annotations

import math
from functools import lru_cache

import numpy as np
from scipy.linalg import eigh

from wam_cast.constants import GRAVITY
from wam_cast.scenario import Ball, String
from wam_cast.types import Array


@lru_cache(maxsize=16)
def swing_frequency(string: String, ball: Ball) -> float:
    """Return the lowest frequency [rad/s] of small swings below a hook at rest, without damping.

    Let theta_i be the angle of link i from the vertical, from i = 0, l its length and m its mass, and M the mass of the ball, which
    is fixed to the last link. For small angles the energies are theta' A theta' / 2 and g l sum of w_i theta_i^2 / 2, where
    w_i = M + (n - i - 1/2) m is the mass that link i carries, half of its own included. A_ij = l^2 w_max(i, j), but that in
    A_ii link i has m / 3 of its own in place of m / 2, and that the last one has the ball's inertia 2/5 M r^2 besides.
    """
    n = string.n_links
    length, mass = string.length / n, string.mass / n
    i = np.arange(n)
    carried = ball.mass + (n - i - 0.5) * mass
    inertia = length**2 * carried[np.maximum.outer(i, i)]
    inertia[i, i] -= mass * length**2 / 6
    inertia[-1, -1] += 0.4 * ball.mass * ball.radius**2
    stiffness = GRAVITY * length * np.diag(carried)
    return float(np.sqrt(eigh(stiffness, inertia, eigvals_only=True, subset_by_index=(0, 0))[0]))


def hand_above(p_WL: Array, v_WL: Array, a_WL: Array, jerk_WL: Array, frequency: float) -> tuple[Array, Array]:
    """Return p_WE [m] and v_WE [m/s], each (3,), of the hand whose ball moves with the given position and its derivatives, (3,).

    Hand and ball are a flat system, whose flat output is the ball: a taut string pulls along a + g z, so the hand is
    g / frequency^2, the length of the pendulum that swings with `frequency` [rad/s], up in that direction. For small angles that
    is p_WL + a_WL / frequency^2 (with the length above it). Where the ball's velocity, acceleration and jerk are zero, so is the
    hand's velocity; where its next derivative is as well, so is the hand's acceleration.
    """
    length = GRAVITY / frequency**2
    pull = a_WL + np.array([0.0, 0.0, GRAVITY])
    size = float(np.linalg.norm(pull))
    direction = pull / size
    turning = (jerk_WL - direction * float(direction @ jerk_WL)) / size
    return p_WL + length * direction, v_WL + length * turning


def pendulum_derivatives(slant: float, rate: float, frequency: float) -> Array:
    """Return a free pendulum's place below its hook [m] and four derivatives of it, shape (5, 2): outward and up.

    It hangs `slant` [rad] outward of its hook, and turns outward at `rate` [rad/s]. With theta'' = -omega^2 sin(theta), the place
    is the complex number -i l exp(i theta), from whose derivatives these follow.
    """
    s, c = math.sin(slant), math.cos(slant)
    first, second = rate, -(frequency**2) * s
    third = -(frequency**2) * c * first
    fourth = -(frequency**2) * (c * second - s * first**2)
    factors = [
        1.0,
        1j * first,
        1j * second - first**2,
        1j * third - 3 * first * second - 1j * first**3,
        1j * fourth - 4 * first * third - 3 * second**2 - 6j * first**2 * second + first**4,
    ]
    place = -1j * GRAVITY / frequency**2 * complex(c, s) * np.array(factors)
    return np.column_stack([place.real, place.imag])
