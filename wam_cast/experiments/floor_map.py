"""A map of the floor: plans for cups all over the reachable region, each executed with contact.

The casting plane turns about the base axis, so that what is predicted depends on a cup's radius alone, its distance from that
axis: there is a plan for each radius, turned to each bearing. What is executed is measured at every bearing, beside the casting
plane too.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from concurrent.futures import Executor
from contextlib import closing
from dataclasses import dataclass, replace
from functools import partial

import numpy as np

from wam_cast.casting_plane import from_polar, to_casting_plane, to_polar
from wam_cast.errors import checked_whole_number
from wam_cast.experiments.paper.results import Result, maybe_float, to_array
from wam_cast.experiments.statistics import wilson_interval
from wam_cast.parallel.seeds import Purpose, derived_seed
from wam_cast.parallel.workers import Workers, run_rows
from wam_cast.planning.plan import Method, Plan, plan_cast
from wam_cast.planning.prediction import Predictor
from wam_cast.planning.reach import Reach
from wam_cast.planning.solution import Solver
from wam_cast.scenario import Scenario
from wam_cast.simulation.outcome import Outcome, Status
from wam_cast.simulation.simulator import simulate_cast

OnProgress = Callable[[str, int, int], None]
"""Takes what is being done, how much of it is done, and how much there is."""


@dataclass(frozen=True)
class MapSize:
    """How many radii and bearings, each evenly from one end of the region to the other, and how many casts for each cup.

    Casts for the same cup differ in their noise; without noise one says all.

    Raises
    ------
    InputError
        If they are no whole numbers, or less than 2, 2 and 1.
    """

    n_radii: int = 12
    n_bearings: int = 9
    n_casts: int = 1

    def __post_init__(self) -> None:
        checked_whole_number("n_radii", self.n_radii, 2)
        checked_whole_number("n_bearings", self.n_bearings, 2)
        checked_whole_number("n_casts", self.n_casts, 1)


class MappedCast(Result):
    """An executed cast for a cup at a bearing from the x axis toward y [rad].

    `along` and `lateral` are where the ball came down, counted from the cup's axis: outward from the base axis, and to the left as
    seen from there [m]; like `miss`, the distance, None if it never came down.
    """

    bearing: float
    noise_seed: int
    status: str
    along: float | None
    lateral: float | None
    miss: float | None

    @property
    def is_caught(self) -> bool:
        """Whether the ball rests in the cup."""
        return self.status == Status.CAUGHT


class Scatter(Result):
    """Mean and standard deviation of several offsets [m], None if there are none."""

    mean: float | None
    std: float | None


class Ring(Result):
    """Cups at one radius: what is predicted for all of them, and what became of the casts.

    Attributes
    ----------
    radius
        Of the cups, from the base axis [m].
    distance, speed, wait
        Of the cast [m], [m/s], [s].
    predicted_along
        Where the ball is expected, counted from the cup's axis outward [m].
    predicted_miss, predicted_spread, clear_entry_probability, is_feasible
        As of a `Plan`.
    along, lateral
        What is executed, over all casts that came down.
    hit_rate, hit_interval
        Share of caught balls with Wilson's 95 % interval.
    """

    radius: float
    distance: float
    speed: float
    wait: float
    predicted_along: float
    predicted_miss: float
    predicted_spread: tuple[float, float]
    clear_entry_probability: float
    is_feasible: bool
    along: Scatter
    lateral: Scatter
    n_casts: int
    n_caught: int
    hit_rate: float
    hit_interval: tuple[float, float]
    casts: tuple[MappedCast, ...]


class FloorMap(Result):
    """The map: the region between two radii [m] and two bearings [rad], and its rings from the inside out."""

    radii: tuple[float, float]
    bearings: tuple[float, float]
    is_noisy: bool
    planner: str
    seed: int
    n_casts: int
    n_caught: int
    rings: tuple[Ring, ...]


@dataclass(frozen=True)
class _Job:
    """A plan turned to a bearing [rad], and what draws its noise."""

    plan: Plan
    bearing: float
    noise_seed: int


def map_floor(
    model: Predictor,
    size: MapSize | None = None,
    *,
    method: Method = "program",
    solver: Solver | None = None,
    seed: int = 0,
    executor: Executor | Workers | None = None,
    n_workers: int | None = None,
    on_progress: OnProgress = lambda *_: None,
) -> FloorMap:
    """Plan and execute casts for cups all over the region that the model reaches, in its scenario.

    Parameters
    ----------
    model
        A forward model.
    size
        How many cups and casts.
    method, solver
        As for `plan_cast`.
    seed
        Draws the scenario's noise; every cast has its own.
    executor, n_workers
        Run the casts, see `run_rows`; they make no difference to the map. A cast that brings down its process counts as diverged.
    on_progress
        Called as plans and casts are done.

    Raises
    ------
    InputError
        If there is no such method or solver, or the seed is no whole number from 0 on.
    """
    size, reach, scenario = size or MapSize(), Reach.of(model), model.scenario
    seed = checked_whole_number("seed", seed, 0)
    plans: list[Plan] = []
    for radius in np.linspace(reach.nearest, reach.farthest, size.n_radii):
        plans.append(plan_cast(model, (float(radius), 0.0), method, solver))
        on_progress("planning", len(plans), size.n_radii)
    bearings = np.linspace(reach.lowest, reach.highest, size.n_bearings)
    n_repeats = size.n_casts if scenario.noise.is_on else 1
    turned = [(plan, float(bearing)) for plan in plans for bearing in bearings for _ in range(n_repeats)]
    jobs = [_Job(*pair, derived_seed(seed, Purpose.MAP, row)) for row, pair in enumerate(turned)]
    casts: list[MappedCast] = []
    with closing(run_rows(partial(_execute, scenario, jobs), range(len(jobs)), executor, n_workers)) as done:
        on_progress("casting", 0, len(jobs))
        for job, outcome in zip(jobs, done, strict=True):
            casts.append(_mapped(job, outcome))
            on_progress("casting", len(casts), len(jobs))
    n_each = len(jobs) // len(plans)
    rings = [make_ring(plan, casts[i * n_each : (i + 1) * n_each]) for i, plan in enumerate(plans)]
    return FloorMap(
        radii=(reach.nearest, reach.farthest),
        bearings=(reach.lowest, reach.highest),
        is_noisy=scenario.noise.is_on,
        planner=method,
        seed=seed,
        n_casts=len(casts),
        n_caught=sum(ring.n_caught for ring in rings),
        rings=tuple(rings),
    )


def _execute(scenario: Scenario, jobs: Sequence[_Job], row: int) -> Outcome:
    job = jobs[row]
    cast = replace(job.plan.cast, bearing=job.plan.cast.bearing + job.bearing)
    cup = from_polar(job.plan.cup[0], job.bearing)
    return simulate_cast(scenario, cast, cup, noise_seed=job.noise_seed)


def _mapped(job: _Job, outcome: Outcome | None) -> MappedCast:
    """Return what became of a cast; without an outcome its simulation has brought down its process."""
    landing = np.full(2, math.nan) if outcome is None else outcome.landing
    # In the plane through the cup, from which the casting plane may differ by what the ball was expected to land beside it.
    along, lateral = to_casting_plane(landing, job.bearing)
    return MappedCast(
        bearing=job.bearing,
        noise_seed=job.noise_seed,
        status=(Status.DIVERGED if outcome is None else outcome.status).value,
        along=maybe_float(along - job.plan.cup[0]),
        lateral=maybe_float(lateral),
        miss=None if outcome is None else maybe_float(outcome.miss),
    )


def make_ring(plan: Plan, casts: Sequence[MappedCast]) -> Ring:
    """Return a plan for a cup on the x axis, with what became of it at all bearings."""
    radius, n_caught = plan.cup[0], sum(cast.is_caught for cast in casts)
    return Ring(
        radius=radius,
        distance=plan.cast.distance,
        speed=plan.cast.speed,
        wait=plan.cast.wait,
        predicted_along=to_polar((plan.predicted_landing[0], plan.predicted_landing[1]))[0] - radius,
        predicted_miss=plan.predicted_miss,
        predicted_spread=plan.predicted_spread,
        clear_entry_probability=plan.clear_entry_probability,
        is_feasible=plan.is_feasible,
        along=_scatter([cast.along for cast in casts]),
        lateral=_scatter([cast.lateral for cast in casts]),
        n_casts=len(casts),
        n_caught=n_caught,
        hit_rate=n_caught / len(casts),
        hit_interval=wilson_interval(n_caught, len(casts)),
        casts=tuple(casts),
    )


def _scatter(offsets: Sequence[float | None]) -> Scatter:
    known = to_array(offset for offset in offsets if offset is not None)
    if len(known) == 0:
        return Scatter(mean=None, std=None)
    return Scatter(mean=float(np.mean(known)), std=float(np.std(known)))
