"""A map of the floor: plans for cups all over the reachable region, each executed with contact.

The casting plane turns about the base axis, so that what is predicted depends on a cup's radius alone, its distance from that
axis: there is a plan for each radius, turned to each bearing. What is executed is measured at every bearing, beside the casting
plane too.
"""

from __future__ import annotations

import hashlib
import json
from collections.abc import Callable, Sequence
from concurrent.futures import Executor
from contextlib import closing, nullcontext
from dataclasses import asdict, dataclass, replace
from functools import cached_property, partial
from itertools import islice
from pathlib import Path

import numpy as np
import pandas as pd

from wam_cast.errors import InputError, checked_integer
from wam_cast.experiments.frames import Record, Rows, records, to_plain
from wam_cast.experiments.trials import Trial, executed_rows, hits, planned_row
from wam_cast.parallel.seeds import Purpose, derived_seed
from wam_cast.parallel.workers import Workers, checked_n_workers
from wam_cast.planning.plan import Method, Plan, plan_cast
from wam_cast.planning.prediction import Predictor
from wam_cast.planning.reach import Reach
from wam_cast.planning.solution import Planner, Solver
from wam_cast.scenario import Scenario
from wam_cast.storage.manifest import current_versions
from wam_cast.storage.run_directory import RunDirectory
from wam_cast.types import checks_types

OnProgress = Callable[[str, int, int], None]
"""Takes what is being done, how much of it is done, and how much there is."""

MOST_CASTS = 100_000
"""Of a map."""

CASTS_PER_PART = 10
"""That are kept together: few enough that an interrupted map loses little."""


class UnfinishedMap(RunDirectory):
    """The directory of a map that is not finished: its casts, part by part."""

    kind = "map of the floor"


@dataclass(frozen=True)
class MapSize:
    """How many radii and bearings, each evenly from one end of the region to the other, and how many casts for each cup.

    Casts for the same cup differ in their noise; without noise one says all.

    Raises
    ------
    InputError
        If they are no integers, less than 2, 2 and 1, or together more than 100,000 casts.
    """

    n_radii: int = 12
    n_bearings: int = 9
    n_casts: int = 1

    def __post_init__(self) -> None:
        checked_integer("n_radii", self.n_radii, 2)
        checked_integer("n_bearings", self.n_bearings, 2)
        checked_integer("n_casts", self.n_casts, 1)
        n = self.n_radii * self.n_bearings * self.n_casts
        if n > MOST_CASTS:
            raise InputError(f"n_radii x n_bearings x n_casts = {n} casts would take days; choose {MOST_CASTS} at most")


@dataclass(frozen=True, eq=False)
class FloorMap:
    """The map.

    Attributes
    ----------
    radii, bearings
        Between which the region lies [m], [rad].
    is_noisy, planner, seed
        How it was made.
    casts
        All trials, radius by radius from the inside out; for the columns see the module `trials`.
    """

    radii: tuple[float, float]
    bearings: tuple[float, float]
    is_noisy: bool
    planner: str
    seed: int
    casts: pd.DataFrame

    @cached_property
    def rings(self) -> pd.DataFrame:
        """A row for the cups at each radius.

        radius [m]; distance, speed, wait       of the cast [m], [m/s], [s]
        predicted_along         where the ball is expected, counted from the cup's axis outward [m]
        predicted_miss, predicted_std, rim_clear_probability, is_feasible, reason      as of a `.Plan`
        along, lateral          what is executed: mean and std [m] over all casts that came down, None if none did
        n_casts, n_caught, hit_rate, hit_interval       how many were caught, with Wilson's 95 % interval of the rate
        """
        return pd.DataFrame([_ring(casts) for _, casts in self.casts.groupby("radius")])

    @property
    def n_caught(self) -> int:
        """How many of all casts were caught."""
        return int(self.casts["is_caught"].sum())

    def record(self) -> Record:
        """Return the whole map as JSON knows it: its rings, each with its casts."""
        rings, names = records(self.rings), ["bearing", "noise_seed", "status", "along", "lateral", "miss"]
        casts = self.casts.drop(columns="bearing").rename(columns={"cup_bearing": "bearing"})
        for ring, (_, group) in zip(rings, casts.groupby("radius"), strict=True):
            ring["casts"] = records(group[names])
        content = {
            "radii": self.radii,
            "bearings": self.bearings,
            "is_noisy": self.is_noisy,
            "planner": self.planner,
            "seed": self.seed,
            "n_casts": len(self.casts),
            "n_caught": self.n_caught,
            "rings": rings,
        }
        plain: Record = to_plain(content)
        return plain


