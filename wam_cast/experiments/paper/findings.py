"""All that a run of the experiment has found, and its `results.json`."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
import pandas as pd

from wam_cast.experiments.frames import Record, Result, Rows, Values, records, to_plain
from wam_cast.experiments.paper.comparison import Comparison
from wam_cast.experiments.paper.landing_map import LandingMap
from wam_cast.experiments.paper.learning_curves import LearningCurves
from wam_cast.experiments.paper.noise_study import NoiseStudy
from wam_cast.experiments.paper.selection import Selection
from wam_cast.experiments.paper.settings import PAPERS_PLANNER, Settings
from wam_cast.experiments.statistics import describe
from wam_cast.experiments.trials import failures, hits
from wam_cast.learning.dataset import CastDataset
from wam_cast.learning.parts import Parts
from wam_cast.scenario import Scenario

TRIAL = ["cup", "distance", "speed", "wait", "is_feasible", "predicted_offset", "predicted_miss"]
TRIAL += ["executed_offset", "executed_across", "executed_miss", "entry_angle", "status", "limits_hit"]
"""What `results.json` holds of each trial."""

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


class Samples(Result):
    """The random casts: counts by status, and the training casts with their landings [m, m/s, s, m].

    `n_train`, `n_validation` and `n_test` are the casts of each part that came down to the rim plane: those that are used.
    """

    statuses: dict[str, int]
    n_train: int
    n_validation: int
    n_test: int
    share_slack: float
    distance: Values
    speed: Values
    wait: Values
    landing_along: Values
    landing_std: float
    largest_across: float


class Executions(Result):
    """Plans for cups along the line that can be reached, each executed with contact: the trials of all planners."""

    trials: Rows


@dataclass(frozen=True, eq=False)
class Findings:
    """What each phase found, and the settings that led there."""

    settings: Settings
    samples: Samples
    selection: Selection
    comparison: Comparison
    learning_curves: LearningCurves
    landing_map: LandingMap
    executions: Executions
    noise: NoiseStudy

    def summary(self) -> Record:
        """Return the main numbers, as JSON knows them."""
        trials = self.executions.trials
        papers = summarize(trials[trials["planner"] == PAPERS_PLANNER], self.settings.scenario)
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
            "test_rmse_m": {name: self.comparison.row(name)["rmse"] for name in TEST_ROWS},
            "n_cups": papers["n_cups"],
            "hit_rate": papers["hit_rate"],
            "hit_interval": list(papers["hit_interval"]),
            "predicted_miss_m": papers["predicted_miss"],
            "executed_miss_m": papers["executed_miss"],
            "failures": papers["failures"],
        }

    def to_json(self, wall_s: dict[str, float]) -> Record:
        """Return the content of `results.json`: the main numbers, then all that the figures and tables show.

        `wall_s`: how long each phase took [s].
        """
        scenario = self.settings.scenario
        noise = to_plain(self.noise) | {"executions": by_label(self.noise.executions, scenario)}
        content: Record = to_plain(
            self.summary()
            | {
                "scenario": scenario.model_dump(mode="json"),
                "wall_s": sum(wall_s.values()),
                "wall_s_by_phase": wall_s,
                "samples": self.samples,
                "selection": self.selection,
                "comparison": self.comparison,
                "learning_curves": self.learning_curves,
                "landing_map": self.landing_map,
                "executions": by_label(self.executions.trials, scenario),
                "noise": noise,
            }
        )
        return content


def describe_samples(data: CastDataset, parts: Parts) -> Samples:
    """Return counts of a dataset, and its training casts."""
    X, y, _ = parts.train
    train, _, _ = data.split()
    frame = data.frame.iloc[train]
    return Samples(
        statuses={str(status): int(n) for status, n in data.frame["status"].value_counts().items()},
        n_train=len(X),
        n_validation=len(parts.validation.X),
        n_test=parts.n_test,
        share_slack=float(np.mean(frame["is_slack"].to_numpy(dtype=bool))),
        distance=X[:, 0],
        speed=X[:, 1],
        wait=X[:, 2],
        landing_along=parts.train.landing,
        landing_std=float(np.std(parts.train.landing)),
        largest_across=float(np.max(np.abs(y[:, 1]))),
    )


def by_label(trials: pd.DataFrame, scenario: Scenario) -> list[Record]:
    """Return what the trials of each label come to, with the trials themselves."""
    return [
        {"label": label, "planner": group["planner"].iloc[0]}
        | summarize(group, scenario)
        | {"trials": _trial_records(group)}
        for label, group in trials.groupby("label", sort=False)
    ]


def summarize(trials: pd.DataFrame, scenario: Scenario) -> dict[str, Any]:
    """Return how many cups were hit, with predicted and executed misses [m], and failures by status.

    `n_no_plan` and `n_no_plan_caught`: cups for which no cast was predicted to land within 1 cm of the middle (the best one was
    cast all the same), and those of them that were hit. `n_touched`: balls that were caught though they came in farther from the
    middle than the ball clears the rim.
    """
    caught, planned = trials["is_caught"], trials["is_feasible"]
    return hits(trials) | {
        "predicted_miss": describe(trials["predicted_miss"].to_numpy()),
        "executed_miss": describe(trials["miss"].to_numpy()),
        "failures": failures(trials),
        "n_no_plan": int((~planned).sum()),
        "n_no_plan_caught": int((~planned & caught).sum()),
        "n_touched": int((caught & (trials["miss"] > clear_radius(scenario))).sum()),
    }


def _trial_records(trials: pd.DataFrame) -> list[Record]:
    """Return the trials as they stand in `results.json`, offsets along the casting plane counted from the cup's middle [m]."""
    names = {"radius": "cup", "landing_across": "executed_across", "miss": "executed_miss"}
    offset = trials["landing_along"] - trials["radius"]
    return records(trials.rename(columns=names).assign(executed_offset=offset)[TRIAL])


def clear_radius(scenario: Scenario) -> float:
    """Return how far from the cup's middle a ball that falls straight down passes the rim without touching it [m]."""
    return scenario.cup.inner_radius - scenario.ball.radius
