"""A ball that the string leaves free: every planner's casts, the plans' words, and the cups that are out of reach for it."""

import re

import numpy as np
import pytest

from wam_cast.cast import nearest_allowed
from wam_cast.errors import InputError
from wam_cast.planning.free_ball import describe_hanging, describe_unreached, free_distances
from wam_cast.planning.gradient_descent import plan_by_gradient_descent
from wam_cast.planning.plan import plan_cast
from wam_cast.planning.program import build_program, plan_by_program
from wam_cast.planning.solution import SOLVERS
from wam_cast.scenario import Noise, Scenario

SHORT = Scenario.from_dict({"string": {"length": 0.40}})
REMEDY = "a longer string (string.length), a deeper drop (motion.drop_distance) or a nearer cup mends it"

LANDING = (0.4, 0.0, 0.3, 0.3)
"""Speed and wait choose the landing, so that any distance does for most cups."""


@pytest.mark.parametrize("length", [0.36, 0.40, 0.45, 0.60])
@pytest.mark.parametrize("radius", [0.2, 0.45, 0.7, 0.95, 1.4])
def test_the_free_distances_are_all_of_the_bounds_that_leave_the_ball_free(length, radius):
    scenario = Scenario.from_dict({"string": {"length": length}})
    least, greatest = free_distances(scenario, radius)
    distances = np.linspace(*scenario.bounds.distance, 701)
    free = distances[scenario.tether.leaves_free(distances, radius)]
    expected = (free[0], free[-1]) if len(free) else scenario.bounds.distance
    assert (least, greatest) == pytest.approx(expected, abs=5.1e-4)


@pytest.mark.parametrize("noise", [Noise(), Noise.typical()])
@pytest.mark.parametrize("angle", [(0.3, 0.5, 0, 0), (0.8, -0.5, 0, 0)])
@pytest.mark.parametrize("solver", SOLVERS)
def test_the_program_keeps_to_the_distances_that_leave_the_ball_free(make_model, solver, angle, noise):
    # Steepest at one end of the bounds, where the ball would hang.
    scenario = SHORT.model_copy(update={"noise": noise})
    model = make_model(along=LANDING, angle=angle, scenario=scenario)
    for radius in np.linspace(0.45, 0.75, 7):
        cast = plan_by_program(model, radius, solver=solver).parameters
        assert scenario.tether.leaves_free(cast[0], radius), radius
        assert model.predict(cast[np.newaxis])[0, 0] == pytest.approx(radius, abs=1e-4)
        least, greatest = free_distances(scenario, radius)
        assert (
            least + 1.9 * noise.distance <= cast[0] <= greatest - 1.9 * noise.distance
        )  # what noise makes of it is free too


def test_the_program_says_what_it_bounds_the_distance_by(make_model):
    built = build_program(make_model(along=LANDING, scenario=SHORT), 0.7)
    found = [b for b in built.program.GetAllConstraints() if "rest in the cup" in b.evaluator().get_description()]
    (binding,) = found
    least, greatest = SHORT.tether.distances(0.7)
    ends = built.evaluator.cast(np.array([binding.evaluator().lower_bound()[0], 0, 0]))[0], greatest
    assert ends == pytest.approx((least, greatest), abs=1e-3)
    assert least > SHORT.bounds.distance[0]


def test_a_search_starts_from_casts_that_leave_the_ball_free(make_model):
    lower, upper = (np.array(bound) for bound in zip(*[bounds for _, bounds in SHORT.bounds], strict=True))
    known = lower + (upper - lower) * np.array([[0.05, 0.5, 0.5], [0.07, 0.52, 0.48], [0.9, 0.2, 0.2]])
    model = make_model(along=LANDING, scenario=SHORT, training_casts=known)
    radius = 0.7  # where the first two land, and would leave the ball hanging
    start = plan_by_program(model, radius).searches[0][0]
    np.testing.assert_allclose(start, known[2])


@pytest.mark.parametrize("radius", [0.45, 0.6, 0.75])
def test_the_descent_keeps_to_the_distances_that_leave_the_ball_free(make_model, radius):
    model = make_model(along=(0.2, 0.6, 0.3, 0.3), scenario=SHORT)
    solution = plan_by_gradient_descent(model, radius)
    (path,) = solution.searches
    assert SHORT.tether.leaves_free(path[:, 0], radius).all()


