"""Torques held from sample to sample. Drake's own blocks for it start at zero, these with what their default state is made."""

from __future__ import annotations

import numpy as np
from pydrake.systems.primitives import LinearSystem

from wam_cast.robot.plant import N_ARM
from wam_cast.types import Array


def delay_line(n_samples: int, period: float) -> LinearSystem:
    """Return a block that samples torques [N m] (7) every `period` [s] and gives the one of `n_samples` before the next.

    One sample is a zero-order hold: the last torque, until the next one. The state is the samples, the newest first.
    """
    n = n_samples * N_ARM
    first, last = np.eye(n, N_ARM), np.eye(N_ARM, n, n - N_ARM)
    return LinearSystem(np.eye(n, k=-N_ARM), first, last, np.zeros((N_ARM, N_ARM)), period)


def fill(line: LinearSystem, torque: Array) -> Array:
    """Return the state of a delay line that was given `torque` [N m], (7,), ever since."""
    return np.tile(torque, line.num_states() // N_ARM)
