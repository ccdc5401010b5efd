"""A robot that only answers casts: where the ball landed, whether the cup caught it, which limits the arm met."""

from __future__ import annotations

from copy import copy
from dataclasses import dataclass
from typing import Literal, Protocol, Self, get_args, runtime_checkable

import numpy as np

from wam_cast.adaptation.robot_distribution import RobotDistribution
from wam_cast.arm.arm_meshes import check_meshes
from wam_cast.cast import Cast
from wam_cast.errors import InputError, checked_integer, checked_std, quoted
from wam_cast.motion.noise_draws import executed_cast
from wam_cast.perception.recorded_cast import observe_cast
from wam_cast.scenario import Noise, Scenario
from wam_cast.simulation.outcome import Outcome
from wam_cast.simulation.simulator import record_cast, simulate_cast
from wam_cast.types import Array, Position, checks_types

Source = Literal["direct", "camera"]
"""From where a landing is known: measured with an error that is given, or seen by the robot's cameras."""

LANDING_STD = 0.002
"""Standard deviation of a landing that is measured directly, in x and in y, by default [m]. Estimate: a mark in sand."""

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
        Where the ball came down through the rim plane, world (x, y) [m], shape (2,), as it was measured; nan if it never did, or
        nobody saw it.
    landing_std
        Standard deviation of the measurement, of each of the two [m]; `LARGEST_STD` of a landing that was not seen.
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
        Of a landing that is measured directly, in x and in y [m].
    observe
        "direct", or "camera": the cameras of `truth` look, two of them if it has none, and what they make of it is the landing,
        with a standard deviation of its own. That takes a few seconds a cast. Of the ball they know what `belief` says.
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
        observe: Source = "direct",
        sees_move: bool = True,
        n_before: int = 0,
    ) -> None:
        if observe not in get_args(Source):
            raise InputError(f"observe = {quoted(observe)} must be one of {', '.join(get_args(Source))}")
        self._truth, self.belief, self._observe = truth, belief or truth, observe
        if observe == "camera":
            check_meshes(truth.arm)
        if observe == "camera" and not truth.cameras.number:
            self._truth = truth.model_copy(update={"cameras": truth.cameras.model_copy(update={"number": 2})})
        self._seed, self.n_casts = checked_integer("seed", seed, 0), checked_integer("n_before", n_before, 0)
        self._landing_std, self._sees_move = checked_std("landing_std", landing_std, LARGEST_STD), sees_move

    @classmethod
    @checks_types
    def draw(
        cls, robots: RobotDistribution, seed: int, *, landing_std: float = LANDING_STD, observe: Source = "direct"
    ) -> Self:
        """Return the robot of a seed, an integer from 0 on, whose controller believes what all are taken for."""
        return cls(robots.draw(seed), robots.believed, seed=seed, landing_std=landing_std, observe=observe)

    def after(self, n_casts: int) -> Self:
        """Return this robot as it is after so many casts."""
        later = copy(self)
        later.n_casts = n_casts
        return later

    def cast(self, cast: Cast, cup: Position | None = None) -> Observation:
        """Simulate a cast, by Drake, and return what was seen. Raises `.InputError` if the arm cannot turn to it."""
        number = [self._seed, self.n_casts, 20261128]
        noise_seed = int(np.random.SeedSequence(number).generate_state(1)[0])
        rng = np.random.default_rng(number)
        outcome, landing, std = self._seen(cast, cup, noise_seed, rng)
        self.n_casts += 1
        made = executed_cast(self._truth.noise, cast, noise_seed).to_array()
        seen = np.maximum(
            made + [MOVE_STD.distance, MOVE_STD.speed, MOVE_STD.wait] * rng.standard_normal(3), [1e-3, 1e-3, 0]
        )
        return Observation(
            cast,
            landing,
            std,
            None if cup is None else outcome.is_caught,
            str(outcome.status),
            outcome.limits_hit,
            Cast.from_array(seen, cast.bearing) if self._sees_move else None,
        )

    def _seen(
        self, cast: Cast, cup: Position | None, noise_seed: int, rng: np.random.Generator
    ) -> tuple[Outcome, Array, float]:
        """Return the outcome of a cast, and where it was seen to land, with the standard deviation [m]."""
        if self._observe == "direct":
            outcome = simulate_cast(self._truth, cast, cup, belief=self.belief, noise_seed=noise_seed)
            return outcome, outcome.landing + self._landing_std * rng.standard_normal(2), self._landing_std
        recording = record_cast(self._truth, cast, cup, belief=self.belief, noise_seed=noise_seed)
        landing = observe_cast(recording, belief=self.belief, noise_seed=noise_seed).landing
        if landing is None:
            return recording.outcome, np.full(2, np.nan), LARGEST_STD
        return recording.outcome, landing.position, min(landing.std, LARGEST_STD)
