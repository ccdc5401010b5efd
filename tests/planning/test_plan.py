"""Plans: what is refused, the geometry of the casting plane, and casts that are executed."""

import math
from dataclasses import fields, replace
from functools import partial

import numpy as np
import pytest

from wam_cast.arm.arm_model import arm_model
from wam_cast.cast import is_allowed
from wam_cast.casting_plane import to_casting_plane
from wam_cast.errors import InputError
from wam_cast.learning.reference import reference_model
from wam_cast.planning.gradient_descent import plan_by_gradient_descent
from wam_cast.planning.plan import METHODS, plan_cast
from wam_cast.planning.program import plan_by_program
from wam_cast.planning.reach import BEARING_MARGIN
from wam_cast.planning.solution import LONGEST_MISS
from wam_cast.scenario import Arm, Scenario
from wam_cast.simulation.simulator import simulate_cast

BOTH = pytest.mark.parametrize("method", METHODS)
# The same where casts are simulated, which takes its time.
EACH = pytest.mark.parametrize(
    "method", [pytest.param(method, marks=[] if method == "program" else pytest.mark.slow) for method in METHODS]
)

CUPS = [(0.30, 0.0), (-0.2, 0.5), (0.65, -0.35), (-0.5, -0.6), (0.95, 0.1)]
"""In front, beside and behind, near and far."""


def refused(model, cup, method="gradient"):
    with pytest.raises(InputError) as caught:
        plan_cast(model, cup, method)
    assert "\n" not in str(caught.value)
    assert not model.calls, "a cup that is refused costs nothing"
    return str(caught.value)


# --- what is refused


@pytest.mark.parametrize("cup", [(0.19, 0.0), (1.6, 0.0), (0.0, 0.0), (1.2, 1.2), (-1.2, -1.2), (0.1, -0.1)])
def test_a_cup_out_of_reach_is_refused_with_what_is_reachable(make_model, cup):
    line = refused(make_model(), cup)
    assert "0.200 to 1.500 m" in line
    assert f"{math.hypot(*cup):.4g} m" in line


def test_what_the_error_calls_reachable_is_reachable(make_model):
    model = make_model(reach=(0.26311, 0.98584))
    words = refused(model, (0.263, 0.0)).split("from ")[-1].split()
    nearest, farthest = float(words[0]), float(words[2])
    assert (nearest, farthest) == (0.264, 0.985)
    for radius in (nearest, farthest, 0.26311, 0.98584):
        assert plan_cast(model, (radius, 0.0), "gradient").cup == (radius, 0.0)


def test_a_cup_behind_the_arm_is_refused_with_the_bearings_that_are_left(make_model):
    line = refused(make_model(), (-0.7, 0.01))
    assert "joint 1" in line
    lowest, highest = (float(word) for word in line.split("one from ")[1].split(" degrees")[0].split(" to "))
    for degrees in (lowest, highest):
        bearing = math.radians(degrees)
        assert arm_model(Arm()).bearing_limits[0] <= bearing <= arm_model(Arm()).bearing_limits[1]
        cup = (0.7 * math.cos(bearing), 0.7 * math.sin(bearing))
        assert plan_cast(make_model(), cup, "gradient").cast.bearing == pytest.approx(bearing)
    assert highest == pytest.approx(math.degrees(arm_model(Arm()).bearing_limits[1] - BEARING_MARGIN), abs=0.1)


@pytest.mark.parametrize("cup", [(math.nan, 0.5), (0.5, math.inf), (-math.inf, 0.0)])
def test_a_cup_that_is_nowhere_is_refused(make_model, cup):
    assert "finite" in refused(make_model(), cup)


@pytest.mark.parametrize("cup", [0.7, None, (0.7,), (0.7, 0.0, 0.12), "here", (None, 0.1), ("a", "b"), [[0.7, 0.0]]])
def test_what_is_no_position_is_refused(make_model, cup):
    assert "pair (x, y)" in refused(make_model(), cup)


@pytest.mark.parametrize("method", ["", "Program", "newton", None])
def test_an_unknown_planner_is_refused_with_the_valid_names(make_model, method):
    line = refused(make_model(), (0.7, 0.0), method)
    assert repr(method) in line
    assert "program or gradient, or give a function" in line


# --- the plan


@BOTH
@pytest.mark.parametrize("share", [0.99, 1.01])
def test_a_cast_that_the_model_does_not_know_is_not_feasible(make_model, method, share):
    # Two standard deviations that reach just to the cup's inner radius, or just beyond it.
    plan = plan_cast(make_model(std=share * Scenario().cup.inner_radius / 2), (0.7, 0.0), method)
    assert plan.predicted_miss < 0.01
    assert plan.is_feasible == (share < 1)
    assert ("the model does not know casts like this: 95 % of them land within 30 mm" in plan.reason) == (share > 1)


