"""Plan: a cast for a cup, and what a planner needs to know of a model."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from functools import partial
from typing import Literal, get_args

import numpy as np

from wam_cast.cast import Cast, checked_cup
from wam_cast.errors import InputError
from wam_cast.parallel.threads import one_thread
from wam_cast.planning.landing_distribution import Spread, clear_entry_probability, landing_spread
from wam_cast.planning.prediction import Predictor
from wam_cast.planning.reach import Reach, checked_polar
from wam_cast.types import Array

Method = Literal["program", "gradient"]

METHODS: tuple[Method, ...] = get_args(Method)
"""Planners by name: `program` is a mathematical program, `gradient` the paper's descent."""

Solver = Literal["snopt", "ipopt", "nlopt"]

SOLVERS: tuple[Solver, ...] = get_args(Solver)
"""Of the mathematical program, by name; the first one is the default."""

LONGEST_MISS = 0.01
"""A plan is feasible if its predicted landing is no farther from the cup's axis [m]: where the paper stops (Section 2.5)."""


@dataclass(frozen=True)
class Plan:
    """A cast for a cup, before it is executed.

    Attributes
    ----------
    cup
        World (x, y) of the cup's axis [m].
    cast
        The cast that the planner chose.
    predicted_landing
        World (x, y) where the model expects the ball to cross the rim plane [m], shape (2,).
    predicted_miss
        Its distance from the cup's axis [m].
    predicted_spread
        By how much the landing is uncertain along and across the casting plane, standard deviations [m]: the model's own error and
        the scenario's noise of the move and the swing.
    predicted_entry_angle, predicted_entry_speed
        Of the ball at the rim plane: from the vertical [rad], and [m/s].
    predicted_slack
        Of the string from the landing on [m].
    predicted_peak_load, predicted_peak_speed
        The largest shares of the motors' torque and of the joints' speed limits, up to the landing.
    clear_entry_probability
        That the ball enters the cup without touching its rim. It ends in the cup more often than that: most balls that
        touch the rim fall in all the same.
    is_feasible
        Whether the predicted miss is at most 1 cm.
    method
        Name of the planner.
    n_evaluations
        How many casts the planner asked the model about, with or without gradients.
    n_solutions
        How many distinct casts the planner found that are predicted to land in the cup's middle; this is the best of them. The
        descent looks for one only.
    reason
        Why the planner stopped, in words.
    searches
        Of each search, that of this plan first: the casts `[distance, speed, wait]` [m, m/s, s] that it went through, from its
        start to its end, shape (n, 3). A solver's trials on the way count, the casts beside one that tell its slope do not.
    """

    cup: tuple[float, float]
    cast: Cast
    predicted_landing: Array
    predicted_miss: float
    predicted_spread: Spread
    predicted_entry_angle: float
    predicted_entry_speed: float
    predicted_slack: float
    predicted_peak_load: float
    predicted_peak_speed: float
    clear_entry_probability: float
    is_feasible: bool
    method: str
    n_evaluations: int
    n_solutions: int
    reason: str
    searches: tuple[Array, ...]


@dataclass(frozen=True)
class Solution:
    """What a planner found in the casting plane: parameters `[distance, speed, wait]`, shape (3,), and how; see `Plan`."""

    parameters: Array
    n_evaluations: int
    reason: str
    searches: tuple[Array, ...]
    n_solutions: int = 1


def plan_cast(
    model: Predictor, cup: tuple[float, float], method: Method = "program", solver: Solver | None = None
) -> Plan:
    """Plan a cast into a cup.

    Parameters
    ----------
    model
        A forward model, such as `reference_model()`.
    cup
        World (x, y) of the cup's axis [m].
    method
        `program` or `gradient`.
    solver
        Of the program: `snopt`, which is the default, `ipopt` or `nlopt`.

    Raises
    ------
    InputError
        If the cup is not a pair of finite numbers or out of reach (the line names the nearest position within), or there is no
        such method or solver.
    """
    cup = checked_cup(cup)
    _check_method(method, solver)
    radius, bearing = checked_polar(Reach.of(model), cup)
    planner = _planner(method, solver or SOLVERS[0])
    with one_thread():
        solution = planner(model, radius)
        prediction = model.predict(solution.parameters[np.newaxis])[0]
        spread = landing_spread(model, solution.parameters, model.scenario.noise)
    along, across, entry_angle, entry_speed, slack, load, speed = (float(value) for value in prediction)
    # The casting plane is turned by what the ball is expected to land beside it.
    cast = Cast.from_array(solution.parameters, bearing - math.atan2(across, along))
    c, s = math.cos(cast.bearing), math.sin(cast.bearing)
    landing = np.array([c * along - s * across, s * along + c * across])
    miss = float(np.linalg.norm(landing - cup))
    # Turned that way, the ball is expected on the line from the base axis to the cup.
    offset = (math.hypot(along, across) - radius, 0.0)
    return Plan(
        cup=cup,
        cast=cast,
        predicted_landing=landing,
        predicted_miss=miss,
        predicted_spread=spread,
        predicted_entry_angle=entry_angle,
        predicted_entry_speed=entry_speed,
        predicted_slack=slack,
        predicted_peak_load=load,
        predicted_peak_speed=speed,
        clear_entry_probability=clear_entry_probability(model.scenario, entry_angle, offset, spread),
        is_feasible=miss <= LONGEST_MISS,
        method=method,
        n_evaluations=solution.n_evaluations,
        n_solutions=solution.n_solutions,
        reason=solution.reason,
        searches=solution.searches,
    )


def _check_method(method: str, solver: str | None) -> None:
    if method not in METHODS:
        raise InputError(f"planner {method!r} is not known: choose {' or '.join(METHODS)}")
    if solver is not None and method != "program":
        raise InputError(
            f"solver {solver!r}: the planner {method!r} has none; leave it out, or plan by program"
        )
    if solver not in (None, *SOLVERS):
        raise InputError(f"solver {solver!r} is not known: choose {', '.join(SOLVERS)}")


def _planner(method: Method, solver: Solver) -> Callable[[Predictor, float], Solution]:
    """Return the planner of that name; only the program needs Drake."""
    if method == "gradient":
        from wam_cast.planning.gradient_descent import plan_by_gradient_descent

        return plan_by_gradient_descent
    from wam_cast.planning.program import plan_by_program

    return partial(plan_by_program, solver=solver)
