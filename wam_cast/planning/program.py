"""The planner as a mathematical program: of all casts that land in the cup's middle, the one that most surely enters it.

Three parameters reach a target on a line, so a two-parameter family of casts hits the same cup. The program picks from it the cast
whose landing may be off by most standard deviations before the ball touches the rim (see `landing_distribution`), and that keeps
the string slack and the arm within its limits.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable
from dataclasses import dataclass
from typing import Any, Literal, NamedTuple, get_args

import numpy as np
from numpy.typing import NDArray
from pydrake.autodiffutils import ExtractGradient, ExtractValue, InitializeAutoDiff
from pydrake.solvers import IpoptSolver, MathematicalProgram, NloptSolver, SnoptSolver, SolverOptions
from scipy.special import expit

from wam_cast.cast import PARAMETERS, cast_bounds, nearest_allowed
from wam_cast.errors import InputError
from wam_cast.planning.free_ball import free_distances
from wam_cast.planning.landing_distribution import MIN_ENTRY_COSINE, N_SCATTER_CASTS, repeatability, scatter_of_move
from wam_cast.planning.prediction import (
    ALONG,
    ENTRY_ANGLE,
    PEAK_TORQUE_UTILIZATION,
    PEAK_VELOCITY_UTILIZATION,
    SLACK,
    Linearization,
    Predictor,
)
from wam_cast.planning.solution import Solution, Solver
from wam_cast.types import Array

Term = Literal["model error", "repeatability", "entry angle", "slack", "limits"]

TERMS: tuple[Term, ...] = get_args(Term)
"""What the program takes into account beside the landing."""

N_STARTS = 3
"""Searches, each from a training cast that lands near the cup."""

N_NEARBY = 24
"""Training casts among which the starts are chosen."""

MIN_START_DISTANCE = 0.15
"""Starts differ by more than this in at least one scaled parameter."""

MIN_SOLUTION_DISTANCE = 0.02
"""Solutions that differ by no more than this in any scaled parameter count as one."""

LANDING_UNIT = 0.01
"""A miss of this size [m] counts as much to the solver as its tolerances assume of 1."""

MAX_SOLUTION_MISS = 0.1 * LANDING_UNIT
"""A search reached the cup if its predicted landing is no farther from the middle [m]."""

CLEARANCE_SOFTNESS = 1e-3
"""Of the clearance [m]: above this it counts as it is, below it fades to nothing, but never quite."""

MARGIN_DEVIATIONS = 2.0
"""Standard deviations of the noise by which a cast keeps away from its bounds."""

MAX_MARGIN = 0.05
"""By how much it keeps away from them at most, in scaled parameters."""

MIN_SLACK = 0.01
"""Of the string from the landing on, as a share of its length: twice what counts as slack."""

MAX_UTILIZATION = 0.98
"""Of a motor's torque limit and of a joint's velocity limit, by a plan."""

MAX_ITERATIONS = 40
"""Of a solver from one start."""

CONSTRAINT_TOLERANCE = 1e-3
"""By how much a solution may violate a constraint, in the units that the solver sees: 0.01 mm of the landing."""

OPTIMALITY_TOLERANCE = 1e-4
"""To which a solver's optimum holds, in the units of cost and constraint."""

_SOLVERS: dict[Solver, type[SnoptSolver] | type[IpoptSolver] | type[NloptSolver]] = {
    "snopt": SnoptSolver,
    "ipopt": IpoptSolver,
    "nlopt": NloptSolver,
}
_OPTIONS: dict[Solver, dict[str, float]] = {
    "snopt": {"Major iterations limit": MAX_ITERATIONS, "Major optimality tolerance": OPTIMALITY_TOLERANCE},
    # Left to its own tolerance, IPOPT goes on long after it has found the optimum.
    "ipopt": {"max_iter": MAX_ITERATIONS, "tol": OPTIMALITY_TOLERANCE, "constr_viol_tol": 1e-6},
    "nlopt": {"max_eval": 2 * MAX_ITERATIONS, "constraint_tol": 1e-6, "xtol_rel": 1e-5, "xtol_abs": 1e-5},
}


