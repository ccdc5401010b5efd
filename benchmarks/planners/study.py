"""Each contender chooses a cast for each of some random cups, and each cast is executed with cups of two kinds."""

from __future__ import annotations

from collections.abc import Sequence
from concurrent.futures import Executor
from contextlib import closing
from functools import partial

from planners.contenders import PLANNERS, Contender, searchers
from planners.results import Attempt, HitRate, PlannerComparison, Score
from wam_cast.errors import InputError, checked_whole_number
from wam_cast.experiments.paper.results import maybe_float, to_array
from wam_cast.experiments.paper.settings import OnProgress
from wam_cast.experiments.statistics import describe, wilson_interval
from wam_cast.experiments.trials import draw_cups
from wam_cast.parallel.seeds import Purpose, derived_seed
from wam_cast.parallel.threads import one_thread
from wam_cast.parallel.workers import Workers, run_rows
from wam_cast.planning.prediction import Predictor
from wam_cast.planning.reach import Reach
from wam_cast.scenario import Scenario
from wam_cast.simulation.outcome import Status
from wam_cast.simulation.simulator import simulate_cast

CUP_KINDS = {"nearly inelastic": 0.25, "lively": 0.6}
"""Kinds of cups that casts are executed with, and their restitution."""

N_CASTS = 30
"""Simulated casts for each cup that a search on the simulator has by default."""


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
        If a number is no whole number or too small, a package of a search is missing, or no cup is left to take the budget from.
    """
    n_cups = checked_whole_number("n_cups", n_cups, 1)
    if budget is not None:
        budget = checked_whole_number("budget", budget, 1)
    n_casts = checked_whole_number("n_casts", n_casts, 1)
    seed = checked_whole_number("seed", seed, 0)
    cups = [cup[0] for cup in draw_cups(Reach.of(model), n_cups, seed)]
    run = partial(_run, model, cups, seed, executor=executor, report=report)
    scores = run(PLANNERS, n_done=0)
    chosen = _median_of_program(scores) if budget is None else budget
    scores += run(searchers(chosen, n_casts), n_done=n_cups * len(PLANNERS))
    return PlannerComparison(
        seed=seed,
        n_cups=n_cups,
        reach=model.reach,
        budget=chosen,
        is_budget_given=budget is not None,
        n_casts=n_casts,
        scores=tuple(scores),
    )


def _median_of_program(scores: list[Score]) -> int:
    (used,) = (score.n_evaluations for score in scores if score.method == "program")
    if used is None:
        raise InputError(
            "budget: the program lost its process for every cup, so that it says nothing; state a budget"
        )
    return round(used)


def _run(
    model: Predictor,
    cups: list[float],
    seed: int,
    contenders: Sequence[Contender],
    *,
    n_done: int,
    executor: Executor | Workers,
    report: OnProgress,
) -> list[Score]:
    """Return the scores of some of the contenders; `n_done` rows were done before."""
    n_rows = len(cups) * (len(PLANNERS) + len(searchers(1, 1)))
    jobs = [(contender, i) for contender in contenders for i in range(len(cups))]
    report(n_done, n_rows)
    attempts: list[Attempt] = []
    with closing(run_rows(partial(_attempt, model, cups, seed, jobs), range(len(jobs)), executor)) as found:
        for (_, i), attempt in zip(jobs, found, strict=True):
            attempts.append(Attempt(cup=cups[i]) if attempt is None else attempt)
            report(n_done + len(attempts), n_rows)
    n = len(cups)
    return [_score(contender, attempts[i * n : (i + 1) * n]) for i, contender in enumerate(contenders)]


def _attempt(
    model: Predictor, cups: list[float], seed: int, jobs: list[tuple[Contender, int]], row: int
) -> Attempt:
    """Let a contender choose a cast for a cup, on one thread, and execute it with every kind of cup."""
    contender, i = jobs[row]
    with one_thread():
        choice = contender.choose(model, cups[i], derived_seed(seed, Purpose.SEARCH, i))
    outcomes = [
        simulate_cast(
            _with_restitution(model.scenario, restitution),
            choice.cast,
            (cups[i], 0.0),
            noise_seed=derived_seed(seed, Purpose.NOISE, i),
        )
        for restitution in CUP_KINDS.values()
    ]
    return Attempt(
        cup=cups[i],
        cast=(choice.cast.distance, choice.cast.speed, choice.cast.wait),
        executed_miss=maybe_float(outcomes[0].miss),
        n_evaluations=choice.n_evaluations,
        seconds=choice.seconds,
        statuses=tuple(outcome.status.value for outcome in outcomes),
    )


def _with_restitution(scenario: Scenario, restitution: float) -> Scenario:
    cup = scenario.cup.model_copy(update={"restitution": restitution})
    return scenario.model_copy(update={"cup": cup})


def _score(contender: Contender, attempts: list[Attempt]) -> Score:
    return Score(
        method=contender.method,
        source=contender.source,
        n_cups=len(attempts),
        hits=tuple(_hit_rate(kind, i, attempts) for i, kind in enumerate(CUP_KINDS)),
        executed_miss=describe(to_array(attempt.executed_miss for attempt in attempts)),
        n_evaluations=_median([attempt.n_evaluations for attempt in attempts]),
        seconds=_median([attempt.seconds for attempt in attempts]),
        attempts=tuple(attempts),
    )


def _hit_rate(kind: str, index: int, attempts: list[Attempt]) -> HitRate:
    caught = [attempt for attempt in attempts if attempt.statuses[index : index + 1] == (Status.CAUGHT,)]
    n, n_cups = len(caught), len(attempts)
    return HitRate(cup_kind=kind, n_caught=n, rate=n / n_cups, interval=wilson_interval(n, n_cups))


def _median(values: Sequence[float | None]) -> float | None:
    """Return the median of the values that exist, None if there are none."""
    return describe(to_array(values)).median
