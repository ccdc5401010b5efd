"""The planner as a mathematical program: of all casts that land in the cup's middle, the one that most surely enters it.

Three parameters reach a target on a line, so a two-parameter family of casts hits the same cup. The program picks from it the cast
whose landing may be off by most standard deviations before the ball touches the rim, see `chance`, and that keeps the string
slack and the arm within its limits.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any, Literal, NamedTuple, get_args

import numpy as np
from pydrake.autodiffutils import ExtractGradient, ExtractValue, InitializeAutoDiff
from pydrake.solvers import IpoptSolver, MathematicalProgram, NloptSolver, SnoptSolver, SolverOptions
from scipy.special import expit

from wam_cast.cast import PARAMETERS, cast_bounds, nearest_allowed
from wam_cast.errors import InputError
from wam_cast.planning.landing_distribution import N_SCATTER_CASTS, STEEP, repeatability, scatter_of_move
from wam_cast.planning.plan import Solution, Solver
from wam_cast.planning.prediction import (
    ALONG,
    ENTRY_ANGLE,
    PEAK_LOAD,
    PEAK_SPEED,
    SLACK,
    Expansion,
    Predictor,
)
from wam_cast.types import Array

Term = Literal["model error", "repeatability", "entry angle", "slack", "limits"]

TERMS: tuple[Term, ...] = get_args(Term)
"""What the program takes into account beside the landing."""

N_STARTS = 3
"""Searches, each from a known cast that lands near the cup."""

N_NEARBY = 24
"""Known casts among which the starts are chosen."""

START_DISTANCE = 0.15
"""By how much starts differ at least in one of the scaled parameters."""

LANDING_UNIT = 0.01
"""A miss of this size [m] counts as much to the solver as its tolerances assume of 1."""

CLEARANCE_SOFTNESS = 1e-3
"""Of the clear offset [m]: above this it counts as it is, below it fades to nothing, but never quite."""

BOUNDS_DEVIATIONS = 2.0
"""Standard deviations of the noise by which a cast keeps away from its bounds."""

LARGEST_MARGIN = 0.05
"""The same at most, in scaled parameters."""

LEAST_SLACK = 0.01
"""Of the string from the landing on, as a share of its length: twice what counts as slack."""

LARGEST_SHARE = 0.98
"""Of a motor's torque or a joint's speed limit that a plan may use."""

SAME_SOLUTION = 0.02
"""Solutions that are closer than this in every scaled parameter count as one."""

MAX_ITERATIONS = 40
"""Of a solver from one start."""

SATISFIED = 1e-3
"""By how much a solution may violate a constraint, in the units that the solver sees: 0.01 mm of the landing."""

TOLERANCE = 1e-4
"""To which a solver's optimum holds, in the units of cost and constraint."""

_SOLVERS: dict[Solver, tuple[Any, dict[str, float]]] = {
    "snopt": (
        SnoptSolver,
        {"Major iterations limit": MAX_ITERATIONS, "Major optimality tolerance": TOLERANCE},
    ),
    # Left to its own tolerance, IPOPT goes on long after it has found the optimum.
    "ipopt": (IpoptSolver, {"max_iter": MAX_ITERATIONS, "tol": TOLERANCE, "constr_viol_tol": 1e-6}),
    "nlopt": (
        NloptSolver,
        {"max_eval": 2 * MAX_ITERATIONS, "constraint_tol": 1e-6, "xtol_rel": 1e-5, "xtol_abs": 1e-5},
    ),
}
"""Solvers by name, with their options."""


@dataclass(frozen=True)
class CastProgram:
    """The program for one cup, built but not solved: print `program` to read it.

    Attributes
    ----------
    program
        A Drake `MathematicalProgram`.
    decision
        Its variables: distance, speed and wait, each scaled to [0, 1] between its bounds.
    evaluator
        Evaluates the model for cost and constraints; counts how often, and keeps where.
    """

    program: Any
    decision: Any
    evaluator: Evaluator


