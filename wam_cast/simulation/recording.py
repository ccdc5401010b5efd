"""What is thrown and what is kept of it: Throw and CastRecording."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from wam_cast.cast import Cast, checked_cup
from wam_cast.scenario import Scenario
from wam_cast.simulation.outcome import Outcome
from wam_cast.types import Array, Position, checks_types


@checks_types
@dataclass(frozen=True)
class Throw:
    """One of the casts that follow each other: the cast, and world (x, y) [m] of the axis of the cup that it is for.

    Raises
    ------
    InputError
        If it is no cast, or the cup is not a pair of finite numbers.
    """

    cast: Cast
    cup: Position

    def __post_init__(self) -> None:
        checked_cup(self.cup)


@dataclass(frozen=True, eq=False)
class CastRecording:
    """One cast from the start of its turn to the end of the return (without a cup: to the landing), a sample per control period.

    Attributes
    ----------
    cast
        As commanded; under noise another one is executed, which `p_WE_desired` and `stages` show.
    outcome
        Judged at the end of the hold at the latest, before the return moves the ball.
    times
        From the start of the turn [s], shape (n,).
    states
        Positions and velocities of the plant, shape (n, n_x): what `station.plant` takes.
    torques
        Of the motors [N m], shape (n, 7): what was held up to each time; at the first, what the controller wants there.
    p_WL, v_WL, p_WE, p_WE_desired
        Ball, hand and the hand's reference in the world frame [m, m/s], each of shape (n, 3). The reference is what the
        controller says by `hand_desired`; nan if it does not.
    stages
        `.Stage` of each sample, shape (n,).
    """

    scenario: Scenario
    cast: Cast
    cup: Position | None
    outcome: Outcome
    times: Array
    states: Array
    torques: Array
    p_WL: Array
    v_WL: Array
    p_WE: Array
    p_WE_desired: Array
    stages: NDArray[np.int_]
