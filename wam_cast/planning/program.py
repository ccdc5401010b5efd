"""The planner as a mathematical program: of all casts that land in the cup's middle, one that enters it steeply.

Three parameters reach a target on a line, so a two-parameter family of casts hits the same cup. What is left to choose is how
the ball comes in (the steeper, the wider the cup is for it) and how far the cast is from the edge of the bounds, where the
model has training casts on one side only and errs most.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray
from pydrake.autodiffutils import ExtractGradient, ExtractValue, InitializeAutoDiff
from pydrake.solvers import IpoptSolver, MathematicalProgram, NloptSolver, SnoptSolver, SolverOptions

from wam_cast.cast import cast_bounds, nearest_allowed
from wam_cast.planning.plan import Predictor, Solution, Solver

Array = NDArray[np.float64]

N_STARTS = 6
"""Searches, each from a known cast that lands near the cup."""

LANDING_UNIT = 0.01
"""A miss of this size [m] counts as much to the solver as its tolerances assume of 1."""

EDGE_WEIGHT = 0.2
"""Cost [rad^2] of a parameter at its bound, as much as an entry angle of 26 degrees."""


SAME_SOLUTION = 0.02
"""Solutions that are closer than this in every scaled parameter count as one."""

MAX_ITERATIONS = 60
"""Of a solver from one start."""

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
        Evaluates the model for costs and constraints; counts how often.
    """

    program: Any
    decision: Any
    evaluator: _Evaluator


class _Evaluator:
    """The model at scaled parameters, with its derivatives; remembers the last point, which cost and constraint share."""

    def __init__(self, model: Predictor) -> None:
        self._model = model
        self.lower, upper = cast_bounds(model.scenario)
        self.span = upper - self.lower
        self.n_evaluations = 0
        self._last: tuple[bytes, Array, Array] = (b"", np.empty(0), np.empty(0))

    def __call__(self, scaled: Array) -> tuple[Array, Array]:
        """Return landing along, across [m] and entry angle [rad], shape (3,), and their derivative by `scaled`, (3, 3)."""
        key = scaled.tobytes()
        if key != self._last[0]:
            self.n_evaluations += 1
            parameters = (self.lower + self.span * scaled)[np.newaxis]
            prediction, gradient = self._model.predict_with_gradient(parameters)
            self._last = key, prediction[0], gradient[0] * self.span
        return self._last[1], self._last[2]

    def output(self, index: int, scaled: Any) -> Any:
        """Return one output as Drake asks for it: of floats, or with derivatives carried by automatic differentiation."""
        if scaled.dtype == float:
            return self(scaled)[0][index]
        value, gradient = self(ExtractValue(scaled).ravel())
        inner = ExtractGradient(scaled)
        return InitializeAutoDiff(value[index : index + 1], gradient[index : index + 1] @ inner)[0, 0]


def build_program(model: Predictor, radius: float) -> CastProgram:
    """Return the program for a cup at `radius` [m]: the predicted landing in its middle, the entry steep, the bounds far."""
    scenario, evaluator = model.scenario, _Evaluator(model)
    program = MathematicalProgram()
    decision = program.NewContinuousVariables(3, "cast")
    program.AddBoundingBoxConstraint(0.0, 1.0, decision).evaluator().set_description("bounds")
    # distance >= speed * min_move_duration, in scaled variables
    shortest = scenario.motion.min_move_duration
    row = np.array([[evaluator.span[0], -shortest * evaluator.span[1], 0.0]])
    offset = shortest * evaluator.lower[1] - evaluator.lower[0]
    program.AddLinearConstraint(row, [offset], [np.inf], decision).evaluator().set_description(
        "move duration"
    )
    landing = program.AddConstraint(
        lambda scaled: np.array([(evaluator.output(0, scaled) - radius) / LANDING_UNIT]),
        lb=[0.0],
        ub=[0.0],
        vars=decision,
    )
    landing.evaluator().set_description("landing in the cup's middle")
    cost = program.AddCost(lambda scaled: evaluator.output(2, scaled) ** 2, vars=decision)
    cost.evaluator().set_description("entry angle squared")
    edge = program.AddCost(EDGE_WEIGHT * sum((2 * scaled - 1) ** 8 for scaled in decision))
    edge.evaluator().set_description("closeness to the bounds")
    return CastProgram(program, decision, evaluator)


def plan_by_program(model: Predictor, radius: float, *, solver: Solver = "snopt") -> Solution:
    """Return the parameters of the best cast that is predicted to land at `radius` [m].

    The program is solved from several known casts that land nearby, and the best solution is kept.
    """
    built = build_program(model, radius)
    evaluator = built.evaluator
    make_solver, values = _SOLVERS[solver]
    options = SolverOptions()
    for name, value in values.items():
        options.SetOption(make_solver.id(), name, value)
    found: list[tuple[bool, float, Array]] = []
    for start in _starts(model, radius):
        result = make_solver().Solve(built.program, (start - evaluator.lower) / evaluator.span, options)
        scaled = np.clip(result.GetSolution(built.decision), 0.0, 1.0)
        misses = not abs(evaluator(scaled)[0][0] - radius) <= 0.1 * LANDING_UNIT
        found.append((bool(misses), result.get_optimal_cost(), scaled))
    # Solutions that land come first, and of these the one of least cost.
    _, _, scaled = min(found, key=lambda solution: solution[:2])
    landing = [solution for misses, _, solution in found if not misses]
    n_distinct = _count_distinct(landing)
    reason = (
        f"{solver.upper()} reached the cup from {len(landing)} of {len(found)} starts, "
        f"with {n_distinct} distinct solution{'' if n_distinct == 1 else 's'}"
    )
    # The solver keeps its constraints up to a tolerance.
    parameters = nearest_allowed(model.scenario, evaluator.lower + evaluator.span * scaled)
    return Solution(parameters, evaluator.n_evaluations, reason, n_distinct)


def _count_distinct(solutions: list[Array]) -> int:
    """Return how many of the solutions, in scaled parameters, are not like one before them."""
    distinct: list[Array] = []
    for solution in solutions:
        if all(np.max(np.abs(solution - other)) > SAME_SOLUTION for other in distinct):
            distinct.append(solution)
    return len(distinct)


def _starts(model: Predictor, radius: float) -> Array:
    """Return known casts, shape (n, 3), spread over those that are predicted to land near `radius`, the steepest first."""
    prediction = model.predict(model.known_casts)
    nearby = np.argsort(np.abs(prediction[:, 0] - radius), kind="stable")[: 5 * N_STARTS]
    steepest = nearby[np.argsort(np.abs(prediction[nearby, 2]), kind="stable")]
    return model.known_casts[steepest[:: max(1, len(steepest) // N_STARTS)][:N_STARTS]]