class Evaluator:
    """The model at scaled parameters, with derivatives by them; remembers the last point, which cost and constraints share."""

    def __init__(self, model: Predictor, terms: frozenset[Term]) -> None:
        self._model, self._terms = model, terms
        self._scenario = model.scenario
        self._noise = repeatability(model.scenario)
        self.lower, upper = cast_bounds(model.scenario)
        self.span = upper - self.lower
        self.n_evaluations = 0
        self.visited: list[Array] = []
        self._last: tuple[bytes, Any] = (b"", None)

    @property
    def margin(self) -> Array:
        """By how much scaled parameters keep away from their bounds, beyond which the model has seen no cast, shape (3,)."""
        if "repeatability" not in self._terms:
            return np.zeros(3)
        deviations = np.array([self._noise.distance, self._noise.speed, self._noise.wait])
        return np.minimum(BOUNDS_DEVIATIONS * deviations / self.span, LARGEST_MARGIN)

    def outputs(self, scaled: Array) -> tuple[Array, Array]:
        """Return the prediction, shape (7,), and its derivative by `scaled`, shape (7, 3)."""
        expansion = self._expand(scaled)
        return expansion.outputs, expansion.gradient * self.span

    def log_spread(self, scaled: Array) -> tuple[Array, Array]:
        """Return the logarithm of the spread's share of the clear offset, shape (1,), and its derivative, (1, 3)."""
        expansion = self._expand(scaled)
        variance, slope = (self._noise.swing * self._scenario.string.length) ** 2, np.zeros(3)
        if "model error" in self._terms:
            variance += expansion.std**2
            slope += 2 * expansion.std * expansion.std_gradient
        if "repeatability" in self._terms:
            mean_square, gradient = scatter_of_move(self._model, self.lower + self.span * scaled, self._noise)
            self.n_evaluations += N_SCATTER_CASTS
            variance += mean_square
            slope += gradient
        clear, clear_slope = self._clear_offset(expansion)
        value = 0.5 * math.log(variance) - math.log(clear)
        return np.array([value]), ((slope / (2 * variance) - clear_slope / clear) * self.span)[np.newaxis]

    def _clear_offset(self, expansion: Expansion) -> tuple[float, Array]:
        """Return by how much the landing may be off along the casting plane [m], smooth and positive, and its derivative."""
        cup, ball = self._scenario.cup.inner_radius, self._scenario.ball.radius
        angle = float(expansion.outputs[ENTRY_ANGLE]) if "entry angle" in self._terms else 0.0
        cosine = max(math.cos(angle), STEEP)
        slope = -ball * math.sin(angle) / cosine**2 if cosine > STEEP else 0.0
        clear = (cup - ball / cosine) / CLEARANCE_SOFTNESS
        soft = CLEARANCE_SOFTNESS * float(np.logaddexp(0.0, clear))
        return soft, slope * expit(clear) * expansion.gradient[ENTRY_ANGLE]

    def _expand(self, scaled: Array) -> Expansion:
        key = scaled.tobytes()
        if key != self._last[0]:
            self.n_evaluations += 1
            cast = self.lower + self.span * scaled
            self.visited.append(cast)
            self._last = key, self._model.expand(cast)
        expansion: Expansion = self._last[1]
        return expansion


def build_program(model: Predictor, radius: float, *, without: tuple[Term, ...] = ()) -> CastProgram:
    """Return the program for a cup at `radius` [m]; leave terms out to see what they are for.

    Raises
    ------
    InputError
        If the radius is not a finite number.
    """
    if not math.isfinite(radius):
        raise InputError(
            f"radius = {radius} must be a finite number: the cup's distance from the base axis in metres"
        )
    terms = frozenset(TERMS) - frozenset(without)
    scenario, evaluator = model.scenario, Evaluator(model, terms)
    program = MathematicalProgram()
    decision = np.array([program.NewContinuousVariables(1, name)[0] for name in PARAMETERS])
    bounds = program.AddBoundingBoxConstraint(evaluator.margin, 1.0 - evaluator.margin, decision)
    bounds.evaluator().set_description("bounds")
    # distance >= speed * min_move_duration, in scaled variables
    shortest = scenario.motion.min_move_duration
    row = np.array([[evaluator.span[0], -shortest * evaluator.span[1], 0.0]])
    offset = shortest * evaluator.lower[1] - evaluator.lower[0]
    program.AddLinearConstraint(row, [offset], [np.inf], decision).evaluator().set_description(
        "move duration"
    )

    def constrain(name: str, column: int, unit: float, low: float, high: float) -> None:
        def value(scaled: Any) -> Any:
            return _carry(evaluator.outputs, scaled, slice(column, column + 1)) / unit

        bound = program.AddConstraint(value, lb=[low / unit], ub=[high / unit], vars=decision)
        bound.evaluator().set_description(name)

    constrain(f"landing in the cup's middle, at {radius:.4g} m", ALONG, LANDING_UNIT, radius, radius)
    if "slack" in terms:
        least = LEAST_SLACK * scenario.string.length
        constrain(f"slack of the string, at least {1e3 * least:.3g} mm", SLACK, LANDING_UNIT, least, np.inf)
    if "limits" in terms:
        constrain(
            f"motors' torque, at most {LARGEST_SHARE:.0%} of the limits",
            PEAK_LOAD,
            1.0,
            -np.inf,
            LARGEST_SHARE,
        )
        constrain(
            f"joints' speed, at most {LARGEST_SHARE:.0%} of the limits",
            PEAK_SPEED,
            1.0,
            -np.inf,
            LARGEST_SHARE,
        )
    cost = program.AddCost(lambda scaled: _carry(evaluator.log_spread, scaled, slice(1))[0], vars=decision)
    cost.evaluator().set_description("spread by clear offset, logarithm")
    return CastProgram(program, decision, evaluator)


