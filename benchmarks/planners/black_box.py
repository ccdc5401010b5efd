"""Searches that know nothing of what they minimise: what the planners, which know the model's gradient, are compared with.

Each looks for the allowed cast of least miss with a given number of evaluations. What a cast misses by is the caller's to say: a
forward model's prediction, or a simulation.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any, Literal, get_args

import numpy as np

from wam_cast.cast import cast_at
from wam_cast.errors import InputError, checked_integer
from wam_cast.scenario import Scenario
from wam_cast.types import Array

Objective = Callable[[Array], Array]
"""Misses [m], shape (n,), of casts `[distance, speed, wait]`, shape (n, 3); not finite where a cast failed."""

Search = Literal["grid", "cma-es", "bayesian"]

SEARCHES: tuple[Search, ...] = get_args(Search)
"""Searches by name."""

FAILED = 1.0
"""What a failed cast counts as [m]: more than any other cast of the reference scenario misses a cup within reach by."""

FIRST_STEP = 0.3
"""Standard deviation of CMA-ES's first generation, in the unit cube: it spans most of it."""

N_FIRST = 8
"""Random casts that Bayesian optimisation starts from, two for each length scale and the height of its prior."""


@dataclass(frozen=True, eq=False)
class Found:
    """What a search found.

    Attributes
    ----------
    parameters
        The cast of least miss `[distance, speed, wait]`, shape (3,).
    trace
        The least miss so far after each evaluation [m], shape (n_evaluations,).
    """

    parameters: Array
    trace: Array

    @property
    def miss(self) -> float:
        """What the objective said of it [m]; `FAILED` if every cast failed."""
        return float(self.trace[-1])

    @property
    def n_evaluations(self) -> int:
        """How many casts the objective was asked about."""
        return len(self.trace)


def search_cast(method: Search, scenario: Scenario, objective: Objective, budget: int, *, seed: int = 0) -> Found:
    """Return the cast of least miss that a search finds.

    Every cast that the objective is asked about keeps the scenario's bounds and the shortest duration of a move.

    Parameters
    ----------
    method
        `grid`: a regular grid of as many points as the budget allows. `cma-es`: from the middle, and from somewhere else each
        time it has converged. `bayesian`: expected improvement by a Gaussian process.
    scenario
        Says which casts are allowed.
    objective
        What is minimised; asked about several casts at once where the method allows it.
    budget
        Casts that it may be asked about. A grid may leave some of them unused, the others use all.
    seed
        Of all that is random; a grid is not.

    Raises
    ------
    InputError
        If there is no such method, its package is not installed, or budget or seed are no integers from 1 and from 0 on.
    """
    searches: dict[str, Callable[[_Evaluations, int], None]]
    searches = {"grid": _search_grid, "cma-es": _search_cma_es, "bayesian": _search_bayesian}
    if method not in searches:
        raise InputError(f"search {method!r} is not known: choose {', '.join(SEARCHES)}")
    budget = checked_integer("budget", budget, 1)
    evaluations = _Evaluations(scenario, objective, budget)
    searches[method](evaluations, checked_integer("seed", seed, 0))
    return evaluations.found()


class _Evaluations:
    """The objective over the unit cube, each point of which is an allowed cast; remembers all that it was asked."""

    def __init__(self, scenario: Scenario, objective: Objective, budget: int) -> None:
        self._scenario = scenario
        self._objective = objective
        self._budget = budget
        self._casts: list[Array] = []
        self._misses: list[float] = []

    @property
    def left(self) -> int:
        """How many evaluations are left."""
        return self._budget - len(self._misses)

    def __call__(self, points: Sequence[Array] | Array) -> Array:
        """Return the misses [m], shape (n,), of points of the cube, shape (n, 3), no more than are left."""
        casts = np.array([cast_at(self._scenario, point) for point in points])
        misses = np.asarray(self._objective(casts), dtype=float)
        misses = np.where(np.isfinite(misses), misses, FAILED)
        self._casts.extend(casts)
        self._misses.extend(misses.tolist())
        return misses

    def found(self) -> Found:
        """Return the best of all, the first one if there are several."""
        best = int(np.argmin(self._misses))
        return Found(self._casts[best], np.minimum.accumulate(self._misses))


def _search_grid(evaluate: _Evaluations, _: int) -> None:
    """Evaluate the middles of equal cells of the cube, the most along the speed, the least along the distance."""
    n_distance, n_wait, n_speed = grid_shape(evaluate.left)
    axes = [(np.arange(n) + 0.5) / n for n in (n_distance, n_speed, n_wait)]
    evaluate(np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1).reshape(-1, 3))


def grid_shape(budget: int) -> tuple[int, int, int]:
    """Return the sides, ascending, of the largest grid of at most `budget` points with no side more than twice another."""
    shapes = [
        (n, m, min(budget // (n * m), 2 * n))
        for n in range(1, math.isqrt(budget) + 1)
        for m in range(n, math.isqrt(budget // n) + 1)
    ]
    return max(shapes, key=lambda shape: (math.prod(shape), shape))


def _search_cma_es(evaluate: _Evaluations, seed: int) -> None:
    """Run CMA-ES (Hansen and Ostermeier 2001) with the package's population; anew from a random place once it has converged."""
    try:
        from cmaes import CMA
    except ImportError:
        raise _missing("cma-es", "cmaes") from None
    rng = np.random.default_rng(seed)
    cube = np.array([[0.0, 1.0]] * 3)
    mean = np.full(3, 0.5)
    while evaluate.left:
        strategy = CMA(mean, FIRST_STEP, bounds=cube, seed=int(rng.integers(2**32)))
        while evaluate.left and not strategy.should_stop():
            points = [strategy.ask() for _ in range(min(strategy.population_size, evaluate.left))]
            misses = evaluate(points)
            if len(points) == strategy.population_size:  # else the budget is used up
                strategy.tell(list(zip(points, misses.tolist(), strict=True)))
        mean = rng.uniform(size=3)


def _search_bayesian(evaluate: _Evaluations, seed: int) -> None:
    """Evaluate random casts, then each time the one of largest expected improvement (Jones et al. 1998)."""
    try:
        from bayes_opt import BayesianOptimization
        from bayes_opt.acquisition import ExpectedImprovement
    except ImportError:
        raise _missing("bayesian", "bayesian-optimization") from None
    axes = ("x", "y", "z")
    optimizer = BayesianOptimization(
        None,
        dict.fromkeys(axes, (0.0, 1.0)),
        acquisition_function=ExpectedImprovement(xi=0.0),
        random_state=int(np.random.default_rng(seed).integers(2**32)),
        verbose=0,
    )

    def random_point() -> dict[str, Any]:
        return dict(optimizer.random_sample()[0])

    for i in range(evaluate.left):
        point = random_point() if i < N_FIRST else optimizer.suggest()
        if optimizer.space.params_to_array(point) in optimizer.space:
            # It is sure of the best cast. The package takes no cast twice.
            point = random_point()
        (miss,) = evaluate([np.array([float(point[axis]) for axis in axes])])
        optimizer.register(point, -float(miss))


def _missing(method: str, package: str) -> InputError:
    return InputError(f"the search {method!r} needs the package {package}: pip install 'wam-cast[comparison]'")