def test_where_no_distance_leaves_the_ball_free_the_plan_says_so_and_what_mends_it(make_model):
    model = make_model(along=(0.7, 0, 0.3, 0.3), scenario=SHORT)
    for method in ("program", "gradient"):
        plan = plan_cast(model, (0.95, 0.0), method)
        assert plan.predicted_miss < 0.011  # it lands
        assert not plan.is_feasible
        assert "the ball would hang in a taut string" in plan.reason
        assert plan.reason.endswith(REMEDY)
        assert "\n" not in plan.reason


def test_a_planner_of_ones_own_that_leaves_the_ball_hanging_is_told(make_model):
    model = make_model(along=LANDING, scenario=SHORT)
    lower, upper = SHORT.bounds.distance
    least, greatest = SHORT.tether.distances(0.7)
    assert lower < least < upper < greatest
    for distance, is_free in ((least - 0.01, False), (least - 1e-3, False), (least + 1e-3, True), (upper, True)):
        plan = plan_cast(model, (0.7, 0.0), lambda *_, distance=distance: [distance, 0.53, 0.25])
        assert plan.predicted_miss < 0.01
        assert plan.is_feasible is is_free
        assert ("hang" in plan.reason) is not is_free
    near, beyond = describe_hanging(SHORT, least - 0.01, 0.7), describe_hanging(SHORT, 0.4, 0.3)
    assert re.search(r"ends 0\.228 m from the cup's axis, where the string reaches the bottom from 0\.218 m", near)
    assert "nearer cup" in near
    assert "farther cup" in beyond


def test_a_cup_that_is_out_of_reach_for_the_string_is_refused_with_that_reason(make_model):
    # All that lands beyond 0.8 m comes from a hand that is too near.
    scenario, known = SHORT, np.array([[0.05 + 0.002 * i, 0.5, 0.25] for i in range(60)])
    model = make_model(along=(0.5, 1.5, 0, 0), scenario=scenario, training_casts=known, reach=(0.5, 0.6))
    with pytest.raises(InputError) as caught:
        plan_cast(model, (0.9, 0.0))
    line = str(caught.value)
    assert f"out of reach (casts that land there leave the ball hanging in a taut string; {REMEDY}): choose a" in line
    assert "\n" not in line
    for radius in (0.3, 1.4):  # where nothing lands at all
        assert describe_unreached(model, radius) == ""
        with pytest.raises(InputError, match="out of reach: choose"):
            plan_cast(model, (radius, 0.0))


def test_a_cup_that_is_out_of_reach_for_another_reason_is_refused_without(make_model):
    model = make_model(along=LANDING, reach=(0.5, 0.6))
    with pytest.raises(InputError, match="out of reach: choose"):
        plan_cast(model, (0.65, 0.0))


@pytest.mark.parametrize("is_descent", [pytest.param(True, marks=pytest.mark.slow), False])
def test_random_scenarios_planned_for_at_random_are_free_or_told(make_model, is_descent):
    rng = np.random.default_rng(3)

    def draw(model, _):
        return nearest_allowed(model.scenario, rng.uniform((0.05, 0.21, 0), (0.4, 0.85, 0.5)))

    n_free = n_told = 0
    for _ in range(100):
        length, drop = rng.uniform(0.38, 0.6), rng.uniform(0.42, 0.55)
        scenario = Scenario.from_dict({"string": {"length": length}, "motion": {"drop_distance": drop}})
        model = make_model(along=(0.3, rng.uniform(0, 0.6), rng.uniform(0.1, 0.4), 0.2), scenario=scenario)
        radius = rng.uniform(0.4, 1.1)
        plan = plan_cast(model, (radius, 0.0), "gradient" if is_descent else draw)
        is_free = bool(scenario.tether.leaves_free(plan.cast.distance, radius))
        assert ("hang" not in plan.reason) is is_free
        assert plan.is_feasible is (plan.predicted_miss <= 0.01 and is_free)
        # The descent leaves the ball hanging only where the bounds hold no other cast.
        distances = np.linspace(*scenario.bounds.distance, 351)
        assert is_free or not is_descent or not scenario.tether.leaves_free(distances, radius).any()
        n_free, n_told = n_free + is_free, n_told + (not is_free)
    assert min(n_free, n_told) > 10
