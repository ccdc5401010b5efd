"""The planner as a mathematical program, on models with a closed form."""

import math

import numpy as np
import pytest
from pydrake.autodiffutils import ExtractGradient, ExtractValue, InitializeAutoDiff

from wam_cast.cast import cast_bounds, is_allowed
from wam_cast.errors import InputError
from wam_cast.planning import program
from wam_cast.planning.landing_distribution import N_SCATTER_CASTS, repeatability
from wam_cast.planning.program import (
    LANDING_UNIT,
    MARGIN_DEVIATIONS,
    MAX_MARGIN,
    MAX_UTILIZATION,
    MIN_SLACK,
    N_STARTS,
    TERMS,
    build_program,
    plan_by_program,
)
from wam_cast.planning.solution import SOLVERS
from wam_cast.scenario import Noise, Scenario

LOWER, UPPER = cast_bounds(Scenario())
NOISY = Scenario(noise=Noise.typical())


def scaled(parameters):
    return (parameters - LOWER) / (UPPER - LOWER)


def landing(model, solution):
    return model.predict(solution.parameters[np.newaxis])[0, 0]


def valley(at, depth=1.0, column=0):
    """Return 1 mm times exp(depth (s - at)^2) of one scaled parameter, and its gradient."""

    def value(s):
        return 1e-3 * np.exp(depth * (s[:, column] - at) ** 2)

    def gradient(s):
        return (value(s) * 2 * depth * (s[:, column] - at))[:, None] * np.eye(3)[column]

    return value, gradient


@pytest.mark.parametrize("radius", [0.45, 0.6, 0.75, 0.95])
def test_the_solution_lands_in_the_cups_middle(curved_model, radius):
    solution = plan_by_program(curved_model, radius)
    assert landing(curved_model, solution) == pytest.approx(radius, abs=1e-6)
    assert solution.reason.startswith("SNOPT reached the cup from ")
    assert solution.n_solutions >= 1


@pytest.mark.parametrize("solver", SOLVERS)
def test_it_tells_each_search_from_a_training_cast_to_its_end_the_chosen_one_first(curved_model, solver):
    solution = plan_by_program(curved_model, 0.75, solver=solver)
    assert 1 < len(solution.searches) <= N_STARTS
    starts, ends = (np.array([path[i] for path in solution.searches]) for i in (0, -1))
    known = curved_model.training_casts
    for start in starts:
        assert np.min(np.max(np.abs(known - start), axis=1)) < 1e-12
    np.testing.assert_allclose(ends[0], solution.parameters, atol=1e-6)
    assert len(np.unique(starts, axis=0)) == len(starts)
    for path in solution.searches:
        landing = curved_model.predict(path)[:, 0]
        assert abs(landing[-1] - 0.75) < min(1e-3, abs(landing[0] - 0.75))


# --- what is best: one term decides at a time


@pytest.mark.parametrize("at", [0.1, 0.4, 0.8])
def test_it_finds_the_cast_that_the_model_is_surest_of(make_model, at):
    # Speed and wait choose the landing, distance alone the model's error.
    model = make_model(along=(0.4, 0, 0.2, 0.2))
    model.std = valley(at)
    assert scaled(plan_by_program(model, 0.62).parameters)[0] == pytest.approx(at, abs=0.01)
    indifferent = plan_by_program(model, 0.62, without=("model error",))
    assert indifferent.parameters[0] in model.training_casts[:, 0]  # nothing moved it from its start


@pytest.mark.parametrize("steepest", [0.1, 0.3, 0.7])
def test_it_finds_the_steepest_entry(make_model, steepest):
    model = make_model(along=(0.4, 0, 0.2, 0.2), angle=(-steepest, 1, 0, 0))
    distance, speed, wait = scaled(plan_by_program(model, 0.66).parameters)
    assert distance == pytest.approx(steepest, abs=0.01)
    assert speed + wait == pytest.approx(1.3, abs=1e-6)