@dataclass(frozen=True)
class CastProgram:
    """The program for one cup, built but not solved: print `program` to read it.

    Its `decision`, shape (3,), is distance, speed and wait, each scaled to [0, 1] between its bounds.
    """

    program: MathematicalProgram
    decision: NDArray[np.object_]
    evaluator: Evaluator


class Evaluator:
    """The model at scaled parameters, with derivatives by them, for cost and constraints.

    It remembers the last point, which they share, counts the casts that it asks about, and keeps those of a search in `visited`.
    """

    def __init__(self, model: Predictor, terms: frozenset[Term]) -> None:
        self._model, self._terms = model, terms
        self._scenario = model.scenario
        self._noise = repeatability(model.scenario)
        self.lower, upper = cast_bounds(model.scenario)
        self.span = upper - self.lower
        self.n_evaluations = 0
        self.visited: list[Array] = []
        self._last_key = b""
        self._last: Linearization

    def cast(self, scaled: Array) -> Array:
        """Return `[distance, speed, wait]` of scaled parameters, each of shape (3,)."""
        return self.lower + self.span * scaled

    @property
    def margin(self) -> Array:
        """By how much scaled parameters keep away from their bounds, beyond which the model has seen no cast, shape (3,)."""
        if "repeatability" not in self._terms:
            return np.zeros(3)
        deviations = np.array([self._noise.distance, self._noise.speed, self._noise.wait])
        return np.minimum(MARGIN_DEVIATIONS * deviations / self.span, MAX_MARGIN)

    def free_distances(self, radius: float) -> tuple[float, float]:
        """Return between which scaled distances the ball is free in a cup at `radius` [m]; they keep the margin, as bounds do."""
        margin = float(self.margin[0])
        least, greatest = (np.array(free_distances(self._scenario, radius)) - self.lower[0]) / self.span[0]
        inward = min(margin, (greatest - least) / 2)
        least, greatest = np.clip([least + inward, greatest - inward], margin, 1.0 - margin)
        return float(least), float(greatest)

    def outputs(self, scaled: Array) -> tuple[Array, Array]:
        """Return the prediction, shape (7,), and its derivative by `scaled`, shape (7, 3)."""
        linearization = self._linearize(scaled)
        return linearization.outputs, linearization.gradient * self.span

    def cost(self, scaled: Array) -> tuple[Array, Array]:
        """Return the logarithm of the landing's standard deviation by the clearance, shape (1,), and its derivative, (1, 3)."""
        linearization = self._linearize(scaled)
        variance, slope = (self._noise.swing * self._scenario.string.length) ** 2, np.zeros(3)
        if "model error" in self._terms:
            variance += linearization.std**2
            slope += 2 * linearization.std * linearization.std_gradient
        if "repeatability" in self._terms:
            mean_square, gradient = scatter_of_move(self._model, self.cast(scaled), self._noise)
            self.n_evaluations += N_SCATTER_CASTS
            variance += mean_square
            slope += gradient
        clearance, clearance_slope = self._clearance(linearization)
        value = 0.5 * math.log(variance) - math.log(clearance)
        value_slope = (slope / (2 * variance) - clearance_slope / clearance) * self.span
        return np.array([value]), value_slope[np.newaxis]

    def _clearance(self, linearization: Linearization) -> tuple[float, Array]:
        """Return by how much the landing may be off along the casting plane [m], smooth and positive, and its derivative."""
        cup, ball = self._scenario.cup.inner_radius, self._scenario.ball.radius
        angle = float(linearization.outputs[ENTRY_ANGLE]) if "entry angle" in self._terms else 0.0
        cosine = max(math.cos(angle), MIN_ENTRY_COSINE)
        slope = -ball * math.sin(angle) / cosine**2 if cosine > MIN_ENTRY_COSINE else 0.0
        exact = (cup - ball / cosine) / CLEARANCE_SOFTNESS
        soft = CLEARANCE_SOFTNESS * float(np.logaddexp(0.0, exact))
        return soft, slope * expit(exact) * linearization.gradient[ENTRY_ANGLE]

    def _linearize(self, scaled: Array) -> Linearization:
        key = scaled.tobytes()
        if key != self._last_key:
            self.n_evaluations += 1
            self.visited.append(self.cast(scaled))
            self._last_key, self._last = key, self._model.linearize(self.visited[-1])
        return self._last


