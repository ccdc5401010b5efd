"""What each term of the program is for: plans without it, executed."""

from __future__ import annotations

import math
from concurrent.futures import Executor
from contextlib import closing
from functools import partial

import numpy as np

from wam_cast.cast import Cast
from wam_cast.evaluation.experiment.results import Result, Statistics, to_array
from wam_cast.evaluation.experiment.seeds import Purpose, derived_seed
from wam_cast.evaluation.experiment.settings import OnProgress
from wam_cast.evaluation.experiment.statistics import describe, wilson_interval
from wam_cast.evaluation.planners.study import draw_cups
from wam_cast.learning.workers import Workers, run_rows
from wam_cast.planning.chance import clear_offsets
from wam_cast.planning.predictor import Predictor
from wam_cast.planning.program import TERMS, Term, plan_by_program
from wam_cast.scenario import Scenario
from wam_cast.system.outcome import Outcome
from wam_cast.system.simulation import simulate_cast

VARIANTS: tuple[tuple[Term, ...], ...] = ((), *((term,) for term in TERMS), TERMS)
"""What is left out: nothing, each term alone, and all of them."""


class Ablation(Result):
    """The program without some of its terms, over random cups.

    Attributes
    ----------
    without
        What was left out.
    n_cups, n_caught, hit_interval
        Over all cups, with Wilson's 95 % interval of the rate.
    n_clear, clear_interval
        How many balls entered so that they could not touch the rim.
    n_limit_hits
        How many casts met a limit of the arm.
    n_taut
        How many landed with a taut string.
    executed_miss
        Of the cup's middle [m].
    least_slack
        Of the string from the landing on, the 5th percentile [m].
    largest_share
        Of a motor's torque or a joint's speed limit, the 95th percentile.
    """

    without: tuple[str, ...]
    n_cups: int
    n_caught: int
    hit_interval: tuple[float, float]
    n_clear: int
    clear_interval: tuple[float, float]
    n_limit_hits: int
    n_taut: int
    executed_miss: Statistics
    least_slack: float
    largest_share: float


def ablate(
    model: Predictor, n_cups: int, *, seed: int = 0, executor: Executor | Workers, report: OnProgress
) -> tuple[Ablation, ...]:
    """Return what becomes of plans without each of the program's terms, over the same random cups and the same noise.

    Parameters
    ----------
    model
        What is planned with, and in whose scenario plans are executed; must pickle.
    n_cups
        How many cups, uniformly over the model's reach.
    seed
        Draws the cups and the noise.
    executor
        Runs one cup a row.
    report
        Called with how many rows are done, and how many there are.
    """
    cups = draw_cups(model.reach, n_cups, seed)
    rows = range(len(VARIANTS) * n_cups)
    report(0, len(rows))
    outcomes: list[Outcome | None] = []
    with closing(run_rows(partial(_attempt, model, cups, seed), rows, executor)) as results:
        for outcome in results:
            outcomes.append(outcome)
            report(len(outcomes), len(rows))
    return tuple(
        _summarize(model.scenario, cups, without, outcomes[i * n_cups : (i + 1) * n_cups])
        for i, without in enumerate(VARIANTS)
    )


def _attempt(model: Predictor, cups: list[float], seed: int, row: int) -> Outcome:
    variant, i = divmod(row, len(cups))
    solution = plan_by_program(model, cups[i], without=VARIANTS[variant])
    noise_seed = derived_seed(seed, Purpose.NOISE, i)
    return simulate_cast(
        model.scenario, Cast.from_array(solution.parameters), (cups[i], 0.0), noise_seed=noise_seed
    )


def _summarize(
    scenario: Scenario, cups: list[float], without: tuple[str, ...], outcomes: list[Outcome | None]
) -> Ablation:
    known = [outcome for outcome in outcomes if outcome is not None]
    n, caught = len(cups), sum(outcome.is_caught for outcome in known)
    clear = sum(
        _is_clear(scenario, cup, outcome)
        for cup, outcome in zip(cups, outcomes, strict=True)
        if outcome is not None
    )
    shares = [max(outcome.peak_load.max(), outcome.peak_speed.max()) for outcome in known]
    return Ablation(
        without=without,
        n_cups=n,
        n_caught=caught,
        hit_interval=wilson_interval(caught, n),
        n_clear=clear,
        clear_interval=wilson_interval(clear, n),
        n_limit_hits=sum(bool(outcome.limits_hit) for outcome in known),
        n_taut=sum(not outcome.is_slack for outcome in known),
        executed_miss=describe(to_array(outcome.miss for outcome in known)),
        least_slack=float(np.nanpercentile([outcome.slack for outcome in known], 5)),
        largest_share=float(np.percentile(shares, 95)),
    )


def _is_clear(scenario: Scenario, cup: float, outcome: Outcome) -> bool:
    """Return whether a ball that landed so cannot have touched the rim: its offset lies within the ellipse of `clear_offsets`."""
    if not math.isfinite(outcome.entry_angle):
        return False
    along, across = clear_offsets(scenario, outcome.entry_angle)
    if along == 0.0:
        return False
    offset = (outcome.landing_along - cup) / along, outcome.landing_across / across
    return math.hypot(*offset) <= 1.0
