"""Each contender chooses a cast for each of some random cups, and each cast is executed with cups of two kinds."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from concurrent.futures import Executor
from contextlib import closing
from dataclasses import dataclass
from functools import partial

import pandas as pd

from planners.contenders import PLANNERS, Choice, Contender, searchers
from wam_cast.errors import checked_integer
from wam_cast.experiments.frames import Record
from wam_cast.experiments.trials import Polar, Trial, draw_cups, trial_row
from wam_cast.parallel.seeds import Purpose, derived_seed
from wam_cast.parallel.threads import one_thread
from wam_cast.parallel.workers import Workers, run_rows
from wam_cast.planning.prediction import Predictor
from wam_cast.planning.reach import Reach
from wam_cast.scenario import Scenario
from wam_cast.simulation.outcome import Outcome
from wam_cast.simulation.simulator import simulate_cast

OnProgress = Callable[[int, int], object]
"""Takes how much is done, and how much there is."""

CUP_KINDS = {"nearly inelastic": 0.25, "lively": 0.6}
"""Kinds of cups that casts are executed with, and their restitution."""

N_CASTS = 30
"""Simulated casts for each cup that a search on the simulator has by default."""


@dataclass(frozen=True, eq=False)
class PlannerComparison:
    """All contenders over the same cups.

    Attributes
    ----------
    trials
        A row a contender, cup and kind of cup: as of `wam_cast.experiments.trials`, `label` being the contender's name, and its
        `source`, the model or the simulator; the `cup_kind`; `n_evaluations`, how often the source was asked; `seconds`, processor
        time of the choice.
    seed
        Draws the cups, and is that of the searches.
    reach
        Between what the cups lie [m].
    budget
        Evaluations of the model that each search had.
    is_budget_given
        Whether it was, else it is the median of what the program used on these cups.
    n_casts
        Simulated casts that each search on the simulator had.
    """

    trials: pd.DataFrame
    seed: int
    n_cups: int
    reach: tuple[float, float]
    budget: int
    is_budget_given: bool
    n_casts: int


def compare_planners(
    model: Predictor,
    n_cups: int,
    *,
    budget: int | None = None,
    n_casts: int = N_CASTS,
    seed: int = 0,
    executor: Executor | Workers,
    report: OnProgress,
) -> PlannerComparison:
    """Return how planners and searches compare over the same cups; all but the seconds is the same for any number of workers.

    Parameters
    ----------
    model
        What is planned with; must pickle. Casts are executed in its scenario, noise included, but for the cup's restitution.
    n_cups
        How many cups, uniformly over the model's reach.
    budget
        Evaluations of the model for each search and cup, by default what the program used on these cups at the median: every
        cast that it asks the model about counts, with or without its gradient. Bayesian optimisation has no more than
        `MOST_BAYESIAN`.
    n_casts
        Simulated casts for each search on the simulator and cup.
    seed
        Draws the cups, of which more begin with the same ones, and all that is random in the searches.
    executor
        Runs one contender and cup a row.
    report
        Called with how many rows are done, and how many there are.

    Raises
    ------
    InputError
        If a number is no integer or too small, a package of a search is missing, or no cup is left to take the budget from.
    """
    n_cups = checked_integer("n_cups", n_cups, 1)
    if budget is not None:
        budget = checked_integer("budget", budget, 1)
    n_casts = checked_integer("n_casts", n_casts, 1)
    seed = checked_integer("seed", seed, 0)
    cups = draw_cups(Reach.of(model), n_cups, seed)
    run = partial(_run, model, cups, seed, executor=executor, report=report)
    rows = run(PLANNERS, n_done=0)
    chosen = _median_of_program(rows) if budget is None else budget
    rows += run(searchers(chosen, n_casts), n_done=n_cups * len(PLANNERS))
    return PlannerComparison(
        trials=pd.DataFrame(rows),
        seed=seed,
        n_cups=n_cups,
        reach=model.reach,
        budget=chosen,
        is_budget_given=budget is not None,
        n_casts=n_casts,
    )


def _median_of_program(rows: list[Record]) -> int:
    trials = pd.DataFrame(rows)
    used = trials.loc[trials["label"] == "program", "n_evaluations"].median()
    return round(used)


def _run(
    model: Predictor,
    cups: Sequence[Polar],
    seed: int,
    contenders: Sequence[Contender],
    *,
    n_done: int,
    executor: Executor | Workers,
    report: OnProgress,
) -> list[Record]:
    """Return the trials of some of the contenders; `n_done` choices were made before."""
    n_jobs = len(cups) * (len(PLANNERS) + len(searchers(1, 1)))
    jobs = [(contender, i) for contender in contenders for i in range(len(cups))]
    report(n_done, n_jobs)
    rows: list[Record] = []
    with closing(run_rows(partial(_attempt, model, cups, seed, jobs), range(len(jobs)), executor)) as found:
        for done, ((contender, i), attempt) in enumerate(zip(jobs, found, strict=True), n_done + 1):
            rows += _rows(model.scenario, contender, cups[i], attempt)
            report(done, n_jobs)
    return rows


def _attempt(
    model: Predictor, cups: Sequence[Polar], seed: int, jobs: list[tuple[Contender, int]], row: int
) -> tuple[Choice, list[Outcome]]:
    """Let a contender choose a cast for a cup, on one thread, and execute it with every kind of cup."""
    contender, i = jobs[row]
    radius, _ = cups[i]
    with one_thread():
        choice = contender.choose(model, radius, derived_seed(seed, Purpose.SEARCH, i))
    noise_seed = derived_seed(seed, Purpose.NOISE, i)
    outcomes = [
        simulate_cast(_with_restitution(model.scenario, restitution), choice.cast, (radius, 0.0), noise_seed=noise_seed)
        for restitution in CUP_KINDS.values()
    ]
    return choice, outcomes


def _with_restitution(scenario: Scenario, restitution: float) -> Scenario:
    cup = scenario.cup.model_copy(update={"restitution": restitution})
    return scenario.model_copy(update={"cup": cup})


def _rows(scenario: Scenario, contender: Contender, cup: Polar, attempt: tuple[Choice, list[Outcome]]) -> list[Record]:
    """Return a row for each kind of cup."""
    about = {"label": contender.method, "source": contender.source}
    choice, outcomes = attempt
    about |= {"n_evaluations": choice.n_evaluations, "seconds": choice.seconds}
    return [
        trial_row(scenario, Trial(choice.cast, cup), outcome) | about | {"cup_kind": kind}
        for kind, outcome in zip(CUP_KINDS, outcomes, strict=True)
    ]