def test_an_uncertain_landing_is_weighed_against_a_flat_entry(make_model):
    # The probability is that of (30 mm - 20 mm / cos a) / std: steepest at 0.2, surest at 0.6, best between, where it is greatest.
    model = make_model(along=(0.4, 0, 0.2, 0.2), angle=(-0.2, 1, 0, 0))
    model.std = valley(0.6)
    at = np.linspace(0, 1, 100_001)
    little = (repeatability(Scenario()).swing * 0.6) ** 2
    moved = (0.2 * np.array([repeatability(Scenario()).speed, repeatability(Scenario()).wait])) / (UPPER - LOWER)[1:]
    std = np.sqrt((1e-3 * np.exp((at - 0.6) ** 2)) ** 2 + little + moved @ moved)
    best = at[np.argmax((0.03 - 0.02 / np.cos(at - 0.2)) / std)]
    assert 0.25 < best < 0.55
    assert scaled(plan_by_program(model, 0.62).parameters)[0] == pytest.approx(best, abs=0.005)


def test_it_finds_the_cast_that_noise_of_the_move_puts_off_least(make_model):
    # The landing is 0.4 + 0.6 d w in scaled distance and wait, off by about 0.6 hypot(w delta_d, d delta_w), least at
    # w delta_d = d delta_w, since their product is what the cup asks for.
    def along(s):
        return 0.4 + 0.6 * s[:, 0] * s[:, 2]

    def slope(s):
        return 0.6 * np.column_stack([s[:, 2], 0 * s[:, 0], s[:, 0]])

    model = make_model(scenario=NOISY)
    model.functions["along"] = along, slope
    model.know(model.training_casts)
    delta_d, _, delta_w = np.array([NOISY.noise.distance, NOISY.noise.speed, NOISY.noise.wait]) / (UPPER - LOWER)
    distance, _, wait = scaled(plan_by_program(model, 0.55).parameters)
    assert distance * wait == pytest.approx(0.25, abs=1e-5)
    assert distance == pytest.approx(math.sqrt(0.25 * delta_d / delta_w), abs=0.01)


def test_it_keeps_away_from_a_cliff_that_the_gradient_does_not_show(make_model):
    # The landing is flat but for a cliff at d = 0.5: within reach of the noise, which the gradient at d = 0.47 knows nothing of.
    def along(s):
        return 0.4 + 0.4 * s[:, 2] + 0.1 / (1 + np.exp(-(s[:, 0] - 0.5) / 0.001))

    def slope(s):
        rise = 1 / (1 + np.exp(-(s[:, 0] - 0.5) / 0.001))
        return np.column_stack([0.1 * rise * (1 - rise) / 0.001, 0 * s[:, 0], 0.4 + 0 * s[:, 0]])

    noise = Noise(distance=0.03 * (UPPER - LOWER)[0])
    known = LOWER + (UPPER - LOWER) * np.array([[0.47, 0.3, 0.5], [0.2, 0.3, 0.5]])
    model = make_model(scenario=Scenario(noise=noise), training_casts=known)
    model.functions["along"] = along, slope
    model.know(known)
    assert scaled(plan_by_program(model, 0.6).parameters)[0] < 0.44
    model.know(known[:1])
    assert scaled(plan_by_program(model, 0.6, without=("repeatability",)).parameters)[0] == pytest.approx(0.47)


def test_the_string_stays_slack(make_model):
    # Steep would be short of slack: the slack's limit decides, at 6 mm of a string of 0.6 m.
    model = make_model(along=(0.4, 0, 0.2, 0.2), angle=(0, 1, 0, 0), slack=(0.0, 0.02, 0, 0))
    assert scaled(plan_by_program(model, 0.6).parameters)[0] == pytest.approx(MIN_SLACK * 0.6 / 0.02, abs=1e-3)
    assert scaled(plan_by_program(model, 0.6, without=("slack",)).parameters)[0] < 0.05


