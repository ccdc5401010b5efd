"""A robot that only answers casts: where the ball landed, whether the cup caught it, which limits the arm met."""

from __future__ import annotations

from copy import copy
from dataclasses import dataclass
from typing import Protocol, Self, runtime_checkable

import numpy as np

from wam_cast.adaptation.robot_distribution import RobotDistribution
from wam_cast.cast import Cast
from wam_cast.errors import checked_integer, checked_std
from wam_cast.motion.noise_draws import executed_cast
from wam_cast.scenario import Noise, Scenario
from wam_cast.simulation.simulator import simulate_cast
from wam_cast.types import Array, Position, checks_types

LANDING_STD = 0.002
"""Standard deviation of an observed landing in x and in y, by default [m]. Estimate: a camera above the cup, or a mark in sand.
Four cameras track a flying ball to 7 mm."""

LARGEST_STD = 1.0
"""Of a measured landing [m]."""

MOVE_STD = Noise(distance=0.001, speed=0.003, wait=0.0015)
"""Standard deviations of a move as the arm's encoders saw it. Estimate: a count of 4,096 a turn is 1.2 mm at the hand, and a stage
begins within a control period."""


@dataclass(frozen=True, eq=False)
class Observation:
    """What is seen of one cast.

    Attributes
    ----------
    cast
        That was made.
    landing
        Where the ball came down through the rim plane, world (x, y) [m], shape (2,), as it was measured; nan if it never did.
    landing_std
        Standard deviation of the measurement, of each of the two [m].
    is_caught
        Whether the ball lies in the cup; None if there was no cup.
    status
        What became of the ball, in a word: a `.Status`.
    limits_hit
        Which limits the arm met, such as `("joint 4 speed",)`.
    executed
        The cast as the arm made it, which is not quite as it was commanded: distance, speed and wait as its encoders saw them, to
        `MOVE_STD`. None where nobody looked; a landing teaches less then.
    """

    cast: Cast
    landing: Array
    landing_std: float
    is_caught: bool | None
    status: str
    limits_hit: tuple[str, ...]
    executed: Cast | None = None


@runtime_checkable
class Robot(Protocol):
    """What casts: a real arm behind its own software, or a simulated one. It never says what it is made of."""

    def cast(self, cast: Cast, cup: Position | None = None) -> Observation:
        """Make a cast, with a cup at world (x, y) [m] or without one, and return what was seen of it."""


class SimulatedRobot:
    """A robot in simulation, whose scenario stays behind it.

    Each cast has noise of its own: that of the scenario, and that of the measurement. A robot with the same seed answers the same
    casts, in the same order, the same.

    Parameters
    ----------
    truth
        The scenario that is simulated.
    belief
        What the robot's controller knows, and whoever plans; by default the truth.
    seed
        Of the noise.
    landing_std
        Of a measured landing, in x and in y [m].
    sees_move
        Whether its encoders tell how the cast was executed.
    n_before
        Casts that it made before, so that the noise of the next one is that of the number after.
    """

    @checks_types
    def __init__(
        self,
        truth: Scenario,
        belief: Scenario | None = None,
        *,
        seed: int = 0,
        landing_std: float = LANDING_STD,
        sees_move: bool = True,
        n_before: int = 0,
    ) -> None:
        self._truth, self.belief = truth, belief or truth
        self._seed, self.n_casts = checked_integer("seed", seed, 0), checked_integer("n_before", n_before, 0)
        self._landing_std, self._sees_move = checked_std("landing_std", landing_std, LARGEST_STD), sees_move

    @classmethod
    @checks_types
    def draw(cls, robots: RobotDistribution, seed: int, *, landing_std: float = LANDING_STD) -> Self:
        """Return the robot of a seed, an integer from 0 on, whose controller believes what all are taken for."""
        return cls(robots.draw(seed), robots.believed, seed=seed, landing_std=landing_std)

    def after(self, n_casts: int) -> Self:
        """Return this robot as it is after so many casts."""
        later = copy(self)
        later.n_casts = n_casts
        return later

    def cast(self, cast: Cast, cup: Position | None = None) -> Observation:
        """Simulate a cast, by Drake, and return what was seen. Raises `.InputError` if the arm cannot turn to it."""
        number = [self._seed, self.n_casts, 20261128]
        noise_seed = int(np.random.SeedSequence(number).generate_state(1)[0])
        outcome = simulate_cast(self._truth, cast, cup, belief=self.belief, noise_seed=noise_seed)
        self.n_casts += 1
        rng = np.random.default_rng(number)
        measured = outcome.landing + self._landing_std * rng.standard_normal(2)
        made = executed_cast(self._truth.noise, cast, noise_seed).to_array()
        seen = np.maximum(
            made + [MOVE_STD.distance, MOVE_STD.speed, MOVE_STD.wait] * rng.standard_normal(3), [1e-3, 1e-3, 0]
        )
        return Observation(
            cast,
            measured,
            self._landing_std,
            None if cup is None else outcome.is_caught,
            str(outcome.status),
            outcome.limits_hit,
            Cast.from_array(seen, cast.bearing) if self._sees_move else None,
        )
