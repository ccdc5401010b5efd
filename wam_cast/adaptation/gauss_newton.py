"""Gauss and Newton's method for the most probable parameters, and Laplace's approximation about them."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from wam_cast.types import Array

MAX_STEPS = 6
"""Two or three are usual."""

MAX_HALVINGS = 3
"""Of a step that makes parameters less probable; if none of these is better, they stay: derivatives are seldom exact."""

CONVERGED = 0.3
"""Length of a step, in standard deviations of the posterior, that is the last one, and taken as it is."""

Residuals = Callable[[Array], tuple[Array, Array]]
"""Of parameters (p,): residuals in standard deviations (m,) and their Jacobian (m, p)."""


def most_probable(residuals: Residuals, start: Array) -> tuple[Array, Array]:
    """Return mean and covariance of parameters z, of which z ~ N(0, I) is believed, whose residuals are N(0, I).

    ::

        minimize  (|r(z)|^2 + |z|^2) / 2,     step  -(I + J^T J)^-1 (J^T r + z)

    A step that does not lower this is halved (Nocedal and Wright, Numerical Optimization, Section 10.3). The covariance is
    (I + J^T J)^-1 (Bishop, Pattern Recognition and Machine Learning, Section 4.4), with the second derivatives of r left out.

    Parameters
    ----------
    residuals
        Of parameters; costly, so that each call counts.
    start
        Parameters to begin with, shape (p,).
    """
    z, (r, J) = start, residuals(start)
    for _ in range(MAX_STEPS):
        step = -np.linalg.solve(_precision(J), J.T @ r + z)
        if step @ _precision(J) @ step < CONVERGED**2:
            z = z + step
            break
        for halving in range(MAX_HALVINGS + 1):
            moved = z + 0.5**halving * step
            r_moved, J_moved = residuals(moved)
            if r_moved @ r_moved + moved @ moved < r @ r + z @ z:
                z, r, J = moved, r_moved, J_moved
                break
        else:
            break
    return z, np.asarray(np.linalg.inv(_precision(J)), dtype=np.float64)


def _precision(J: Array) -> Array:
    return np.asarray(np.eye(J.shape[1]) + J.T @ J)