@BOTH
@pytest.mark.parametrize("bearing", [-2.5, -1.0, 0.3, 1.7])
def test_a_turned_cup_takes_the_same_cast_turned(curved_model, method, bearing):
    ahead = plan_cast(curved_model, (0.75, 0.0), method)
    turned = plan_cast(curved_model, (0.75 * math.cos(bearing), 0.75 * math.sin(bearing)), method)
    np.testing.assert_allclose(turned.cast.to_array(), ahead.cast.to_array(), atol=1e-4)
    assert turned.cast.bearing == pytest.approx(ahead.cast.bearing + bearing)
    assert turned.predicted_miss == pytest.approx(ahead.predicted_miss, abs=1e-6)
    assert turned.predicted_entry_angle == pytest.approx(ahead.predicted_entry_angle, abs=1e-4)
    assert ahead.cast.bearing == 0.0


@BOTH
@pytest.mark.parametrize("across", [-0.06, 0.04])
def test_a_landing_beside_the_casting_plane_is_made_up_for_by_the_bearing(make_model, method, across):
    model = make_model(across=across)
    plan = plan_cast(model, (0.0, 0.7), method)
    along = model.predict(plan.cast.to_array()[np.newaxis])[0, 0]
    assert plan.cast.bearing == pytest.approx(math.pi / 2 - math.atan2(across, along))
    # The predicted landing is what the model says of that cast, turned into the world: on the line through the cup.
    assert to_casting_plane(plan.predicted_landing, plan.cast.bearing) == pytest.approx((along, across))
    assert plan.predicted_landing[0] == pytest.approx(0.0, abs=1e-12)
    assert plan.predicted_miss == pytest.approx(abs(math.hypot(along, across) - 0.7))


@BOTH
def test_the_predicted_miss_is_the_distance_from_the_cup(curved_model, method):
    plan = plan_cast(curved_model, (0.5, -0.4), method)
    assert plan.predicted_miss == pytest.approx(math.dist(plan.predicted_landing, plan.cup), rel=1e-12)
    assert plan.is_feasible is (plan.predicted_miss <= LONGEST_MISS) is True
    assert plan.method == method
    assert plan.cup == (0.5, -0.4)
    assert plan.n_evaluations > 0
    along, across, angle, *_ = curved_model.predict(plan.cast.to_array()[np.newaxis])[0]
    assert np.linalg.norm(plan.predicted_landing) == pytest.approx(math.hypot(along, across))
    assert plan.predicted_entry_angle == angle


@BOTH
def test_a_cup_that_no_cast_reaches_gives_a_plan_that_says_so(make_model, method):
    model = make_model(along=(0.4, 0.1, 0.1, 0.1))  # lands from 0.4 to 0.7 m
    plan = plan_cast(model, (1.0, 0.0), method)
    assert not plan.is_feasible
    assert plan.predicted_miss == pytest.approx(0.3, abs=0.01)
    assert is_allowed(model.scenario, plan.cast.to_array())


@BOTH
def test_a_cup_given_as_an_array_is_as_good(curved_model, method):
    assert plan_cast(curved_model, np.array([0.6, 0.2]), method).cup == (0.6, 0.2)
    assert all(type(value) is float for value in plan_cast(curved_model, np.array([0.6, 0.2]), method).cup)


# --- planners of one's own

PLANNERS = {"program": plan_by_program, "gradient": plan_by_gradient_descent}


def assert_same(plan, other):
    """Compare plans bit for bit."""
    for field in fields(plan):
        np.testing.assert_equal(getattr(plan, field.name), getattr(other, field.name), field.name)


@BOTH
@pytest.mark.parametrize("cup", [(0.75, 0.0), (0.5, -0.4), (-0.3, 0.5)])
def test_a_function_that_finds_what_a_named_planner_finds_yields_its_plan(curved_model, method, cup):
    named = plan_cast(curved_model, cup, method)

    def my_planner(model, radius):
        return PLANNERS[method](model, radius)

    assert_same(plan_cast(curved_model, cup, my_planner), replace(named, method="my_planner"))

    def my_cast(model, radius):
        return PLANNERS[method](model, radius).parameters

    untold = {"n_evaluations": 0, "n_solutions": 1, "searches": (), "reason": "the planner gives no reason"}
    assert_same(plan_cast(curved_model, cup, method=my_cast), replace(named, method="my_cast", **untold))


def test_a_function_is_asked_once_about_the_cups_distance_from_the_base_axis(curved_model):
    asked = []

    def ask(model, radius):
        asked.append((model, radius))
        return [0.3, 0.6, 0.1]

    plan = plan_cast(curved_model, (-0.3, 0.4), ask)
    assert asked == [(curved_model, pytest.approx(0.5))]
    assert plan.cast.to_array().tolist() == [0.3, 0.6, 0.1]
    assert plan.is_feasible is (plan.predicted_miss <= LONGEST_MISS) is False


