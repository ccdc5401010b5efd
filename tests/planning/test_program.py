"""The planner as a mathematical program, on models with a closed form."""

import numpy as np
import pytest
from pydrake.autodiffutils import ExtractGradient, ExtractValue, InitializeAutoDiff
from scipy.optimize import brentq

from wam_cast.cast import cast_bounds, is_allowed
from wam_cast.planning.plan import SOLVERS
from wam_cast.planning.program import EDGE_WEIGHT, LANDING_UNIT, N_STARTS, build_program, plan_by_program
from wam_cast.scenario import Scenario

LOWER, UPPER = cast_bounds(Scenario())


def scaled(parameters):
    return (parameters - LOWER) / (UPPER - LOWER)


def landing(model, solution):
    return model.predict(solution.parameters[np.newaxis])[0, 0]


@pytest.mark.parametrize("radius", [0.45, 0.6, 0.75, 0.95])
def test_the_solution_lands_in_the_cups_middle(curved_model, radius):
    solution = plan_by_program(curved_model, radius)
    assert landing(curved_model, solution) == pytest.approx(radius, abs=1e-6)
    assert solution.reason.startswith(f"SNOPT reached the cup from {N_STARTS} of {N_STARTS} starts")


@pytest.mark.parametrize("share", [0.12, 0.88])
def test_it_finds_the_cast_farthest_from_the_bounds(make_model, share):
    # By symmetry the three parameters are the same share of their range.
    model = make_model(along=(0.4, 0.2, 0.2, 0.2), angle=(0.3, 0, 0, 0))
    solution = plan_by_program(model, 0.4 + 0.6 * share)
    np.testing.assert_allclose(scaled(solution.parameters), share, atol=2e-3)


@pytest.mark.parametrize("steepest", [0.1, 0.3, 0.7])
def test_it_finds_the_steepest_entry_that_is_not_too_close_to_the_bounds(make_model, steepest):
    # Speed and wait choose the landing, distance the entry: (s - steepest)^2 + weight (2 s - 1)^8 is least.
    model = make_model(along=(0.4, 0, 0.2, 0.2), angle=(-steepest, 1, 0, 0))
    expected = brentq(lambda s: 2 * (s - steepest) + EDGE_WEIGHT * 16 * (2 * s - 1) ** 7, 0, 1)
    distance, speed, wait = scaled(plan_by_program(model, 0.66).parameters)
    assert distance == pytest.approx(expected, abs=0.01)
    assert speed + wait == pytest.approx(1.3, abs=1e-6)
    assert (speed, wait) == pytest.approx((0.65, 0.65), abs=0.1)  # the bounds' cost is flat here


def test_the_shortest_move_holds(make_model):
    # Steep would be short and fast; only wait chooses the landing.
    model = make_model(along=(0.4, 0, 0, 0.5), angle=(1.0, 1.0, -1.0, 0))
    distance, speed, wait = plan_by_program(model, 0.65).parameters
    assert distance == pytest.approx(0.2 * speed, rel=1e-6)
    assert wait == pytest.approx(0.25)


@pytest.mark.parametrize("slopes", [(0.6, 0, 0), (0, 0.6, 0), (0, 0, 0.6), (0.2, 0.2, 0.2), (0.5, -0.3, 0.4)])
@pytest.mark.parametrize("radius", [0.4, 0.7, 1.0, 1.4])
def test_bounds_and_the_shortest_move_hold_to_the_last_digit(make_model, slopes, radius):
    # Some radii are at the very end of what can be reached, or beyond it.
    model = make_model(along=(0.4, *slopes), angle=(0.5, 0.5, -0.5, 0))
    assert is_allowed(Scenario(), plan_by_program(model, radius).parameters)


def test_bounds_that_scaling_misses_by_rounding_hold_all_the_same(make_model):
    scenario = Scenario.from_dict({"bounds": {"distance": [0.15, 0.41]}})
    lower, upper = cast_bounds(scenario)
    assert lower[0] + (upper[0] - lower[0]) > upper[0]
    model = make_model(along=(0.4, 0.6, 0, 0), scenario=scenario)
    solution = plan_by_program(model, 1.2)  # out of reach: the search ends at the bound
    assert solution.parameters[0] == upper[0]
    assert is_allowed(scenario, solution.parameters)


