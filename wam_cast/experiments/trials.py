"""Trials: casts for cups, executed with contact; what became of them is one frame, a row a trial.

label, planner          who planned, in the words of the study and by the planner's name ("" where a cast has no plan)
radius, cup_bearing     of the cup about the base axis [m], [rad]
cup_x, cup_y            the same in the world [m]
distance, speed, wait, bearing      the cast [m], [m/s], [s], [rad]
noise_seed              what draws its noise
is_feasible, reason     as of the `.Plan`; like all that is predicted they are missing (False, "", nan) where a cast has no plan
predicted_offset        where the ball is expected, outward from the cup's axis [m]
predicted_miss          its distance from there [m]
std_along, std_across   predictive standard deviation of the landing [m]
rim_clear_probability   of entering the cup without touching its rim
status, is_caught       a value of `.Status`; of one that never came down or diverged what follows is missing
landing_along, landing_across       where the ball came down, in the casting plane's axes [m]
along, lateral          the same from the cup's axis: outward, and to the left as seen from the base axis [m]
miss                    distance of the landing from the cup's axis, as if nothing were in the way [m]
entry_angle             from the vertical [rad]
entered_rim_clear       whether a ball that landed so, and flew on straight, touched no rim
is_slack, slack         of the string from the landing on [m]
peak_torque_utilization, peak_velocity_utilization   largest utilization of a motor's torque and of a joint's velocity limit
limits_hit              which limits the arm met
"""

from __future__ import annotations

import math
from collections.abc import Callable, Generator, Sequence
from concurrent.futures import Executor
from contextlib import closing
from dataclasses import asdict, dataclass
from functools import partial
from typing import Literal

import numpy as np
import pandas as pd

from wam_cast.cast import Cast
from wam_cast.casting_plane import from_polar, to_casting_plane, to_polar
from wam_cast.experiments.frames import Record
from wam_cast.experiments.statistics import wilson_interval
from wam_cast.parallel.seeds import Purpose, derived_seed
from wam_cast.parallel.workers import Workers, run_rows
from wam_cast.planning.landing_distribution import clearance, clearance_across
from wam_cast.planning.plan import Method, Plan, plan_cast
from wam_cast.planning.prediction import Predictor
from wam_cast.planning.reach import Reach
from wam_cast.planning.solution import Planner
from wam_cast.scenario import Scenario
from wam_cast.simulation.outcome import Outcome
from wam_cast.simulation.simulator import simulate_cast
from wam_cast.types import Position

Region = Literal["line", "floor"]

Polar = tuple[float, float]
"""A cup's distance from the base axis [m] and its bearing from the x axis toward y [rad]."""


@dataclass(frozen=True)
class Trial:
    """A cast, the cup that it is for, what draws its noise, and who planned it, with its plan if there is one."""

    cast: Cast
    cup: Polar
    noise_seed: int = 0
    label: str = ""
    plan: Plan | None = None

    @property
    def position(self) -> Position:
        """World (x, y) of the cup's axis [m]."""
        return from_polar(*self.cup)


@dataclass(frozen=True)
class Thrower:
    """Who plans for which cups: a planner with a model, and what a study calls them."""

    label: str
    planner: Method | Planner
    model: Predictor
    cups: Sequence[Polar]


def draw_cups(reach: Reach, n_cups: int, seed: int, region: Region = "line") -> list[Polar]:
    """Return cups whose distance from the base axis is uniform over the reach, each from a stream of its own.

    On the line y = 0, or on the floor: at bearings that are uniform over what joint 1 allows. More cups of a seed begin with the
    same ones, and the distances are the same in either region.
    """
    cups = []
    for i in range(n_cups):
        rng = np.random.default_rng(derived_seed(seed, Purpose.CUPS, i))
        radius = float(rng.uniform(reach.nearest, reach.farthest))
        bearing = float(rng.uniform(reach.lowest, reach.highest))
        cups.append((radius, 0.0 if region == "line" else bearing))
    return cups


def line_of_cups(model: Predictor, n_cups: int) -> list[Polar]:
    """Return cups on the line y = 0, evenly from one end of the model's reach to the other."""
    return [(float(radius), 0.0) for radius in np.linspace(*model.reach, n_cups)]


def plan_and_execute(
    scenario: Scenario,
    throwers: Sequence[Thrower],
    *,
    seed: int = 0,
    executor: Executor | Workers,
    report: Callable[[int, int], object] = lambda *_: None,
) -> pd.DataFrame:
    """Let each thrower plan for each of its cups, cast each plan once, and return the trials, thrower by thrower.

    A plan that is predicted to miss by more than 1 cm is executed all the same, as in the paper. The scenario's noise, if it has
    any, is drawn with `seed`: another one for each cup, and the same one for each thrower. `report` is called with how much is
    done, and how much there is: each cast is planned and executed.
    """
    n_steps = 2 * sum(len(thrower.cups) for thrower in throwers)
    report(0, n_steps)
    trials: list[Trial] = []
    for thrower in throwers:
        for i, cup in enumerate(thrower.cups):
            plan = plan_cast(thrower.model, from_polar(*cup), thrower.planner)
            trials.append(Trial(plan.cast, cup, derived_seed(seed, Purpose.NOISE, i), thrower.label, plan))
            report(len(trials), n_steps)
    return execute(scenario, trials, executor, report=lambda done: report(len(trials) + done, n_steps))