class Fixed:
    """A planner with state: it always chooses the same cast."""

    def __init__(self, parameters):
        self.parameters = parameters

    def __call__(self, model, radius):
        return self.parameters

    def choose(self, model, radius):
        return self.parameters


@pytest.mark.parametrize(
    ("planner", "name"),
    [
        (Fixed([0.3, 0.6, 0.1]), "Fixed"),
        (Fixed([0.3, 0.6, 0.1]).choose, "choose"),
        (lambda model, radius: (0.3, 0.6, 0.1), "<lambda>"),
        (partial(plan_by_gradient_descent, tolerance=1e-3), "partial"),
        (plan_by_program, "plan_by_program"),
    ],
)
def test_whatever_can_be_called_plans_under_its_own_name(curved_model, planner, name):
    assert plan_cast(curved_model, (0.6, 0.2), planner).method == name


@pytest.mark.parametrize("found", [None, [0.3, 0.6], [0.3, math.nan, 0.1], [0.9, 0.6, 0.1], [0.1, 0.8, 0.1]])
def test_a_function_that_finds_no_cast_of_the_scenario_is_refused_by_its_name(curved_model, found):
    with pytest.raises(InputError, match=r"^planner 'Fixed' (returned|chose) "):
        plan_cast(curved_model, (0.6, 0.0), Fixed(found))


def test_a_function_is_not_asked_about_a_cup_out_of_reach(make_model):
    def fail(model, radius):
        raise AssertionError

    assert "out of reach" in refused(make_model(), (1.6, 0.0), fail)


def test_what_a_function_raises_comes_through(make_model):
    with pytest.raises(ZeroDivisionError):
        plan_cast(make_model(), (0.7, 0.0), lambda model, radius: 1 / 0)


# --- plans of the reference model


@BOTH
def test_all_of_the_reach_is_planned_for(method):
    model = reference_model()
    for radius in np.linspace(*model.reach, 7):
        plan = plan_cast(model, (radius, 0.0), method)
        assert plan.is_feasible, radius
        assert is_allowed(model.scenario, plan.cast.to_array())


def caught(method, scenario):
    """Return the cups that a planner's casts end in."""
    plans = [plan_cast(reference_model(), cup, method) for cup in CUPS]
    return [plan.cup for plan in plans if simulate_cast(scenario, plan.cast, plan.cup).is_caught]


@pytest.mark.slow
@EACH
def test_planned_casts_are_caught(method):
    assert caught(method, Scenario()) == CUPS


@pytest.mark.slow
def test_steep_casts_into_the_cups_middle_are_caught_even_by_a_lively_cup(lively_cup):
    assert caught("program", Scenario.from_dict({"cup": lively_cup})) == CUPS


@pytest.mark.slow
def test_the_papers_planner_may_lose_a_ball_to_a_lively_rim(lively_cup):
    # It stops a centimetre from the middle, all the room that the ball has, and comes in as it may.
    assert len(caught("gradient", Scenario.from_dict({"cup": lively_cup}))) >= len(CUPS) - 1


@EACH
def test_planned_casts_land_where_they_were_predicted(method):
    # Without a cup, whose rim may turn aside a ball that comes in at a slant; and but for one straight ahead: turns take long.
    for cup in CUPS:
        plan = plan_cast(reference_model(), cup, method)
        cast = plan.cast if cup == CUPS[1] else replace(plan.cast, bearing=0.0)
        landing = to_casting_plane(simulate_cast(Scenario(), cast).landing, cast.bearing)
        assert math.dist(landing, to_casting_plane(plan.predicted_landing, plan.cast.bearing)) < 0.005, cup


def test_a_solver_that_is_none_is_refused(curved_model):
    with pytest.raises(InputError, match="solver 'gurobi' is not known: choose snopt, ipopt, nlopt"):
        plan_cast(curved_model, (0.6, 0.0), solver="gurobi")


def test_the_descent_has_no_solver(curved_model):
    with pytest.raises(InputError, match="solver 'ipopt': the planner 'gradient' has none"):
        plan_cast(curved_model, (0.6, 0.0), "gradient", "ipopt")


@pytest.mark.parametrize("solver", ["ipopt", "gurobi"])
def test_a_function_has_no_solver(curved_model, solver):
    with pytest.raises(InputError, match=f"solver '{solver}': the planner 'Fixed' has none; leave it out"):
        plan_cast(curved_model, (0.6, 0.0), Fixed([0.3, 0.6, 0.1]), solver)