@pytest.mark.parametrize("limit", ["peak_torque_utilization", "peak_velocity_utilization"])
def test_the_arm_keeps_a_margin_to_its_limits(make_model, limit):
    model = make_model(along=(0.4, 0, 0.2, 0.2), angle=(0.5, -0.5, 0, 0), **{limit: (0.7, 0.5, 0, 0)})
    assert scaled(plan_by_program(model, 0.6).parameters)[0] == pytest.approx((MAX_UTILIZATION - 0.7) / 0.5, abs=1e-3)
    assert scaled(plan_by_program(model, 0.6, without=("limits",)).parameters)[0] > 0.9


def test_a_cup_hardly_wider_than_the_ball_is_planned_for(make_model):
    # At most of the angles the ball is too wide for it: the clearance is negative, and its slope still leads to steep casts.
    scenario = Scenario.from_dict({"cup": {"inner_radius": 0.0201}})
    model = make_model(along=(0.4, 0, 0.2, 0.2), angle=(-0.3, 1, 0, 0), scenario=scenario)
    assert scaled(plan_by_program(model, 0.6).parameters)[0] == pytest.approx(0.3, abs=0.02)


# --- what is allowed


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
    solution = plan_by_program(model, 1.2, without=("repeatability",))  # out of reach: the search ends at the bound
    assert solution.parameters[0] == upper[0]
    assert is_allowed(scenario, solution.parameters)


@pytest.mark.parametrize("scenario", [Scenario(), NOISY, Scenario(noise=Noise(speed=1.0))])
def test_what_noise_makes_of_a_cast_stays_where_the_model_has_seen_casts(make_model, scenario):
    noise = repeatability(scenario)
    deviations = np.array([noise.distance, noise.speed, noise.wait]) / (UPPER - LOWER)
    margin = np.minimum(MARGIN_DEVIATIONS * deviations, MAX_MARGIN)
    model = make_model(along=(0.4, 0.2, 0.2, 0.2), scenario=scenario)
    for radius, corner in ((0.2, margin), (1.2, 1 - margin)):
        np.testing.assert_allclose(scaled(plan_by_program(model, radius).parameters), corner, atol=1e-6)


# --- several solutions


def test_of_several_solutions_the_one_of_least_cost_is_kept(make_model):
    # Two valleys of the model's error, and a training cast in either.
    def std(s):
        return 2e-3 - 1.6e-3 * np.exp(-(((s[:, 0] - 0.2) / 0.1) ** 2)) - 8e-4 * np.exp(-(((s[:, 0] - 0.8) / 0.1) ** 2))

    def slope(s):
        steps = [
            a * 2 * (s[:, 0] - c) / 0.01 * np.exp(-(((s[:, 0] - c) / 0.1) ** 2))
            for c, a in ((0.2, 1.6e-3), (0.8, 8e-4))
        ]
        return np.column_stack([sum(steps), 0 * s[:, 0], 0 * s[:, 0]])

    for order in (1, -1):
        known = LOWER + (UPPER - LOWER) * np.array([[0.22, 0.4, 0.5], [0.78, 0.4, 0.5]])[::order]
        model = make_model(along=(0.4, 0, 0, 0.4), training_casts=known)
        model.std = std, slope
        solution = plan_by_program(model, 0.6)
        assert scaled(solution.parameters)[0] == pytest.approx(0.2, abs=0.01)
        assert solution.n_solutions == 2
        assert "2 distinct solutions" in solution.reason


def test_a_solution_that_lands_is_kept_before_a_cheaper_one_that_does_not(make_model):
    # Near the base the ball always lands at one place, steeply; farther out it depends on the wait.
    def along(s):
        return np.where(s[:, 0] < 0.3, 0.4, 0.4 + 0.4 * s[:, 2])

    def along_slope(s):
        return np.column_stack([0 * s[:, 0], 0 * s[:, 0], np.where(s[:, 0] < 0.3, 0.0, 0.4)])

    model = make_model(training_casts=LOWER + (UPPER - LOWER) * np.array([[0.2, 0.4, 0.5], [0.7, 0.4, 0.5]]))
    model.functions["along"] = along, along_slope
    model.functions["angle"] = (lambda s: np.where(s[:, 0] < 0.3, 0.0, 0.5)), np.zeros_like
    solution = plan_by_program(model, 0.64)
    assert landing(model, solution) == pytest.approx(0.64, abs=1e-6)
    assert solution.reason.startswith("SNOPT reached the cup from 1 of 2 starts, with 1 distinct solution;")


