"""Casts that were planned for random cups, executed with contact."""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Callable, Sequence
from concurrent.futures import Executor
from contextlib import closing
from dataclasses import dataclass
from functools import partial
from typing import Literal

import numpy as np

from wam_cast.cast import Cast
from wam_cast.casting_plane import from_polar, to_casting_plane, to_polar
from wam_cast.experiments.paper.results import Result, Statistics, maybe_float, to_array
from wam_cast.experiments.statistics import describe, wilson_interval
from wam_cast.parallel.seeds import Purpose, derived_seed
from wam_cast.parallel.workers import Workers, run_rows
from wam_cast.planning.landing_distribution import clear_half_width, clear_offset
from wam_cast.planning.reach import Reach
from wam_cast.scenario import Scenario
from wam_cast.simulation.outcome import Outcome
from wam_cast.simulation.simulator import simulate_cast
from wam_cast.types import Position

Region = Literal["line", "floor"]


@dataclass(frozen=True)
class Trial:
    """A cast, the world (x, y) [m] of the cup that it is for, and what draws its noise."""

    cast: Cast
    cup: Position
    noise_seed: int = 0


class Hits(Result):
    """What became of some trials.

    Attributes
    ----------
    n_cups, n_caught, interval
        Over all trials, with Wilson's 95 % interval of the rate.
    executed_miss
        Distance of the landing from the cup's middle [m], as if nothing were in the way.
    lateral
        By how much the ball landed beside the vertical plane through base axis and cup [m], to either side.
    failures
        How many trials ended in each other status; "lost" if the process did not survive.
    """

    n_cups: int
    n_caught: int
    interval: tuple[float, float]
    executed_miss: Statistics
    lateral: Statistics
    failures: dict[str, int]


def draw_cups(reach: Reach, n_cups: int, seed: int, region: Region = "line") -> list[Position]:
    """Return world (x, y) [m] of cups whose distance from the base axis is uniform over the reach, each from a stream of its own.

    On the line y = 0, or on the floor: at bearings that are uniform over what joint 1 allows. More cups of a seed begin with the
    same ones, and the distances are the same in either region.
    """
    cups = []
    for i in range(n_cups):
        rng = np.random.default_rng(derived_seed(seed, Purpose.CUPS, i))
        radius = float(rng.uniform(reach.nearest, reach.farthest))
        bearing = float(rng.uniform(reach.lowest, reach.highest))
        cups.append((radius, 0.0) if region == "line" else from_polar(radius, bearing))
    return cups


def execute(
    scenario: Scenario,
    trials: Sequence[Trial],
    executor: Executor | Workers,
    report: Callable[[int], object] = lambda _: None,
) -> list[Outcome | None]:
    """Return the outcomes, None where a process was lost; `report` is called with how many are done."""
    outcomes: list[Outcome | None] = []
    with closing(run_rows(partial(_execute, scenario, trials), range(len(trials)), executor)) as results:
        for outcome in results:
            outcomes.append(outcome)
            report(len(outcomes))
    return outcomes


def _execute(scenario: Scenario, trials: Sequence[Trial], row: int) -> Outcome:
    trial = trials[row]
    return simulate_cast(scenario, trial.cast, trial.cup, noise_seed=trial.noise_seed)


def entered_clear(scenario: Scenario, trial: Trial, outcome: Outcome | None) -> bool:
    """Return whether a ball that landed so, and flew on straight, touched no rim: see `clear_half_width`."""
    if outcome is None or not math.isfinite(outcome.entry_angle):
        return False
    along, across = to_casting_plane(outcome.landing - trial.cup, trial.cast.bearing)
    if abs(along) > clear_offset(scenario, outcome.entry_angle):
        return False
    (width,) = clear_half_width(scenario, outcome.entry_angle, np.array([along]))
    return bool(abs(across) <= width)


def summarize(trials: Sequence[Trial], outcomes: Sequence[Outcome | None]) -> Hits:
    """Return what became of the trials."""
    known = [(trial, outcome) for trial, outcome in zip(trials, outcomes, strict=True) if outcome is not None]
    n_caught = sum(outcome.is_caught for _, outcome in known)
    failures = Counter(
        "lost" if outcome is None else outcome.status.value
        for outcome in outcomes
        if outcome is None or not outcome.is_caught
    )
    return Hits(
        n_cups=len(trials),
        n_caught=n_caught,
        interval=wilson_interval(n_caught, len(trials)),
        executed_miss=describe(to_array(maybe_float(outcome.miss) for _, outcome in known)),
        lateral=describe(to_array(maybe_float(_lateral(trial.cup, outcome)) for trial, outcome in known)),
        failures=dict(sorted(failures.items())),
    )


def _lateral(cup: Position, outcome: Outcome) -> float:
    _, bearing = to_polar(cup)
    _, lateral = to_casting_plane(outcome.landing, bearing)
    return abs(lateral)
