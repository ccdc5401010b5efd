"""What the comparison of planners finds: plain values in SI units."""

from __future__ import annotations

from wam_cast.experiments.paper.results import Result, Statistics


class Attempt(Result):
    """A cup [m from the base axis], the cast that was chosen for it, and what became of it.

    Attributes
    ----------
    cast
        `[distance, speed, wait]` [m, m/s, s]. This and what follows is None if the process was lost.
    executed_miss
        Distance of the landing from the cup's middle [m], as if nothing were in the way; None too if the ball never came down.
    n_evaluations
        How often the model or the simulator was asked.
    seconds
        Processor time of the choice [s].
    statuses
        Values of `Status`, one for each kind of cup; empty if the process was lost.
    """

    cup: float
    cast: tuple[float, float, float] | None = None
    executed_miss: float | None = None
    n_evaluations: int | None = None
    seconds: float | None = None
    statuses: tuple[str, ...] = ()


class HitRate(Result):
    """How many of all cups of a kind were hit, with Wilson's 95 % interval of the rate."""

    cup_kind: str
    n_caught: int
    rate: float
    interval: tuple[float, float]


class Score(Result):
    """One contender over all cups.

    Attributes
    ----------
    method, source
        Its name, and what it asked: the model or the simulator.
    hits
        One for each kind of cup. Every cup counts, also where the process was lost.
    executed_miss
        Over the cups whose ball came down.
    n_evaluations, seconds
        Medians over the cups whose process was not lost; None if all were.
    """

    method: str
    source: str
    n_cups: int
    hits: tuple[HitRate, ...]
    executed_miss: Statistics
    n_evaluations: float | None
    seconds: float | None
    attempts: tuple[Attempt, ...]


class PlannerComparison(Result):
    """All contenders over the same cups.

    Attributes
    ----------
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

    seed: int
    n_cups: int
    reach: tuple[float, float]
    budget: int
    is_budget_given: bool
    n_casts: int
    scores: tuple[Score, ...]
