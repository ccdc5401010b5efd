"""What each term of the program is for: plans without it, executed."""

from __future__ import annotations

from collections.abc import Callable
from concurrent.futures import Executor

import pandas as pd

from wam_cast.cast import Cast
from wam_cast.experiments.frames import Record
from wam_cast.experiments.statistics import describe, wilson_interval
from wam_cast.experiments.trials import Trial, draw_cups, execute, hits
from wam_cast.parallel.seeds import Purpose, derived_seed
from wam_cast.parallel.workers import Workers
from wam_cast.planning.prediction import Predictor
from wam_cast.planning.program import TERMS, Term, plan_by_program
from wam_cast.planning.reach import Reach

VARIANTS: dict[str, tuple[Term, ...]] = {"nothing": (), **{term: (term,) for term in TERMS}, "all of them": TERMS}
"""What is left out: nothing, each term alone, and all of them."""


def ablate(
    model: Predictor, n_cups: int, *, seed: int = 0, executor: Executor | Workers, report: Callable[[int, int], object]
) -> pd.DataFrame:
    """Return the trials of plans without each of the program's terms, over the same random cups and the same noise.

    Their label is the name of the variant.

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
    for label, without in VARIANTS.items():
        for i, cup in enumerate(cups):
            report(len(trials), n_steps)
            solution = plan_by_program(model, cup[0], without=without)
            cast = Cast.from_array(solution.parameters)
            trials.append(Trial(cast, cup, derived_seed(seed, Purpose.NOISE, i), label))
    return execute(model.scenario, trials, executor, report=lambda done: report(len(trials) + done, n_steps))


def summarize(trials: pd.DataFrame) -> Record:
    """Return what became of the trials of one variant.

    Beside those of `hits`: `executed_miss` [m]; `n_clear` balls that entered so that they could not touch the rim, with the
    `clear_interval` of their rate; `n_limit_hits` casts that met a limit of the arm; `n_taut` that landed with a taut string;
    `least_slack` of the string from the landing on, the 5th percentile [m]; `largest_utilization` of a motor's torque or a joint's
    velocity limit, the 95th percentile. The last two are nan if there are none.
    """
    n_clear = int(trials["entered_rim_clear"].sum())
    return hits(trials) | {
        "executed_miss": describe(trials["miss"].to_numpy()),
        "n_clear": n_clear,
        "clear_interval": wilson_interval(n_clear, len(trials)),
        "n_limit_hits": int((trials["limits_hit"].str.len() > 0).sum()),
        "n_taut": int((trials["slack"].notna() & ~trials["is_slack"]).sum()),
        "least_slack": trials["slack"].quantile(0.05),
        "largest_utilization": trials[["peak_torque_utilization", "peak_velocity_utilization"]]
        .max(axis=1)
        .quantile(0.95),
    }