def test_of_several_solutions_the_one_of_least_cost_is_kept(make_model):
    # Two valleys of the entry angle, and a known cast in either.
    def angle(s):
        return (
            0.5
            - 0.4 * np.exp(-(((s[:, 0] - 0.2) / 0.1) ** 2))
            - 0.2 * np.exp(-(((s[:, 0] - 0.8) / 0.1) ** 2))
        )

    def slope(s):
        steps = [
            (c, a * 2 * (s[:, 0] - c) / 0.01 * np.exp(-(((s[:, 0] - c) / 0.1) ** 2)))
            for c, a in ((0.2, 0.4), (0.8, 0.2))
        ]
        return np.column_stack([sum(step for _, step in steps), 0 * s[:, 0], 0 * s[:, 0]])

    for order in (1, -1):
        known = LOWER + (UPPER - LOWER) * np.array([[0.22, 0.4, 0.5], [0.78, 0.4, 0.5]])[::order]
        model = make_model(along=(0.4, 0, 0, 0.4), known_casts=known)
        model.set_angle(angle, slope)
        solution = plan_by_program(model, 0.6)
        assert scaled(solution.parameters)[0] == pytest.approx(0.2, abs=0.01)
        assert solution.n_solutions == 2
        assert "2 distinct solutions" in solution.reason


@pytest.mark.parametrize("solver", SOLVERS)
@pytest.mark.parametrize("radius", [0.45, 0.75, 0.95])
def test_every_solver_finds_the_same_cast(curved_model, radius, solver):
    solution = plan_by_program(curved_model, radius, solver=solver)
    assert landing(curved_model, solution) == pytest.approx(radius, abs=1e-5)
    reference = plan_by_program(curved_model, radius)
    np.testing.assert_allclose(scaled(solution.parameters), scaled(reference.parameters), atol=0.01)
    assert solution.reason.startswith(
        f"{solver.upper()} reached the cup from {N_STARTS} of {N_STARTS} starts"
    )


@pytest.mark.parametrize("solver", SOLVERS)
def test_every_solver_keeps_the_bounds_out_of_reach(make_model, solver):
    solution = plan_by_program(make_model(along=(0.4, 0.1, 0.1, 0.1)), 1.0, solver=solver)
    assert is_allowed(Scenario(), solution.parameters)
    assert solution.n_solutions == 0
    assert f"from 0 of {N_STARTS} starts, with 0 distinct solutions" in solution.reason


@pytest.mark.parametrize("solver", SOLVERS)
def test_solvers_repeat_to_the_last_digit(curved_model, solver):
    first, second = (plan_by_program(curved_model, 0.6, solver=solver) for _ in range(2))
    np.testing.assert_array_equal(first.parameters, second.parameters)
    assert first.n_evaluations == second.n_evaluations


def test_a_solution_that_lands_is_kept_before_a_cheaper_one_that_does_not(make_model):
    # Near the base the ball always lands at one place, steeply; farther out it depends on the wait.
    def along(s):
        return np.where(s[:, 0] < 0.3, 0.4, 0.4 + 0.4 * s[:, 2])

    def along_slope(s):
        return np.column_stack([0 * s[:, 0], 0 * s[:, 0], np.where(s[:, 0] < 0.3, 0.0, 0.4)])

    def angle(s):
        return np.where(s[:, 0] < 0.3, 0.0, 0.5)

    model = make_model(known_casts=LOWER + (UPPER - LOWER) * np.array([[0.2, 0.4, 0.5], [0.7, 0.4, 0.5]]))
    model.set_along(along, along_slope)
    model.set_angle(angle, np.zeros_like)
    solution = plan_by_program(model, 0.64)
    assert landing(model, solution) == pytest.approx(0.64, abs=1e-6)
    assert solution.reason == "SNOPT reached the cup from 1 of 2 starts, with 1 distinct solution"


def test_beyond_the_models_reach_it_says_so(make_model):
    solution = plan_by_program(make_model(along=(0.4, 0.1, 0.1, 0.1)), 1.0)
    assert f"from 0 of {N_STARTS} starts" in solution.reason


