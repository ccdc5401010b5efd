"""Plans for cups along the line that can be reached, each executed with contact."""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Sequence
from concurrent.futures import Executor
from contextlib import closing
from dataclasses import dataclass
from functools import partial

import numpy as np

from wam_cast.experiments.paper.results import Execution, Trial, maybe_float, to_array
from wam_cast.experiments.paper.settings import OnProgress
from wam_cast.experiments.statistics import describe, wilson_interval
from wam_cast.parallel.seeds import Purpose, derived_seed
from wam_cast.parallel.workers import Workers, run_rows
from wam_cast.planning.plan import Method, Plan, plan_cast
from wam_cast.planning.prediction import Predictor
from wam_cast.scenario import Scenario
from wam_cast.simulation.outcome import Outcome, Status
from wam_cast.simulation.simulator import simulate_cast


@dataclass(frozen=True)
class Thrower:
    """Who plans: a planner with a model, and what the report calls them."""

    label: str
    planner: Method
    model: Predictor


def execute_plans(
    scenario: Scenario,
    throwers: Sequence[Thrower],
    n_cups: int,
    *,
    seed: int = 0,
    executor: Executor | Workers,
    report: OnProgress,
) -> tuple[Execution, ...]:
    """Plan for cups evenly over the model's reach and cast each plan once, for each of the throwers.

    A plan that is predicted to miss by more than 1 cm is executed all the same, as in the paper.

    Parameters
    ----------
    scenario
        In which plans are executed; its noise, if it has any, is another one for each cup, and the same one for each thrower.
    throwers
        Who plans.
    n_cups
        How many cups.
    seed
        Draws the noise.
    executor
        Runs the casts.
    report
        Called with how much is done, and how much there is: each cast is planned and executed.
    """
    n_steps = 2 * len(throwers) * n_cups
    report(0, n_steps)
    plans: list[Plan] = []
    for thrower in throwers:
        for cup in np.linspace(*thrower.model.reach, n_cups):
            plans.append(plan_cast(thrower.model, (float(cup), 0.0), thrower.planner))
            report(len(plans), n_steps)
    jobs = [(plan, derived_seed(seed, Purpose.NOISE, i % n_cups)) for i, plan in enumerate(plans)]
    trials: list[Trial] = []
    with closing(run_rows(partial(_execute, scenario, jobs), range(len(jobs)), executor)) as outcomes:
        for plan, outcome in zip(plans, outcomes, strict=True):
            trials.append(make_trial(plan, outcome))
            report(len(plans) + len(trials), n_steps)
    return tuple(
        summarize(
            thrower.label, thrower.planner, clear_radius(scenario), trials[i * n_cups : (i + 1) * n_cups]
        )
        for i, thrower in enumerate(throwers)
    )


def _execute(scenario: Scenario, jobs: list[tuple[Plan, int]], row: int) -> Outcome:
    plan, noise_seed = jobs[row]
    return simulate_cast(scenario, plan.cast, plan.cup, noise_seed=noise_seed)


def make_trial(plan: Plan, outcome: Outcome | None) -> Trial:
    """Return what became of a plan; without an outcome its simulation has brought down its process."""
    radius = math.hypot(*plan.cup)
    along = math.nan if outcome is None else outcome.landing_along
    return Trial(
        cup=radius,
        distance=plan.cast.distance,
        speed=plan.cast.speed,
        wait=plan.cast.wait,
        is_feasible=plan.is_feasible,
        predicted_offset=float(np.linalg.norm(plan.predicted_landing)) - radius,
        predicted_miss=plan.predicted_miss,
        executed_offset=maybe_float(along - radius),
        executed_across=None if outcome is None else maybe_float(outcome.landing_across),
        executed_miss=None if outcome is None else maybe_float(outcome.miss),
        entry_angle=None if outcome is None else maybe_float(outcome.entry_angle),
        status=(Status.DIVERGED if outcome is None else outcome.status).value,
        limits_hit=() if outcome is None else outcome.limits_hit,
    )


def clear_radius(scenario: Scenario) -> float:
    """Return how far from the cup's middle a ball that falls straight down passes the rim without touching it [m]."""
    return scenario.cup.inner_radius - scenario.ball.radius


def summarize(label: str, planner: str, clear: float, trials: list[Trial]) -> Execution:
    """Return the trials with what they come to; `clear` is the `clear_radius` of their scenario."""
    caught = [trial for trial in trials if trial.is_caught]
    failures = Counter(trial.failure for trial in trials if trial.failure is not None)
    return Execution(
        label=label,
        planner=planner,
        n_cups=len(trials),
        n_caught=len(caught),
        hit_rate=len(caught) / len(trials),
        hit_interval=wilson_interval(len(caught), len(trials)),
        predicted_miss=describe(to_array(trial.predicted_miss for trial in trials)),
        executed_miss=describe(to_array(trial.executed_miss for trial in trials)),
        failures=dict(sorted(failures.items())),
        n_no_plan=sum(not trial.is_feasible for trial in trials),
        n_no_plan_caught=sum(not trial.is_feasible for trial in caught),
        n_touched=sum((trial.executed_miss or 0.0) > clear for trial in caught),
        trials=tuple(trials),
    )
