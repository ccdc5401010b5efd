"""The paper's planner, on models with a closed form."""

import numpy as np
import pytest

from wam_cast.cast import cast_bounds, is_allowed, nearest_allowed
from wam_cast.planning.gradient_descent import plan_by_gradient_descent
from wam_cast.scenario import Scenario

LOWER, UPPER = cast_bounds(Scenario())
MIDDLE = (LOWER + UPPER) / 2


def scaled(parameters):
    return (parameters - LOWER) / (UPPER - LOWER)


def landing(model, solution):
    return model.predict(solution.parameters[np.newaxis])[0, 0]


def test_it_starts_in_the_middle_of_the_bounds(make_model):
    model = make_model()
    solution = plan_by_gradient_descent(model, 0.7)  # where the middle lands: 0.4 + (0.3 + 0.2 + 0.1) / 2
    np.testing.assert_allclose(solution.parameters, MIDDLE, rtol=1e-15)
    assert solution.n_evaluations == 7
    assert "after 0 steps" in solution.reason


@pytest.mark.parametrize("radius", [0.6, 0.8])
def test_one_step_agrees_with_the_formula(make_model, radius):
    slopes = np.array([0.3, 0.2, 0.1])
    solution = plan_by_gradient_descent(make_model(along=(0.4, *slopes)), radius, max_steps=1)
    # x1 = x0 - |m(x0) - r| grad |m(x0) - r|, in parameters scaled to the unit cube; m(x0) = 0.7.
    expected = 0.5 + (radius - 0.7) * slopes
    np.testing.assert_allclose(scaled(solution.parameters), expected, rtol=1e-9)
    assert solution.reason == "not within 10 mm after 1 steps"
    assert solution.n_evaluations == 14


def test_no_steps_leave_the_start(make_model):
    solution = plan_by_gradient_descent(make_model(), 0.8, max_steps=0)
    np.testing.assert_allclose(solution.parameters, MIDDLE, rtol=1e-15)
    assert solution.n_evaluations == 7


def test_each_step_shrinks_a_linear_models_miss_by_the_same_share(make_model):
    model = make_model()  # |slopes|^2 = 0.14
    misses = [landing(model, plan_by_gradient_descent(model, 0.8, max_steps=n)) - 0.8 for n in range(8)]
    np.testing.assert_allclose(np.divide(misses[1:], misses[:-1]), 1 - 0.14, rtol=1e-6)


@pytest.mark.parametrize("radius", [0.55, 0.62, 0.83, 0.9])
def test_it_converges_and_stops_as_soon_as_it_is_within_a_centimetre(make_model, radius):
    model = make_model()
    solution = plan_by_gradient_descent(model, radius)
    assert abs(landing(model, solution) - radius) <= 0.01
    n_steps = solution.n_evaluations // 7 - 1
    assert solution.reason == f"within 10 mm after {n_steps} steps"
    before = plan_by_gradient_descent(model, radius, max_steps=n_steps - 1)
    assert abs(landing(model, before) - radius) > 0.01


def test_the_tolerance_can_be_less(curved_model):
    solution = plan_by_gradient_descent(curved_model, 0.8, tolerance=1e-3)
    assert abs(landing(curved_model, solution) - 0.8) <= 1e-3
    assert "within 1 mm" in solution.reason


def test_it_gives_up_where_no_cast_lands(make_model):
    model = make_model()
    solution = plan_by_gradient_descent(model, 1.4, max_steps=50)
    assert solution.reason == "not within 10 mm after 50 steps"
    assert solution.n_evaluations == 7 * 51
    assert model.calls["predict"] == 51
    assert landing(model, solution) == pytest.approx(1.0, abs=1e-3)  # the farthest there is, in a corner
    assert is_allowed(Scenario(), solution.parameters)


def test_a_flat_model_holds_it(make_model):
    solution = plan_by_gradient_descent(make_model(along=(0.7, 0, 0, 0)), 0.8, max_steps=5)
    np.testing.assert_allclose(solution.parameters, MIDDLE, rtol=1e-15)


@pytest.mark.parametrize("slopes", [(-3, 3, 0), (3, -3, 3), (0, 8, -8), (-8, -8, -8), (8, 8, 8)])
@pytest.mark.parametrize("n_steps", [1, 3, 30])
def test_it_stays_within_the_bounds_and_the_shortest_move(make_model, slopes, n_steps):
    model = make_model(along=(0.0, *slopes))
    solution = plan_by_gradient_descent(model, 1.2, max_steps=n_steps)
    assert is_allowed(Scenario(), solution.parameters)


def test_the_shortest_move_holds_on_the_way(make_model):
    # Far and fast would be a short cut; the slope pulls to short distances and high speeds.
    model = make_model(along=(0.4, -0.9, 0.9, 0))
    solution = plan_by_gradient_descent(model, 1.3)
    distance, speed, _ = solution.parameters
    assert distance == pytest.approx(0.2 * speed, rel=1e-9)


def test_it_tells_every_cast_on_its_way(make_model):
    model = make_model()
    solution = plan_by_gradient_descent(model, 0.83)
    (path,) = solution.searches
    n_steps = len(path) - 1
    assert solution.reason == f"within 10 mm after {n_steps} steps"
    assert n_steps > 5
    for step in (0, 1, n_steps):
        np.testing.assert_array_equal(path[step], plan_by_gradient_descent(model, 0.83, max_steps=step).parameters)


def test_the_same_cup_gets_the_same_cast_whatever_was_planned_before(curved_model):
    first = plan_by_gradient_descent(curved_model, 0.8)
    plan_by_gradient_descent(curved_model, 0.5)
    again = plan_by_gradient_descent(curved_model, 0.8)
    np.testing.assert_array_equal(again.parameters, first.parameters)
    assert (again.n_evaluations, again.reason) == (first.n_evaluations, first.reason)


def test_it_needs_no_gradient_of_the_model(curved_model):
    plan_by_gradient_descent(curved_model, 0.8)
    assert not curved_model.calls["predict_with_gradient"]


def test_nearest_allowed_is_where_it_starts_if_the_middle_is_too_fast():
    # Bounds whose middle lasts too short a time.
    scenario = Scenario.from_dict({"motion": {"min_move_duration": 0.6}})
    lower, upper = cast_bounds(scenario)
    start = nearest_allowed(scenario, (lower + upper) / 2)
    assert not is_allowed(scenario, (lower + upper) / 2)
    assert is_allowed(scenario, start)