def build_program(model: Predictor, radius: float, *, without: tuple[Term, ...] = ()) -> CastProgram:
    """Return the program for a cup at `radius` [m]; leave terms out to see what they are for.

    Raises
    ------
    InputError
        If the radius is not a finite number.
    """
    if not math.isfinite(radius):
        raise InputError(f"radius = {radius} must be a finite number: the cup's distance from the base axis in metres")
    terms = frozenset(TERMS) - frozenset(without)
    scenario, evaluator = model.scenario, Evaluator(model, terms)
    program = MathematicalProgram()
    decision = np.array([program.NewContinuousVariables(1, name)[0] for name in PARAMETERS])
    margin = evaluator.margin
    program.AddBoundingBoxConstraint(margin, 1.0 - margin, decision).evaluator().set_description("bounds")
    least, greatest = evaluator.free_distances(radius)
    free = program.AddBoundingBoxConstraint(least, greatest, decision[0])
    free.evaluator().set_description("string long enough for the ball to rest in the cup")
    # distance >= speed * min_move_duration, in scaled variables
    shortest = scenario.motion.min_move_duration
    row = np.array([[evaluator.span[0], -shortest * evaluator.span[1], 0.0]])
    offset = shortest * evaluator.lower[1] - evaluator.lower[0]
    duration = program.AddLinearConstraint(row, np.array([offset]), np.array([np.inf]), decision)
    duration.evaluator().set_description("move duration")

    def constrain(description: str, column: int, unit: float, least: float, greatest: float) -> None:
        def value(scaled: NDArray[Any]) -> NDArray[Any]:
            return _evaluate(evaluator.outputs, scaled, slice(column, column + 1)) / unit

        bounds = np.array([least / unit]), np.array([greatest / unit])
        program.AddConstraint(value, *bounds, decision, description)

    constrain(f"landing in the cup's middle, at {radius:.4g} m", ALONG, LANDING_UNIT, radius, radius)
    if "slack" in terms:
        slack = MIN_SLACK * scenario.string.length
        constrain(f"slack of the string, at least {1e3 * slack:.3g} mm", SLACK, LANDING_UNIT, slack, np.inf)
    if "limits" in terms:
        for name, column in (("torque", PEAK_TORQUE_UTILIZATION), ("velocity", PEAK_VELOCITY_UTILIZATION)):
            words = f"{name} utilization, at most {MAX_UTILIZATION:.0%}"
            constrain(words, column, 1.0, -np.inf, MAX_UTILIZATION)
    words = "standard deviation by clearance, logarithm"
    program.AddCost(lambda scaled: _evaluate(evaluator.cost, scaled, slice(1))[0], decision, words)
    return CastProgram(program, decision, evaluator)


def _evaluate(function: Callable[[Array], tuple[Array, Array]], scaled: NDArray[Any], rows: slice) -> NDArray[Any]:
    """Return some rows of a function's value as Drake asks for it: of floats, or with derivatives by the chain rule."""
    if scaled.dtype == float:
        return function(scaled)[0][rows]
    value, gradient = function(ExtractValue(scaled).ravel())
    return np.asarray(InitializeAutoDiff(value[rows], gradient[rows] @ ExtractGradient(scaled)).ravel())


