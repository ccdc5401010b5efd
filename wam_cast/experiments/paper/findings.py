"""All that a run of the experiment has found, and its `results.json`."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

from wam_cast.experiments.paper.results import (
    Comparison,
    Execution,
    LandingMap,
    LearningCurves,
    NoiseStudy,
    Samples,
    Selection,
)
from wam_cast.experiments.paper.settings import Settings
from wam_cast.planning.plan import METHODS, Method

PAPERS_PLANNER: Method = "gradient"

PLANNERS: tuple[Method, ...] = (
    PAPERS_PLANNER,
    *(planner for planner in METHODS if planner != PAPERS_PLANNER),
)
"""The paper's first."""

TEST_ROWS = (
    "isotropic",
    "ard",
    "polynomial_12",
    "polynomial_best",
    "gaussian_process",
    "neural_network",
    "nearest_neighbour",
    "constant",
    "isotropic_by_validation",
)
"""Estimators whose test RMSE stands in `results.json` at the top."""


@dataclass(frozen=True)
class Findings:
    """What each phase found, and the settings that led there."""

    settings: Settings
    samples: Samples
    selection: Selection
    comparison: Comparison
    learning_curves: LearningCurves
    landing_map: LandingMap
    executions: tuple[Execution, ...]
    noise: NoiseStudy

    @property
    def execution(self) -> Execution:
        """That of the paper's planner."""
        return next(one for one in self.executions if one.planner == PAPERS_PLANNER)

    def summary(self) -> dict[str, Any]:
        """Return the main numbers."""
        execution = self.execution
        return {
            "seed": self.settings.seed,
            "versions": self.settings.versions,
            "fingerprint": self.settings.scenario.fingerprint,
            "n_train": self.samples.n_train,
            "n_validation": self.samples.n_validation,
            "n_test": self.samples.n_test,
            "sigma": self.selection.isotropic.sigma[0],
            "sigma_by_validation": self.selection.by_validation.sigma[0],
            "regularization": self.selection.isotropic.regularization,
            "test_rmse_m": {name: self.comparison.row(name).rmse for name in TEST_ROWS},
            "n_cups": execution.n_cups,
            "hit_rate": execution.hit_rate,
            "hit_interval": list(execution.hit_interval),
            "predicted_miss_m": execution.predicted_miss.model_dump(),
            "executed_miss_m": execution.executed_miss.model_dump(),
            "failures": execution.failures,
        }

    def to_json(self, wall_s: dict[str, float]) -> dict[str, Any]:
        """Return the content of `results.json`: the main numbers, then all that the figures and tables show.

        `wall_s`: how long each phase took [s].
        """
        return self.summary() | {
            "scenario": self.settings.scenario.model_dump(mode="json"),
            "wall_s": sum(wall_s.values()),
            "wall_s_by_phase": wall_s,
            "samples": self.samples.model_dump(mode="json"),
            "selection": self.selection.model_dump(mode="json"),
            "comparison": self.comparison.model_dump(mode="json"),
            "learning_curves": self.learning_curves.model_dump(mode="json"),
            "landing_map": self.landing_map.model_dump(mode="json"),
            "executions": [one.model_dump(mode="json") for one in self.executions],
            "noise": self.noise.model_dump(mode="json"),
        }
