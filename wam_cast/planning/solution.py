"""Solution: what a planner finds for a cup, and what every planner is: a function from a model and a distance to it."""

from __future__ import annotations

import reprlib
from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Literal, TypeAlias, get_args

import numpy as np

from wam_cast.cast import PARAMETERS, cast_bounds, is_allowed
from wam_cast.errors import InputError
from wam_cast.planning.prediction import Predictor
from wam_cast.scenario import Scenario
from wam_cast.types import Array

Solver = Literal["snopt", "ipopt", "nlopt"]

SOLVERS: tuple[Solver, ...] = get_args(Solver)
"""Of the mathematical program, by name; the first one is the default."""

LONGEST_MISS = 0.01
"""A plan is feasible if its predicted landing is no farther from the cup's axis [m]: where the paper stops (Section 2.5)."""


@dataclass(frozen=True)
class Solution:
    """What a planner found in the casting plane, and how.

    Attributes
    ----------
    parameters
        The cast `[distance, speed, wait]` [m, m/s, s], shape (3,).
    n_evaluations
        How many casts the planner asked the model about, with or without gradients; 0 if it does not tell.
    reason
        Why the planner stopped, in words.
    searches
        Of each search, that of this solution first: the casts that it went through, from its start to its end, shape (n, 3).
    n_solutions
        How many distinct casts the planner found that are predicted to land in the cup's middle; this is the best of them.
    """

    parameters: Array
    n_evaluations: int = 0
    reason: str = "the planner gives no reason"
    searches: tuple[Array, ...] = ()
    n_solutions: int = 1


Planner: TypeAlias = Callable[[Predictor, float], Solution | Array]
"""Finds a cast for a cup, given a model and the cup's distance from the base axis [m]: a `Solution`, or its parameters alone."""


def checked_solution(found: Solution | Array, scenario: Scenario, planner: str) -> Solution:
    """Return what a planner of that name found, if it is a cast that the scenario allows.

    Raises
    ------
    InputError
        If it is no `[distance, speed, wait]`, or outside the scenario's bounds. A cast is never moved within them: the plan
        would not be the planner's.
    """
    solution = found if isinstance(found, Solution) else Solution(found)
    try:
        parameters = np.array(solution.parameters, dtype=float)
    except (TypeError, ValueError):
        parameters = np.empty(0)
    if parameters.shape != (3,):
        given = " ".join(reprlib.repr(solution.parameters).split())
        raise InputError(
            f"planner {planner!r} returned {given}: it must return [distance, speed, wait], an array of shape (3,), or a Solution"
        )
    for name, value, lower, upper in zip(PARAMETERS, parameters.tolist(), *cast_bounds(scenario), strict=True):
        if not lower <= value <= upper:
            raise _not_allowed(planner, f"{name} = {value}", f"from {lower:g} to {upper:g}")
    if not is_allowed(scenario, parameters):
        distance, speed, _ = parameters
        raise _not_allowed(
            planner,
            f"distance = {distance} at speed = {speed}, a move of {distance / speed:.4g} s",
            f"moves of at least {scenario.motion.min_move_duration:g} s",
        )
    return replace(solution, parameters=parameters)


def _not_allowed(planner: str, chosen: str, allowed: str) -> InputError:
    return InputError(
        f"planner {planner!r} chose {chosen}: the scenario allows {allowed}; "
        "nearest_allowed in wam_cast.cast moves a cast within its bounds"
    )