def test_costs_and_constraint_carry_the_models_gradient(curved_model):
    built = build_program(curved_model, 0.8)
    program = built.program
    at = np.array([0.3, 0.6, 0.2])
    parameters = LOWER + (UPPER - LOWER) * at
    along, _, angle = curved_model.predict(parameters[np.newaxis])[0]

    def total_cost(x):
        return sum(program.EvalBinding(cost, x)[0] for cost in program.GetAllCosts())

    assert total_cost(at) == pytest.approx(angle**2 + EDGE_WEIGHT * np.sum((2 * at - 1) ** 8))
    (constraint,) = program.generic_constraints()
    assert program.EvalBinding(constraint, at)[0] == pytest.approx((along - 0.8) / LANDING_UNIT)
    h = 1e-6
    for bindings in (program.GetAllCosts(), [constraint]):
        for binding in bindings:
            value = binding.evaluator().Eval(InitializeAutoDiff(at))
            difference = [
                (program.EvalBinding(binding, at + step) - program.EvalBinding(binding, at - step))[0]
                / (2 * h)
                for step in h * np.eye(3)
            ]
            np.testing.assert_allclose(ExtractGradient(value)[0], difference, rtol=1e-5, atol=1e-6)
            assert ExtractValue(value)[0, 0] == pytest.approx(program.EvalBinding(binding, at)[0])


def test_the_chain_rule_is_applied_to_what_comes_in(curved_model):
    (constraint,) = build_program(curved_model, 0.8).program.generic_constraints()
    at, inner = np.array([0.3, 0.6, 0.2]), np.array([[1.0, 2.0], [0.0, -1.0], [3.0, 0.5]])
    plain = ExtractGradient(constraint.evaluator().Eval(InitializeAutoDiff(at)))
    np.testing.assert_allclose(
        ExtractGradient(constraint.evaluator().Eval(InitializeAutoDiff(at, inner))), plain @ inner
    )


def test_the_move_duration_is_a_linear_constraint_in_scaled_parameters(curved_model):
    program = build_program(curved_model, 0.8).program
    (binding,) = program.linear_constraints()
    for at in np.random.default_rng(0).uniform(size=(20, 3)):
        distance, speed, _ = LOWER + (UPPER - LOWER) * at
        assert program.CheckSatisfied(binding, at) is bool(distance >= 0.2 * speed)


def test_evaluations_are_counted_and_shared_by_cost_and_constraint(curved_model):
    solution = plan_by_program(curved_model, 0.8)
    assert solution.n_evaluations == curved_model.calls["predict_with_gradient"] > N_STARTS
    evaluator = build_program(curved_model, 0.8).evaluator
    at = np.array([0.3, 0.6, 0.2])
    evaluator.output(0, at)
    evaluator.output(2, InitializeAutoDiff(at))
    assert evaluator.n_evaluations == 1
    evaluator.output(0, at + 1e-9)
    assert evaluator.n_evaluations == 2


@pytest.mark.parametrize("n_known", [1, 2, 5, 7])
def test_few_known_casts_are_enough(make_model, n_known):
    model = make_model()
    model.known_casts = model.known_casts[:n_known]
    solution = plan_by_program(model, 0.75)
    assert landing(model, solution) == pytest.approx(0.75, abs=1e-6)


def test_the_same_cup_gets_the_same_cast_whatever_was_planned_before(curved_model):
    first = plan_by_program(curved_model, 0.8)
    for radius in (0.5, 1.4, 0.9):
        plan_by_program(curved_model, radius)
    again = plan_by_program(curved_model, 0.8)
    np.testing.assert_array_equal(again.parameters, first.parameters)
    assert (again.n_evaluations, again.reason) == (first.n_evaluations, first.reason)


def test_the_program_reads_as_what_it_is(curved_model):
    text = str(build_program(curved_model, 0.8).program)
    for part in (
        "bounds",
        "move duration",
        "landing in the cup's middle",
        "entry angle squared",
        "closeness to the bounds",
    ):
        assert part in text
    assert "cast(2)" in text