def plan_by_program(
    model: Predictor, radius: float, *, solver: Solver = "snopt", without: tuple[Term, ...] = ()
) -> Solution:
    """Return the parameters of the best cast that is predicted to land at `radius` [m].

    The program is solved from several training casts that land nearby, and the best solution is kept.
    """
    built = build_program(model, radius, without=without)
    evaluator = built.evaluator
    searches = [_search(built, start, radius, solver) for start in _starts(model, evaluator, radius)]
    # Solutions that land come first, of these the ones that keep most constraints, and of these the one of least cost.
    searches.sort(key=lambda one: one[:3])
    best = searches[0]
    landing = [one.scaled for one in searches if not one.misses and not one.violated]
    n_distinct = len(_distinct(landing, MIN_SOLUTION_DISTANCE))
    reason = (
        f"{solver.upper()} reached the cup from {len(landing)} of {len(searches)} starts, "
        f"with {n_distinct} distinct solution{'' if n_distinct == 1 else 's'}; the best one: {best.result}"
    )
    if best.violated:
        reason += f", against {', '.join(best.violated)}"
    # The solver keeps its constraints up to a tolerance.
    parameters = nearest_allowed(model.scenario, evaluator.cast(best.scaled))
    paths = tuple(one.path for one in searches)
    return Solution(parameters, evaluator.n_evaluations, reason, paths, n_distinct)


class _Search(NamedTuple):
    """Where a search ended: off the cup or not, violations, cost, scaled parameters, what it violates, why it ended, its path."""

    misses: bool
    n_violated: int
    cost: float
    scaled: Array
    violated: tuple[str, ...]
    result: str
    path: Array


def _search(built: CastProgram, start: Array, radius: float, solver: Solver) -> _Search:
    """Solve the program from `start`, in scaled parameters."""
    program, evaluator, engine = built.program, built.evaluator, _SOLVERS[solver]()
    options = SolverOptions()
    for name, value in _OPTIONS[solver].items():
        options.SetOption(engine.solver_id(), name, value)
    evaluator.visited = [evaluator.cast(start)]
    try:
        result = engine.Solve(program, start, options)
    except RuntimeError as error:  # SNOPT's, of whatever Python raises while it is asked, an interruption too
        if "KeyboardInterrupt" in str(error):
            raise KeyboardInterrupt from None
        raise
    # NLopt gives no numbers where there is no solution.
    scaled = result.GetSolution(built.decision)
    scaled = np.clip(scaled if np.all(np.isfinite(scaled)) else start, 0.0, 1.0)
    misses = not abs(evaluator.outputs(scaled)[0][ALONG] - radius) <= MAX_SOLUTION_MISS
    violated = tuple(
        binding.evaluator().get_description()
        for binding in program.GetAllConstraints()
        if not program.CheckSatisfied(binding, scaled, CONSTRAINT_TOLERANCE)
    )
    cost = float(evaluator.cost(scaled)[0][0])
    why, path = result.get_solution_result().name, np.array(evaluator.visited)
    return _Search(misses, len(violated), cost, scaled, violated, why, path)


def _starts(model: Predictor, evaluator: Evaluator, radius: float) -> list[Array]:
    """Return training casts, in scaled parameters, of those that landed near `radius`: the best first, and none like another.

    Casts that leave the ball hanging in a cup there are taken where there are no others.
    """
    is_free = model.scenario.tether.leaves_free(model.training_casts[:, 0], radius)
    known = is_free if np.any(is_free) else ~is_free
    nearby = np.argsort(np.abs(model.training_outputs[known, ALONG] - radius), kind="stable")[:N_NEARBY]
    scaled = (model.training_casts[known][nearby] - evaluator.lower) / evaluator.span
    order = np.argsort([evaluator.cost(one)[0][0] for one in scaled], kind="stable")
    return _distinct(scaled[order], MIN_START_DISTANCE)[:N_STARTS]


def _distinct(points: Iterable[Array], distance: float) -> list[Array]:
    """Return the points that are farther than `distance` from every one kept before them, in at least one coordinate."""
    kept: list[Array] = []
    for point in points:
        if all(np.max(np.abs(point - other)) > distance for other in kept):
            kept.append(point)
    return kept
