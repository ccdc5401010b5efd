"""Where the hand of many casts is in the casting plane: as it is planned, or between samples of how it moved. No Drake or JAX."""

from __future__ import annotations

from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from wam_cast.motion.spline import quintic_step
from wam_cast.scenario import Scenario
from wam_cast.types import Array

Rows = NDArray[np.intp]
"""Numbers of casts."""


class HandPath(Protocol):
    """Where the hands of casts are in the casting plane."""

    def __call__(self, t: Array, rows: Rows) -> tuple[Array, Array, Array]:
        """Return place [m], velocity and acceleration of the casts `rows` at a time [s] each, outward and up, (2, n) each."""


class PlannedPath:
    """The hand where `.CastMotion` wants it, of casts `[distance, speed, wait]`, shape (n, 3)."""

    def __init__(self, scenario: Scenario, casts: Array) -> None:
        motion = scenario.motion
        self._distance, speed, wait = np.asarray(casts, dtype=float).T
        self._move_duration = self._distance / speed
        self.drop_start: Array = self._move_duration + wait
        self._start = np.array([[motion.start_radius], [motion.start_height]])
        self._drop_distance, self._drop_duration = motion.drop_distance, motion.drop_duration

    @property
    def drop_end(self) -> Array:
        """When each hand is down [s], (n,)."""
        return self.drop_start + self._drop_duration

    def __call__(self, t: Array, rows: Rows) -> tuple[Array, Array, Array]:
        """See `HandPath`."""
        out = _step(t, self._move_duration[rows], self._distance[rows])
        down = _step(t - self.drop_start[rows], self._drop_duration, -self._drop_distance)
        place, velocity, acceleration = (np.stack(pair) for pair in zip(out, down, strict=True))
        return self._start + place, velocity, acceleration


def _step(since: Array, duration: Array | float, change: Array | float) -> tuple[Array, Array, Array]:
    """Return a quintic step by `change`, and its two derivatives, at times since its start [s]."""
    u = np.clip(since / duration, 0.0, 1.0)
    value, rate = quintic_step(u)
    bend = 60.0 * u * (1.0 - u) * (1.0 - 2.0 * u)
    return change * value, change / duration * rate, change / duration**2 * bend


class SampledPath:
    """The hand where the controller brings it: a cubic between samples, and at rest after the last one.

    Held torques change the hand's acceleration in steps, by which a string would go slack and taut again and again. Here it changes
    linearly between samples, from the change of velocity over the two periods around one to that around the next.

    Parameters
    ----------
    period
        Between samples [s].
    places, velocities
        At the samples [m], [m/s], (n_samples, 2, n).
    """

    def __init__(self, period: float, places: Array, velocities: Array) -> None:
        self.period = period
        accelerations = np.gradient(velocities, period, axis=0)
        stacked = np.concatenate([places, period * velocities, accelerations], axis=1)
        self._samples = np.ascontiguousarray(stacked.transpose(0, 2, 1))  # a cast's numbers side by side

    def __call__(self, t: Array, rows: Rows) -> tuple[Array, Array, Array]:
        """See `HandPath`."""
        last = len(self._samples) - 1
        at = np.minimum(t / self.period, last)
        k = np.minimum(at.astype(int), last - 1)
        u = at - k
        before, after = self._samples[k, rows].T, self._samples[k + 1, rows].T
        p, v, change = before[:2], before[2:4], after[:2] - before[:2]
        # Newton's form: p + u v + u^2 (bend + u twist).
        bend, twist = 3 * change - 2 * v - after[2:4], v + after[2:4] - 2 * change
        place = p + u * (v + u * (bend + u * twist))
        velocity = (v + u * (2 * bend + 3 * u * twist)) / self.period
        moves = at < last
        return place, moves * velocity, moves * (before[4:] + u * (after[4:] - before[4:]))
