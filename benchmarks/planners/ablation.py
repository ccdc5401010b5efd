"""What each term of the program is for: plans without it, executed."""

from __future__ import annotations

import math
from collections.abc import Sequence
from concurrent.futures import Executor

import numpy as np

from wam_cast.cast import Cast
from wam_cast.experiments.paper.results import Result
from wam_cast.experiments.paper.settings import OnProgress
from wam_cast.experiments.statistics import wilson_interval
from wam_cast.experiments.trials import Hits, Trial, draw_cups, entered_clear, execute, summarize
from wam_cast.parallel.seeds import Purpose, derived_seed
from wam_cast.parallel.workers import Workers
from wam_cast.planning.prediction import Predictor
from wam_cast.planning.program import TERMS, Term, plan_by_program
from wam_cast.planning.reach import Reach
from wam_cast.scenario import Scenario
from wam_cast.simulation.outcome import Outcome

VARIANTS: tuple[tuple[Term, ...], ...] = ((), *((term,) for term in TERMS), TERMS)
"""What is left out: nothing, each term alone, and all of them."""


class Ablation(Result):
    """The program without some of its terms, over random cups.

    Attributes
    ----------
    without
        What was left out.
    hits
        Over all cups.
    n_clear, clear_interval
        How many balls entered so that they could not touch the rim.
    n_limit_hits
        How many casts met a limit of the arm.
    n_taut
        How many landed with a taut string.
    least_slack
        Of the string from the landing on, the 5th percentile [m].
    largest_share
        Of a motor's torque or a joint's speed limit, the 95th percentile.
    """

    without: tuple[str, ...]
    hits: Hits
    n_clear: int
    clear_interval: tuple[float, float]
    n_limit_hits: int
    n_taut: int
    least_slack: float | None
    largest_share: float | None


def ablate(
    model: Predictor, n_cups: int, *, seed: int = 0, executor: Executor | Workers, report: OnProgress
) -> tuple[Ablation, ...]:
    """Return what becomes of plans without each of the program's terms, over the same random cups and the same noise.

    Parameters
    ----------
    model
        What is planned with, and in whose scenario plans are executed.
    n_cups
        How many cups, uniformly over the model's reach.
    seed
        Draws the cups and the noise.
    executor
        Runs the casts.
    report
        Called with how much is done, and how much there is: each cast is planned and executed.
    """
    cups = draw_cups(Reach.of(model), n_cups, seed)
    trials: list[Trial] = []
    n_steps = 2 * len(VARIANTS) * n_cups
    for without in VARIANTS:
        for i, cup in enumerate(cups):
            report(len(trials), n_steps)
            solution = plan_by_program(model, cup[0], without=without)
            trials.append(
                Trial(Cast.from_array(solution.parameters), cup, derived_seed(seed, Purpose.NOISE, i))
            )
    outcomes = execute(model.scenario, trials, executor, lambda n_done: report(len(trials) + n_done, n_steps))
    slices = (slice(i * n_cups, (i + 1) * n_cups) for i in range(len(VARIANTS)))
    return tuple(
        _summarize(model.scenario, without, trials[part], outcomes[part])
        for without, part in zip(VARIANTS, slices, strict=True)
    )


def _summarize(
    scenario: Scenario, without: tuple[str, ...], trials: Sequence[Trial], outcomes: Sequence[Outcome | None]
) -> Ablation:
    known = [outcome for outcome in outcomes if outcome is not None]
    clear = sum(entered_clear(scenario, *pair) for pair in zip(trials, outcomes, strict=True))
    shares = [float(np.max([outcome.peak_load, outcome.peak_speed])) for outcome in known]
    return Ablation(
        without=without,
        hits=summarize(trials, outcomes),
        n_clear=clear,
        clear_interval=wilson_interval(clear, len(trials)),
        n_limit_hits=sum(bool(outcome.limits_hit) for outcome in known),
        n_taut=sum(math.isfinite(outcome.slack) and not outcome.is_slack for outcome in known),
        least_slack=_percentile([outcome.slack for outcome in known], 5),
        largest_share=_percentile(shares, 95),
    )


def _percentile(values: Sequence[float], share: float) -> float | None:
    """Return a percentile of the finite values, None if there are none."""
    finite = [value for value in values if math.isfinite(value)]
    return float(np.percentile(finite, share)) if finite else None