def test_beyond_the_models_reach_it_says_so(make_model):
    solution = plan_by_program(make_model(along=(0.4, 0.1, 0.1, 0.1)), 1.0)
    assert solution.reason.startswith("SNOPT reached the cup from 0 of ")


def test_searches_start_from_training_casts_that_landed_nearby_and_are_not_alike(make_model):
    model = make_model()
    known = np.repeat(LOWER + (UPPER - LOWER) * np.array([[0.3, 0.4, 0.5], [0.5, 0.1, 0.5]]), 20, axis=0)
    model.know(known)
    solution = plan_by_program(model, 0.62)
    assert "of 2 starts" in solution.reason


@pytest.mark.parametrize("n_known", [1, 2, 5, 7])
def test_few_training_casts_are_enough(make_model, n_known):
    model = make_model()
    model.know(model.training_casts[:n_known])
    solution = plan_by_program(model, 0.75)
    assert landing(model, solution) == pytest.approx(0.75, abs=1e-6)


# --- solvers


@pytest.mark.parametrize("solver", SOLVERS)
@pytest.mark.parametrize("radius", [0.45, 0.75, 0.95])
def test_every_solver_finds_the_same_cast(curved_model, radius, solver):
    solution = plan_by_program(curved_model, radius, solver=solver)
    assert landing(curved_model, solution) == pytest.approx(radius, abs=1e-5)
    reference = plan_by_program(curved_model, radius)
    np.testing.assert_allclose(scaled(solution.parameters), scaled(reference.parameters), atol=0.01)
    assert solution.reason.startswith(f"{solver.upper()} reached the cup from {N_STARTS} of {N_STARTS} starts")


@pytest.mark.parametrize("solver", SOLVERS)
def test_every_solver_keeps_the_bounds_out_of_reach(make_model, solver):
    solution = plan_by_program(make_model(along=(0.4, 0.1, 0.1, 0.1)), 1.0, solver=solver)
    assert is_allowed(Scenario(), solution.parameters)
    assert solution.n_solutions == 0
    assert "starts, with 0 distinct solutions" in solution.reason


@pytest.mark.parametrize("solver", SOLVERS)
def test_solvers_repeat_to_the_last_digit(curved_model, solver):
    first, second = (plan_by_program(curved_model, 0.6, solver=solver) for _ in range(2))
    np.testing.assert_array_equal(first.parameters, second.parameters)
    assert first.n_evaluations == second.n_evaluations


def test_the_same_cup_gets_the_same_cast_whatever_was_planned_before(curved_model):
    first = plan_by_program(curved_model, 0.8)
    for radius in (0.5, 1.4, 0.9):
        plan_by_program(curved_model, radius)
    again = plan_by_program(curved_model, 0.8)
    np.testing.assert_array_equal(again.parameters, first.parameters)
    assert (again.n_evaluations, again.reason) == (first.n_evaluations, first.reason)


# --- the program itself


@pytest.mark.parametrize("without", [(), *((term,) for term in TERMS)])
@pytest.mark.parametrize("at", [(0.3, 0.6, 0.2), (0.9, 0.2, 0.7)])
def test_cost_and_constraints_carry_the_models_gradient(curved_model, without, at):
    curved_model.scenario = NOISY
    program = build_program(curved_model, 0.8, without=without).program
    at, h = np.array(at), 1e-6
    bindings = [*program.GetAllCosts(), *program.generic_constraints()]
    assert len(bindings) == 5 - 2 * ("limits" in without) - ("slack" in without)
    for binding in bindings:
        value = binding.evaluator().Eval(InitializeAutoDiff(at))
        difference = [
            (program.EvalBinding(binding, at + step) - program.EvalBinding(binding, at - step))[0] / (2 * h)
            for step in h * np.eye(3)
        ]
        np.testing.assert_allclose(ExtractGradient(value)[0], difference, rtol=1e-5, atol=1e-6)
        assert ExtractValue(value)[0, 0] == pytest.approx(program.EvalBinding(binding, at)[0])


