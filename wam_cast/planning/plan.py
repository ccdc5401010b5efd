"""Plan: a cast for a cup, and the planner that chooses it."""

from __future__ import annotations

from dataclasses import dataclass
from functools import partial
from typing import Literal, get_args

from wam_cast.cast import Cast, checked_cup
from wam_cast.deprecation import renamed
from wam_cast.errors import InputError, quoted
from wam_cast.parallel.threads import one_thread
from wam_cast.planning.cast_prediction import Prediction
from wam_cast.planning.free_ball import describe_hanging, describe_unreached
from wam_cast.planning.gradient_descent import plan_by_gradient_descent
from wam_cast.planning.landing_distribution import LandingStd
from wam_cast.planning.prediction import DirectedPredictor, Predictor
from wam_cast.planning.reach import Reach, checked_polar
from wam_cast.planning.solution import LONGEST_MISS, SOLVERS, Planner, Solver, checked_solution
from wam_cast.types import Array, Position, checks_types

Method = Literal["program", "gradient"]

METHODS: tuple[Method, ...] = get_args(Method)
"""Planners by name: `program` is a mathematical program, `gradient` the paper's descent."""

KNOWN_DEVIATIONS = 2.0
"""So many standard deviations of the model's own error must be within the cup's inner radius, or it does not know the cast: 95 % of
the errors are smaller. A ball may touch the rim and fall in all the same, one that lands beyond it does not."""


@dataclass(frozen=True, eq=False)
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
    predicted_std
        Predictive standard deviations of the landing along and across the casting plane [m]: the model's own error, and the
        scenario's noise of the move and the swing.
    predicted_entry_angle, predicted_entry_speed
        Of the ball at the rim plane: from the vertical [rad], and [m/s].
    predicted_slack
        Of the string from the landing on [m].
    predicted_peak_torque_utilization, predicted_peak_velocity_utilization
        The largest utilization of the motors' torque limits and of the joints' velocity limits, up to the end of the drop.
    rim_clear_probability
        That the ball enters the cup without touching its rim. It ends in the cup more often than that: most balls that
        touch the rim fall in all the same.
    is_feasible
        Whether the predicted miss is at most 1 cm, the string lets the ball rest in a cup there, and the model knows casts like
        this: two standard deviations of its own error are within the cup's inner radius.
    method
        Name of the planner; of a function its own.
    n_evaluations
        How many casts the planner asked the model about, with or without gradients; 0 if a function does not tell.
    n_solutions
        How many distinct casts the planner found that are predicted to land in the cup's middle; this is the best of them. The
        descent looks for one only.
    reason
        Why the planner stopped, in words; and if so, that the ball would hang in the cup, with what mends it, and that the model
        does not know such a cast.
    searches
        Of each search, that of this plan first: the casts `[distance, speed, wait]` [m, m/s, s] that it went through, from its
        start to its end, shape (n, 3). A solver's trials on the way count, the casts beside one that tell its slope do not.
        Empty if a function does not tell.
    """

    cup: Position
    cast: Cast
    predicted_landing: Array
    predicted_miss: float
    predicted_std: LandingStd
    predicted_entry_angle: float
    predicted_entry_speed: float
    predicted_slack: float
    predicted_peak_torque_utilization: float
    predicted_peak_velocity_utilization: float
    rim_clear_probability: float
    is_feasible: bool
    method: str
    n_evaluations: int
    n_solutions: int
    reason: str
    searches: tuple[Array, ...]

    predicted_spread = renamed("predicted_spread", "predicted_std")
    predicted_peak_load = renamed("predicted_peak_load", "predicted_peak_torque_utilization")
    predicted_peak_speed = renamed("predicted_peak_speed", "predicted_peak_velocity_utilization")
    clear_entry_probability = renamed("clear_entry_probability", "rim_clear_probability")


@checks_types
def plan_cast(
    model: Predictor, cup: Position, method: Method | Planner = "program", solver: Solver | None = None
) -> Plan:
    """Plan a cast into a cup.

    Parameters
    ----------
    model
        A forward model, such as `reference_model()`.
    cup
        World (x, y) of the cup's axis [m].
    method
        `program` or `gradient`, or a function `(model, radius) -> [distance, speed, wait]` [m, m/s, s] for a cup at `radius`
        [m] from the base axis. It returns an array of shape (3,), or a `.Solution`, which tells more.
    solver
        Of the program: `snopt`, which is the default, `ipopt` or `nlopt`.

    Raises
    ------
    InputError
        If the cup is not a pair of finite numbers or out of reach (the line names the nearest position within), if there is no
        such method or solver, or if a function returns what is no cast within the scenario's bounds.
    """
    cup = checked_cup(cup)
    name = _checked_name(method, solver)
    radius, bearing = checked_polar(Reach.of(model), cup, partial(describe_unreached, model))
    if isinstance(model, DirectedPredictor):
        model = model.toward(bearing)
    planner = _planner(method, solver)
    with one_thread():
        solution = checked_solution(planner(model, radius), model.scenario, name)
        prediction = Prediction.aimed(model, solution.parameters, cup)
        ignorance = _ignorance(model, solution.parameters)
    hanging = describe_hanging(model.scenario, prediction.cast.distance, radius)
    return Plan(
        cup,
        *prediction,
        is_feasible=prediction.miss <= LONGEST_MISS and not hanging and not ignorance,
        method=name,
        n_evaluations=solution.n_evaluations,
        n_solutions=solution.n_solutions,
        reason="; ".join(filter(None, (ignorance, solution.reason, hanging))),
        searches=solution.searches,
    )


def _ignorance(model: Predictor, parameters: Array) -> str:
    """Return a sentence if the model does not know where this cast lands, else nothing."""
    reach, radius = KNOWN_DEVIATIONS * model.linearize(parameters).std, model.scenario.cup.inner_radius
    if reach <= radius:
        return ""
    return (
        f"the model does not know casts like this: 95 % of them land within {1e3 * reach:.0f} mm of where it says, in a cup of "
        f"{1e3 * radius:.0f} mm inner radius; train it with more casts, or choose another cup"
    )


def _checked_name(method: Method | Planner, solver: Solver | None) -> str:
    """Return the planner's name, if there is such a planner and such a solver of it."""
    if not callable(method) and method not in METHODS:
        raise InputError(
            f"method: planner {quoted(method)} is not known: choose {' or '.join(METHODS)}, or give a function of model and radius"
        )
    name = getattr(method, "__name__", type(method).__name__) if callable(method) else method
    if solver is not None and method != "program":
        raise InputError(f"solver {quoted(solver)}: the planner {name!r} has none; leave it out, or plan by program")
    if solver not in (None, *SOLVERS):
        raise InputError(f"solver {quoted(solver)} is not known: choose {', '.join(SOLVERS)}")
    return name


def _planner(method: Method | Planner, solver: Solver | None) -> Planner:
    """Return the planner of that name, or the one that is given; only the program needs Drake."""
    if callable(method):
        return method
    if method == "gradient":
        return plan_by_gradient_descent
    from wam_cast.planning.program import plan_by_program

    return partial(plan_by_program, solver=solver or SOLVERS[0])
