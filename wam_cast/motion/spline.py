"""Smooth steps from one value to another: the paper's quintic spline, and a smoother one."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TypeVar

from wam_cast.types import Array

T = TypeVar("T", float, Array)  # or an array of another library


def quintic_step(u: T) -> tuple[T, T]:
    """Return the polynomial from 0 at u = 0 to 1 at u = 1 whose first two derivatives vanish at both, and its derivative."""
    left = 1.0 - u
    return u * u * u * (10.0 + u * (-15.0 + 6.0 * u)), 30.0 * u * u * left * left


def nonic_step(u: T) -> tuple[T, T, T, T]:
    """Return the same whose first four derivatives vanish at both ends, and its first three derivatives."""
    left = 1.0 - u
    product = u * left
    # In this form all terms are positive: none is lost near u = 1.
    value = u**5 * (1.0 + left * (5.0 + left * (15.0 + left * (35.0 + 70.0 * left))))
    first, second = 630.0 * product**4, 2520.0 * product**3 * (1.0 - 2.0 * u)
    return value, first, second, 2520.0 * product**2 * (3.0 - 14.0 * product)


@dataclass(frozen=True)
class QuinticSpline:
    """x(t) from `start` to `end` between two times, with zero velocity and acceleration at both (Section 2.3 of the paper).

    The paper's six boundary conditions give x = start + (end - start) (10 u^3 - 15 u^4 + 6 u^5), with u the share of the
    duration. Before and after, x rests at its end points.
    """

    start_time: float
    end_time: float
    start: float
    end: float

    def evaluate(self, t: float) -> tuple[float, float]:
        """Return position and velocity at time `t`."""
        if t <= self.start_time:
            return self.start, 0.0
        if t >= self.end_time:
            return self.end, 0.0
        duration, change = self.end_time - self.start_time, self.end - self.start
        value, rate = quintic_step((t - self.start_time) / duration)
        return self.start + change * value, change / duration * rate

    def acceleration(self, t: float) -> float:
        """Return the acceleration at time `t`."""
        duration = self.end_time - self.start_time
        u = min(max((t - self.start_time) / duration, 0.0), 1.0)
        return (self.end - self.start) / duration**2 * 60.0 * u * (1.0 - u) * (1.0 - 2.0 * u)