def test_the_constraint_is_the_predicted_landing(curved_model):
    program = build_program(curved_model, 0.8).program
    at = np.array([0.3, 0.6, 0.2])
    along = curved_model.predict((LOWER + (UPPER - LOWER) * at)[np.newaxis])[0, 0]
    (value,) = program.EvalBinding(program.generic_constraints()[0], at)
    assert value == pytest.approx(along / LANDING_UNIT)
    assert program.generic_constraints()[0].evaluator().lower_bound() == pytest.approx(0.8 / LANDING_UNIT)


def test_the_chain_rule_is_applied_to_what_comes_in(curved_model):
    constraint = build_program(curved_model, 0.8).program.generic_constraints()[0]
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


def test_evaluations_are_counted_and_shared_by_cost_and_constraints(curved_model):
    solution = plan_by_program(curved_model, 0.8)
    assert solution.n_evaluations == sum(curved_model.calls[name] for name in ("linearize", "landing_with_gradient"))
    evaluator = build_program(curved_model, 0.8).evaluator
    at = np.array([0.3, 0.6, 0.2])
    evaluator.outputs(at)
    evaluator.outputs(at)
    assert evaluator.n_evaluations == 1
    evaluator.cost(at)
    assert evaluator.n_evaluations == 1 + N_SCATTER_CASTS
    evaluator.outputs(at + 1e-9)
    assert evaluator.n_evaluations == 2 + N_SCATTER_CASTS


def test_the_reason_names_the_solvers_result_and_what_the_plan_violates(curved_model, make_model):
    assert plan_by_program(curved_model, 0.8).reason.endswith("the best one: kSolutionFound")
    taut = make_model(along=(0.4, 0, 0.2, 0.2), slack=0.001)  # of no cast is the string slack
    solution = plan_by_program(taut, 0.6)
    assert "from 0 of 3 starts, with 0 distinct solutions" in solution.reason
    assert solution.reason.endswith(", against slack of the string, at least 6 mm")
    assert "kSolutionFound" not in solution.reason


@pytest.mark.parametrize("noise", [Noise(torque=0.01), Noise(encoder_counts=4096)])
@pytest.mark.parametrize("term", TERMS)
def test_noise_that_is_not_of_the_move_needs_no_term(curved_model, noise, term):
    curved_model.scenario = Scenario(noise=noise)
    solution = plan_by_program(curved_model, 0.8, without=(term,))
    assert landing(curved_model, solution) == pytest.approx(0.8, abs=1e-5)


@pytest.mark.parametrize("solver", ["snopt", "ipopt"])
def test_an_interruption_amid_the_search_is_one(curved_model, monkeypatch, solver):
    evaluate, asked = program._evaluate, []

    def interrupted(*given):
        asked.append(given)
        if len(asked) == 40:
            raise KeyboardInterrupt
        return evaluate(*given)

    monkeypatch.setattr(program, "_evaluate", interrupted)
    with pytest.raises(KeyboardInterrupt):
        plan_by_program(curved_model, 0.8, solver=solver)


@pytest.mark.parametrize("radius", [math.nan, math.inf])
def test_a_program_for_nowhere_is_refused(curved_model, radius):
    with pytest.raises(InputError, match=r"radius = (nan|inf) must be a finite number"):
        build_program(curved_model, radius)


def test_the_program_reads_as_what_it_is(curved_model):
    text = str(build_program(curved_model, 0.8).program)
    for part in (
        "bounds",
        "move duration",
        "landing in the cup's middle",
        "slack of the string",
        "torque utilization",
        "velocity utilization",
        "standard deviation by clearance, logarithm",
    ):
        assert part in text
    assert all(f"{name}(0)" in text for name in ("distance", "speed", "wait"))