@checks_types
def map_floor(
    model: Predictor,
    size: MapSize | None = None,
    *,
    method: Method | Planner = "program",
    solver: Solver | None = None,
    seed: int = 0,
    executor: Executor | Workers | None = None,
    n_workers: int | None = None,
    directory: str | Path | None = None,
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
        As for `.plan_cast`.
    seed
        Draws the scenario's noise; every cast has its own.
    executor, n_workers
        Run the casts, see `.run_rows`; they make no difference to the map.
    directory
        Where finished casts are kept, ten by ten. A map that was interrupted goes on there, if its plans are the same. By default
        they are kept in memory only.
    on_progress
        Called as plans and casts are done.

    Raises
    ------
    InputError
        If there is no such method or solver, the seed is no integer from 0 on, or the directory holds something else, is in use
        or cannot be written.
    """
    size, reach, scenario = size or MapSize(), Reach.of(model), model.scenario
    seed = checked_integer("seed", seed, 0)
    checked_n_workers(n_workers)
    plans: list[Plan] = []
    for radius in np.linspace(reach.nearest, reach.farthest, size.n_radii):
        plans.append(plan_cast(model, (float(radius), 0.0), method, solver))
        on_progress("planning", len(plans), size.n_radii)
    bearings = np.linspace(reach.lowest, reach.highest, size.n_bearings)
    n_repeats = size.n_casts if scenario.noise.is_on else 1
    turned = [(plan, float(bearing)) for plan in plans for bearing in bearings for _ in range(n_repeats)]
    trials = [_trial(*pair, derived_seed(seed, Purpose.MAP, row)) for row, pair in enumerate(turned)]
    store = None if directory is None else UnfinishedMap(directory, _identity(scenario, trials, size, seed), scenario)
    with store or nullcontext():
        casts = _execute(scenario, trials, store, executor, n_workers, partial(on_progress, "casting"))
    return FloorMap(
        radii=(reach.nearest, reach.farthest),
        bearings=(reach.lowest, reach.highest),
        is_noisy=scenario.noise.is_on,
        planner=plans[0].method,
        seed=seed,
        casts=casts,
    )


def _execute(
    scenario: Scenario,
    trials: Sequence[Trial],
    store: UnfinishedMap | None,
    executor: Executor | Workers | None,
    n_workers: int | None,
    report: Callable[[int, int], object],
) -> pd.DataFrame:
    """Return what became of the trials; those that are stored are not executed again, the others are stored."""
    parts = [trials[start : start + CASTS_PER_PART] for start in range(0, len(trials), CASTS_PER_PART)]
    kept = [None if store is None else store.found(f"casts-{i:05d}", Rows) for i in range(len(parts))]
    todo = [trial for part, frame in zip(parts, kept, strict=True) if frame is None for trial in part]
    n_kept = len(trials) - len(todo)
    report(n_kept, len(trials))
    with closing(executed_rows(scenario, todo, executor, n_workers)) as executed:
        numbered = enumerate(executed, n_kept + 1)
        for i, part in enumerate(parts):
            if kept[i] is None:
                rows = []
                for done, row in islice(numbered, len(part)):
                    rows.append(row)
                    report(done, len(trials))
                kept[i] = pd.DataFrame(rows)
                if store is not None:
                    store.keep(f"casts-{i:05d}", Rows, kept[i])
    casts = pd.DataFrame([row for frame in kept if frame is not None for row in records(frame)])
    casts["limits_hit"] = casts["limits_hit"].map(tuple)  # lists, where they come from a file
    return casts


def _identity(scenario: Scenario, trials: Sequence[Trial], size: MapSize, seed: int) -> Record:
    """Return what must be the same for a map to go on: all that its casts and their predictions depend on."""
    planned = json.dumps([planned_row(trial) for trial in trials], default=float)
    return {
        "scenario": scenario.model_dump(mode="json"),
        "fingerprint": scenario.fingerprint,
        **asdict(size),
        "seed": seed,
        "planner": None if trials[0].plan is None else trials[0].plan.method,
        "model or solver": hashlib.sha256(planned.encode()).hexdigest()[:16],
        "versions": current_versions(),
    }


def _trial(plan: Plan, bearing: float, noise_seed: int) -> Trial:
    """Return the trial of a plan for a cup on the x axis that is turned to a bearing [rad]."""
    cast = replace(plan.cast, bearing=plan.cast.bearing + bearing)
    return Trial(cast, (plan.cup[0], bearing), noise_seed, plan=plan)


def _ring(casts: pd.DataFrame) -> Record:
    one, caught = casts.iloc[0], hits(casts)
    return {
        **{name: one[name] for name in ("radius", "distance", "speed", "wait")},
        "predicted_along": one["predicted_offset"],
        "predicted_miss": one["predicted_miss"],
        "predicted_std": (one["std_along"], one["std_across"]),
        "rim_clear_probability": one["rim_clear_probability"],
        "is_feasible": one["is_feasible"],
        "reason": one["reason"],
        "along": _scatter(casts["along"]),
        "lateral": _scatter(casts["lateral"]),
        "n_casts": caught.pop("n_cups"),
        **caught,
    }


def _scatter(offsets: pd.Series[float]) -> dict[str, float | None]:
    """Return mean and standard deviation [m] of the offsets that exist."""
    known = offsets.dropna().to_numpy()
    return {"mean": float(np.mean(known)), "std": float(np.std(known))} if len(known) else {"mean": None, "std": None}