def execute(
    scenario: Scenario,
    trials: Sequence[Trial],
    executor: Executor | Workers | None,
    n_workers: int | None = None,
    *,
    report: Callable[[int], object] = lambda _: None,
) -> pd.DataFrame:
    """Return what became of the trials, in their order; `report` is called with how many are done.

    `executor` and `n_workers` run the casts as for `.run_rows`, and make no difference to what becomes of them.
    """
    rows: list[Record] = []
    with closing(executed_rows(scenario, trials, executor, n_workers)) as executed:
        for row in executed:
            rows.append(row)
            report(len(rows))
    return pd.DataFrame(rows)


def executed_rows(
    scenario: Scenario, trials: Sequence[Trial], executor: Executor | Workers | None, n_workers: int | None = None
) -> Generator[Record]:
    """Yield the rows of `execute`, each as soon as it is known."""
    with closing(run_rows(partial(_execute, scenario, trials), range(len(trials)), executor, n_workers)) as outcomes:
        for trial, outcome in zip(trials, outcomes, strict=True):
            yield trial_row(scenario, trial, outcome)


def _execute(scenario: Scenario, trials: Sequence[Trial], row: int) -> Outcome:
    trial = trials[row]
    return simulate_cast(scenario, trial.cast, trial.position, noise_seed=trial.noise_seed)


def trial_row(scenario: Scenario, trial: Trial, outcome: Outcome) -> Record:
    """Return a row of the frame."""
    return {**planned_row(trial), **_executed(scenario, trial, outcome)}


def planned_row(trial: Trial) -> Record:
    """Return what of a row is known before the cast."""
    x, y = trial.position
    return {
        "label": trial.label,
        "radius": trial.cup[0],
        "cup_bearing": trial.cup[1],
        "cup_x": x,
        "cup_y": y,
        **asdict(trial.cast),
        "noise_seed": trial.noise_seed,
        **(_NO_PLAN if trial.plan is None else _predicted(trial.plan, trial.cup)),
    }


_NO_PLAN: Record = {"planner": "", "is_feasible": False, "reason": ""}
_NO_PLAN |= dict.fromkeys(("predicted_offset", "predicted_miss", "std_along", "std_across"), math.nan)
_NO_PLAN |= {"rim_clear_probability": math.nan}


def _predicted(plan: Plan, cup: Polar) -> Record:
    landing, _ = to_polar((plan.predicted_landing[0], plan.predicted_landing[1]))
    return {
        "planner": plan.method,
        "is_feasible": plan.is_feasible,
        "reason": plan.reason,
        "predicted_offset": landing - cup[0],
        "predicted_miss": plan.predicted_miss,
        "std_along": plan.predicted_std.along,
        "std_across": plan.predicted_std.across,
        "rim_clear_probability": plan.rim_clear_probability,
    }


def _executed(scenario: Scenario, trial: Trial, outcome: Outcome) -> Record:
    radius, bearing = trial.cup
    # In the plane through the cup, from which the casting plane may differ by what the ball was expected to land beside it.
    along, lateral = to_casting_plane(outcome.landing, bearing)
    return {
        "status": outcome.status.value,
        "is_caught": outcome.is_caught,
        "landing_along": outcome.landing_along,
        "landing_across": outcome.landing_across,
        "along": along - radius,
        "lateral": lateral,
        "miss": outcome.miss,
        "entry_angle": outcome.entry_angle,
        "entered_rim_clear": _entered_clear(scenario, trial, outcome),
        "is_slack": outcome.is_slack,
        "slack": outcome.slack,
        "peak_torque_utilization": float(np.max(outcome.peak_torque_utilization)),
        "peak_velocity_utilization": float(np.max(outcome.peak_velocity_utilization)),
        "limits_hit": outcome.limits_hit,
    }


def _entered_clear(scenario: Scenario, trial: Trial, outcome: Outcome) -> bool:
    """Return whether a ball that landed so, and flew on straight, touched no rim: see `.clearance_across`."""
    if not math.isfinite(outcome.entry_angle):
        return False
    along, across = to_casting_plane(outcome.landing - trial.position, trial.cast.bearing)
    if abs(along) > clearance(scenario, outcome.entry_angle):
        return False
    (width,) = clearance_across(scenario, outcome.entry_angle, np.array([along]))
    return bool(abs(across) <= width)


def hits(trials: pd.DataFrame) -> Record:
    """Return how many of some trials were caught: `n_cups`, `n_caught`, `hit_rate` and its `hit_interval` (Wilson's, 95 %)."""
    n_caught, n_cups = int(trials["is_caught"].sum()), len(trials)
    return {
        "n_cups": n_cups,
        "n_caught": n_caught,
        "hit_rate": n_caught / n_cups,
        "hit_interval": wilson_interval(n_caught, n_cups),
    }


def failures(trials: pd.DataFrame) -> dict[str, int]:
    """Return how many of the trials ended in each status but caught, of those that occurred, by name."""
    return dict(sorted(count_statuses(trials.loc[~trials["is_caught"], "status"]).items()))


def count_statuses(statuses: pd.Series[str]) -> dict[str, int]:
    """Return how many casts ended in each status, by name, the most frequent first."""
    return {str(status): int(n) for status, n in statuses.value_counts().items()}
