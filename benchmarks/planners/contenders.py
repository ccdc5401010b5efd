"""Who is compared: planners as they are, and black-box searches that ask the model or the simulator."""

from __future__ import annotations

import math
import time
from dataclasses import dataclass
from itertools import count
from typing import Literal, Protocol

import numpy as np

from planners.black_box import Objective, Search, search_cast
from wam_cast.cast import Cast
from wam_cast.planning.plan import Method, plan_cast
from wam_cast.planning.prediction import ACROSS, ALONG, Predictor
from wam_cast.scenario import Scenario
from wam_cast.simulation.simulator import simulate_cast
from wam_cast.types import Array

Source = Literal["model", "simulator"]
"""What a contender asks about casts."""


@dataclass(frozen=True)
class Choice:
    """A cast for a cup, how often the model or the simulator was asked for it, and the processor time that it took [s]."""

    cast: Cast
    n_evaluations: int
    seconds: float


class Contender(Protocol):
    """Chooses casts for cups. The cups are on the line y = 0, `radius` [m] from the base axis."""

    @property
    def method(self) -> str:
        """Its name."""

    @property
    def source(self) -> Source:
        """What it asks."""

    def choose(self, model: Predictor, radius: float, seed: int) -> Choice:
        """Return its cast for a cup; the simulator, if it asks that, is of the model's scenario."""


@dataclass(frozen=True)
class Planner:
    """A planner of the package; it stops when it likes."""

    method: Method
    source: Source = "model"

    def choose(self, model: Predictor, radius: float, seed: int) -> Choice:  # noqa: ARG002 - it draws nothing
        """Return the cast that it plans."""
        start = time.process_time()
        plan = plan_cast(model, (radius, 0.0), self.method)
        return Choice(plan.cast, plan.n_evaluations, time.process_time() - start)


@dataclass(frozen=True)
class Searcher:
    """A black-box search with a budget: how often it may ask."""

    method: Search
    source: Source
    budget: int

    def choose(self, model: Predictor, radius: float, seed: int) -> Choice:
        """Return the best cast that it asked about."""
        objective = (
            predicted_miss(model, radius) if self.source == "model" else executed_miss(model.scenario, radius, seed)
        )
        start = time.process_time()
        found = search_cast(self.method, model.scenario, objective, self.budget, seed=seed)
        seconds = time.process_time() - start
        return Choice(Cast.from_array(found.parameters), found.n_evaluations, seconds)


PLANNERS = (Planner("gradient"), Planner("program"))


MOST_BAYESIAN = 100
"""Evaluations of the model that Bayesian optimisation has at most: what each of them costs grows with their number cubed."""


def searchers(budget: int, n_casts: int) -> tuple[Searcher, ...]:
    """Return the searches with `budget` evaluations of the model, and those with `n_casts` simulated casts."""
    on_model = (
        Searcher("grid", "model", budget),
        Searcher("cma-es", "model", budget),
        Searcher("bayesian", "model", min(budget, MOST_BAYESIAN)),
    )
    on_simulator = (Searcher(method, "simulator", n_casts) for method in ("cma-es", "bayesian"))
    return (*on_model, *on_simulator)


def predicted_miss(model: Predictor, radius: float) -> Objective:
    """Return the distance of the predicted landing from a cup, as a function of casts."""

    def objective(casts: Array) -> Array:
        landing = model.predict(casts)[:, [ALONG, ACROSS]]
        return np.asarray(np.hypot(landing[:, 0] - radius, landing[:, 1]))

    return objective


def executed_miss(scenario: Scenario, radius: float, seed: int) -> Objective:
    """Return the distance of the simulated landing from a cup that is not there, as a function of casts; nan without a landing.

    If the scenario has noise, each cast has noise of its own, drawn from `seed`, `seed` + 1 and so on.
    """
    noise_seeds = count(seed)

    def objective(casts: Array) -> Array:
        outcomes = (simulate_cast(scenario, Cast.from_array(cast), noise_seed=next(noise_seeds)) for cast in casts)
        return np.array([math.dist(outcome.landing, (radius, 0.0)) for outcome in outcomes])

    return objective