def _carry(function: Any, scaled: Any, rows: slice) -> Any:
    """Return some rows of a function's value as Drake asks for it: of floats, or with derivatives by the chain rule."""
    if scaled.dtype == float:
        return function(scaled)[0][rows]
    value, gradient = function(ExtractValue(scaled).ravel())
    return InitializeAutoDiff(value[rows], gradient[rows] @ ExtractGradient(scaled)).ravel()


def plan_by_program(
    model: Predictor, radius: float, *, solver: Solver = "snopt", without: tuple[Term, ...] = ()
) -> Solution:
    """Return the parameters of the best cast that is predicted to land at `radius` [m].

    The program is solved from several known casts that land nearby, and the best solution is kept.
    """
    built = build_program(model, radius, without=without)
    evaluator = built.evaluator
    make_solver, values = _SOLVERS[solver]
    options = SolverOptions()
    for name, value in values.items():
        options.SetOption(make_solver.id(), name, value)
    found: list[_Found] = []
    for start in _starts(model, evaluator, radius):
        evaluator.visited = [evaluator.lower + evaluator.span * start]
        result = make_solver().Solve(built.program, start, options)
        # NLopt gives no numbers where there is no solution.
        scaled = result.GetSolution(built.decision)
        scaled = np.clip(scaled if np.all(np.isfinite(scaled)) else start, 0.0, 1.0)
        misses = not abs(evaluator.outputs(scaled)[0][ALONG] - radius) <= 0.1 * LANDING_UNIT
        violated = tuple(
            binding.evaluator().get_description()
            for binding in built.program.GetAllConstraints()
            if not built.program.CheckSatisfied(binding, scaled, SATISFIED)
        )
        cost = float(evaluator.log_spread(scaled)[0][0])
        why, path = result.get_solution_result().name, np.array(evaluator.visited)
        found.append(_Found(bool(misses), len(violated), cost, scaled, violated, why, path))
    # Solutions that land come first, of these the ones that keep most constraints, and of these the one of least cost.
    found.sort(key=lambda one: one[:3])
    best = found[0]
    landing = [one.scaled for one in found if not one.misses and not one.violated]
    n_distinct = _count_distinct(landing)
    reason = (
        f"{solver.upper()} reached the cup from {len(landing)} of {len(found)} starts, "
        f"with {n_distinct} distinct solution{'' if n_distinct == 1 else 's'}; the best one: {best.result}"
    )
    if best.violated:
        reason += f", against {', '.join(best.violated)}"
    # The solver keeps its constraints up to a tolerance.
    parameters = nearest_allowed(model.scenario, evaluator.lower + evaluator.span * best.scaled)
    searches = tuple(one.path for one in found)
    return Solution(parameters, evaluator.n_evaluations, reason, searches, n_distinct)


class _Found(NamedTuple):
    """Where a solver ended: off the cup or not, violations, cost, scaled parameters, what it violates, why it ended, its way."""

    misses: bool
    n_violated: int
    cost: float
    scaled: Array
    violated: tuple[str, ...]
    result: str
    path: Array


def _count_distinct(solutions: list[Array]) -> int:
    """Return how many of the solutions, in scaled parameters, are not like one before them."""
    distinct: list[Array] = []
    for solution in solutions:
        if all(np.max(np.abs(solution - other)) > SAME_SOLUTION for other in distinct):
            distinct.append(solution)
    return len(distinct)


def _starts(model: Predictor, evaluator: Evaluator, radius: float) -> list[Array]:
    """Return known casts, in scaled parameters, of those that landed near `radius`: the best first, and none like another."""
    nearby = np.argsort(np.abs(model.known_outputs[:, ALONG] - radius), kind="stable")[:N_NEARBY]
    scaled = (model.known_casts[nearby] - evaluator.lower) / evaluator.span
    order = np.argsort([evaluator.log_spread(one)[0][0] for one in scaled], kind="stable")
    starts: list[Array] = []
    for one in scaled[order]:
        if all(np.max(np.abs(one - other)) > START_DISTANCE for other in starts):
            starts.append(one)
    return starts[:N_STARTS]
