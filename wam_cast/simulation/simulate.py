"""Simulate one cast, or several after each other, in simulators that this process keeps."""

from __future__ import annotations

import threading
from collections.abc import Callable, Sequence
from functools import lru_cache

from wam_cast.cast import Cast
from wam_cast.errors import InputError
from wam_cast.scenario import Scenario
from wam_cast.simulation.outcome import Outcome
from wam_cast.simulation.recording import Throw
from wam_cast.simulation.simulator import CastSimulator


@lru_cache(maxsize=4)
def _shared_simulator(scenario: Scenario) -> CastSimulator:
    """Return the simulator of `scenario` that this process keeps."""
    return CastSimulator(scenario)


_one_at_a_time = threading.RLock()  # whoever is told of an outcome may simulate something else


def simulate_cast(
    scenario: Scenario, cast: Cast, cup: tuple[float, float] | None = None, *, noise_seed: int = 0
) -> Outcome:
    """Simulate one cast, in a simulator that is kept for the next ones.

    Threads take turns, since Drake's Python systems are not made for several at once; use processes to go faster.

    Parameters
    ----------
    scenario, cast
        What is cast, and how.
    cup
        World (x, y) [m] of a physical cup's axis; without one the simulation ends when the ball has crossed the rim plane.
    noise_seed
        Draws the scenario's noise: the same seed gives the same outcome. Without noise it is of no consequence.

    Raises
    ------
    InputError
        If the cup's position is not a pair of finite numbers, the noise seed not a whole number from 0 on, or the arm cannot turn
        to the cast's bearing.
    """
    with _one_at_a_time:
        return _shared_simulator(scenario).simulate(cast, cup, noise_seed=noise_seed)


def simulate_casts(
    scenario: Scenario,
    casts: Sequence[Cast],
    cups: Sequence[tuple[float, float]],
    *,
    noise_seed: int = 0,
    on_outcome: Callable[[Outcome], None] | None = None,
) -> list[Outcome]:
    """Simulate casts after each other in one go, each into its cup: cast, lift the ball out, return, turn, and cast again.

    See `CastSimulator.simulate_sequence`; threads take turns as for `simulate_cast`.

    Parameters
    ----------
    scenario
        What is fixed.
    casts, cups
        What is cast in turn, and world (x, y) [m] of each one's cup; as many of the one as of the other.
    noise_seed
        Draws the scenario's noise of the first cast, `noise_seed + 1` that of the second, and so on.
    on_outcome
        Called with each outcome as soon as it is known, or none.

    Raises
    ------
    InputError
        As `simulate_cast` does, and if the numbers of casts and cups differ.
    """
    if len(casts) != len(cups):
        raise InputError(f"casts, cups: {len(casts)} casts for {len(cups)} cups; give each cast its cup")
    throws = [Throw(cast, cup) for cast, cup in zip(casts, cups, strict=True)]
    with _one_at_a_time:
        simulator = _shared_simulator(scenario)
        return simulator.simulate_sequence(throws, noise_seed=noise_seed, on_outcome=on_outcome)
