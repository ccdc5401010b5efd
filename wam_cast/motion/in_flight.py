"""InFlight: a robot in the middle of a cast, told by one engine for another one to go on with."""

from __future__ import annotations

from dataclasses import dataclass

from wam_cast.types import Array


@dataclass(frozen=True, eq=False)
class InFlight:
    """A robot at the end of a control period.

    Attributes
    ----------
    time
        From the start of the turn [s].
    q, v
        Angles [rad] and speeds [rad/s] of the arm's joints and the string's, shape (n,) each, as the plant has them.
    waiting
        Commanded torques on their way to the motors, the newest first [N m], shape (`Controller.delay`, 7); of no meaning
        without a delay.
    torque
        Of the motors, held up to there [N m], shape (7,).
    """

    time: float
    q: Array
    v: Array
    waiting: Array
    torque: Array
