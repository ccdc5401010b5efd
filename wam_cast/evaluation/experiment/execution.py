"""Plans for cups along the line that can be reached, each executed with contact."""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Callable
from contextlib import closing
from functools import partial

import numpy as np

from wam_cast.evaluation.experiment.results import Execution, Trial, maybe_float, to_array
from wam_cast.evaluation.experiment.statistics import describe, wilson_interval
from wam_cast.learning.workers import run_rows
from wam_cast.planning.plan import Method, Plan, Predictor, plan_cast
from wam_cast.scenario import Scenario
from wam_cast.system.outcome import Outcome, Status
from wam_cast.system.simulation import simulate_cast

Report = Callable[[int, int], None]


def execute_plans(
    scenario: Scenario,
    model: Predictor,
    planner: Method,
    n_cups: int,
    *,
    label: str,
    noise_seed: int,
    report: Report,
) -> Execution:
    """Plan for cups evenly over the model's reach and cast each plan once, in `scenario`.

    A plan that is predicted to miss by more than 1 cm is executed all the same, as in the paper.

    Parameters
    ----------
    scenario
        In which plans are executed; its noise, if it has any, is another one for each cup, drawn by `noise_seed`.
    model, planner
        What plans.
    n_cups
        How many.
    label
        What the report calls it.
    report
        Called with the number of casts that are finished, and of all.
    """
    plans = [plan_cast(model, (float(cup), 0.0), planner) for cup in np.linspace(*model.reach, n_cups)]
    trials = []
    report(0, n_cups)
    with closing(run_rows(partial(_execute, scenario, plans, noise_seed), range(n_cups))) as outcomes:
        for plan, outcome in zip(plans, outcomes, strict=True):
            trials.append(make_trial(plan, outcome))
            report(len(trials), n_cups)
    return summarize(label, planner, trials)


def _execute(scenario: Scenario, plans: list[Plan], noise_seed: int, row: int) -> Outcome:
    plan = plans[row]
    return simulate_cast(scenario, plan.cast, plan.cup, noise_seed=noise_seed + row)


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
        executed_miss=None if outcome is None else maybe_float(outcome.miss),
        entry_angle=None if outcome is None else maybe_float(outcome.entry_angle),
        status=(Status.DIVERGED if outcome is None else outcome.status).value,
        limits_hit=() if outcome is None else outcome.limits_hit,
    )


def summarize(label: str, planner: str, trials: list[Trial]) -> Execution:
    """Return the trials with what they come to."""
    n_caught = sum(trial.is_caught for trial in trials)
    failures = Counter(trial.failure for trial in trials if trial.failure is not None)
    return Execution(
        label=label,
        planner=planner,
        n_cups=len(trials),
        n_caught=n_caught,
        hit_rate=n_caught / len(trials),
        hit_interval=wilson_interval(n_caught, len(trials)),
        predicted_miss=describe(to_array(trial.predicted_miss for trial in trials)),
        executed_miss=describe(to_array(trial.executed_miss for trial in trials)),
        failures=dict(sorted(failures.items())),
        trials=tuple(trials),
    )
