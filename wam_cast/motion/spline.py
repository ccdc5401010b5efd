"""QuinticSpline: the paper's smooth step from one value to another."""

from __future__ import annotations

from dataclasses import dataclass


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
        duration = self.end_time - self.start_time
        u = (t - self.start_time) / duration
        change = self.end - self.start
        position = self.start + change * u * u * u * (10.0 + u * (-15.0 + 6.0 * u))
        velocity = change / duration * 30.0 * u * u * (1.0 - u) * (1.0 - u)
        return position, velocity

    def acceleration(self, t: float) -> float:
        """Return the acceleration at time `t`."""
        duration = self.end_time - self.start_time
        u = min(max((t - self.start_time) / duration, 0.0), 1.0)
        return (self.end - self.start) / duration**2 * 60.0 * u * (1.0 - u) * (1.0 - 2.0 * u)
