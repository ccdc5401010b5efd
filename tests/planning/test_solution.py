"""Solutions: what a planner's answer must be."""

import numpy as np
import pytest

from wam_cast.cast import Cast, cast_bounds, nearest_allowed
from wam_cast.errors import InputError
from wam_cast.planning.solution import Solution, checked_solution
from wam_cast.scenario import Scenario

SCENARIO = Scenario()
LOWER, UPPER = cast_bounds(SCENARIO)
ALLOWED = [0.3, 0.6, 0.1]
"""Distance [m], speed [m/s], wait [s]."""


def refusal(found, scenario=SCENARIO):
    with pytest.raises(InputError) as caught:
        checked_solution(found, scenario, "mine")
    line = str(caught.value)
    assert line.startswith("planner 'mine' ")
    assert "\n" not in line
    return line


@pytest.mark.parametrize("found", [ALLOWED, tuple(ALLOWED), np.array(ALLOWED), np.array(ALLOWED, dtype=object)])
def test_parameters_alone_are_a_solution_that_tells_no_more(found):
    solution = checked_solution(found, SCENARIO, "mine")
    assert solution.parameters.dtype == float
    np.testing.assert_array_equal(solution.parameters, ALLOWED)
    assert (solution.n_evaluations, solution.n_solutions, solution.searches) == (0, 1, ())
    assert solution.reason == "the planner gives no reason"


def test_a_solution_keeps_what_it_tells():
    path = np.array([ALLOWED])
    solution = checked_solution(Solution(ALLOWED, 5, "luck", (path,), 2), SCENARIO, "mine")
    assert (solution.n_evaluations, solution.reason, solution.n_solutions) == (5, "luck", 2)
    assert solution.searches[0] is path


def test_what_the_planner_does_with_its_array_later_does_not_matter():
    found = np.array(ALLOWED)
    solution = checked_solution(found, SCENARIO, "mine")
    found[:] = 0.0
    np.testing.assert_array_equal(solution.parameters, ALLOWED)


def test_a_cast_within_the_bounds_is_not_moved():
    drawn = np.random.default_rng(0).uniform(LOWER - 0.1, UPPER + 0.1, (300, 3))
    allowed = [nearest_allowed(SCENARIO, parameters) for parameters in drawn]
    for parameters in [*allowed, UPPER]:
        np.testing.assert_array_equal(checked_solution(parameters, SCENARIO, "mine").parameters, parameters)


@pytest.mark.parametrize(
    "found",
    [
        None,
        0.3,
        [],
        [0.3, 0.6],
        [*ALLOWED, 0.0],
        [ALLOWED],
        np.zeros((2, 3)),
        "here",
        {},
        Cast(*ALLOWED),
        [0.3, "fast", 0.1],
    ],
)
@pytest.mark.parametrize("wrap", [lambda found: found, Solution], ids=["bare", "solution"])
def test_what_is_no_cast_is_refused_with_what_is_one(found, wrap):
    line = refusal(wrap(found))
    assert line.startswith(f"planner 'mine' returned {repr(found)[:4]}")
    assert line.endswith("it must return [distance, speed, wait], an array of shape (3,), or a Solution")
    assert len(line) < 150


@pytest.mark.parametrize("value", [np.nan, np.inf, -np.inf, -1.0, 2.0])
@pytest.mark.parametrize("i", range(3))
def test_a_value_beyond_its_bounds_is_refused_with_the_bounds(i, value):
    found = np.array(ALLOWED)
    found[i] = value
    name = ("distance", "speed", "wait")[i]
    line = refusal(found)
    assert f"{name} = {value}" in line
    assert f"from {LOWER[i]:g} to {UPPER[i]:g}" in line
    assert "nearest_allowed in wam_cast.cast" in line


@pytest.mark.parametrize("i", range(3))
@pytest.mark.parametrize(("bound", "beyond"), [(LOWER, -np.inf), (UPPER, np.inf)])
def test_the_least_step_beyond_a_bound_is_refused_and_shows(i, bound, beyond):
    found = np.array([0.3, 0.6, 0.1])
    found[i] = np.nextafter(bound[i], beyond)
    assert f" = {found[i]}: " in refusal(found)


def test_a_move_that_is_too_short_is_refused_with_the_shortest():
    line = refusal([0.1, 0.8, 0.1])
    assert "distance = 0.1 at speed = 0.8, a move of 0.125 s" in line
    assert "at least 0.2 s" in line
    np.testing.assert_array_equal(checked_solution([0.1, 0.5, 0.1], SCENARIO, "mine").parameters, [0.1, 0.5, 0.1])


def test_the_bounds_are_the_scenarios():
    longer = Scenario.from_dict({"bounds": {"distance": [0.05, 0.5]}})
    assert checked_solution([0.45, 0.6, 0.1], longer, "mine").parameters[0] == 0.45
    assert "from 0.05 to 0.4" in refusal([0.45, 0.6, 0.1])
