"""A preview of a scenario, before anything is learned from it: a few random casts, and whether they leave anything to catch."""

from __future__ import annotations

import math
import time
from dataclasses import asdict, dataclass
from typing import Any

import numpy as np
import pandas as pd

from wam_cast.arm.arm_model import arm_model
from wam_cast.cast import PARAMETERS, Cast
from wam_cast.errors import checked_integer
from wam_cast.experiments.frames import Record, records, to_plain
from wam_cast.experiments.preview_verdict import (
    Fate,
    Verdict,
    count,
    fate_of,
    good_landings,
    is_surely_good,
    span_of,
    verdict_of,
)
from wam_cast.experiments.statistics import wilson_interval
from wam_cast.generation.sampling import row_noise_seed, sample_cast
from wam_cast.parallel.workers import available_processors
from wam_cast.scenario import Scenario
from wam_cast.simulation.outcome import Outcome, Status
from wam_cast.simulation.simulator import CastSimulator
from wam_cast.types import Array, checks_types

N_CASTS = 30

FEWEST_CASTS = 8
"""On which a preview that may end early does, and which any one has."""

MOST_SECONDS = 60.0
"""That a preview's casts may be expected to take by default: where a cast takes seconds there are fewer."""


@dataclass(frozen=True, eq=False)
class Preview:
    """What a few random casts show of a scenario.

    Attributes
    ----------
    scenario
        Which one.
    casts
        A row a cast: `cast`, `distance`, `speed`, `wait`, `status`, `landing_along`, `is_slack` and `slack` as in a dataset,
        `limits_hit` as of an `.Outcome`, and `fate`, see `.Fate`.
    peak_torque_utilization, peak_velocity_utilization
        Per joint, the largest of all casts that did not diverge, each of shape (7,); nan if all did.
    step
        Mean integration step that is expected in the contact-free phase [s].
    cast_time
        Of a processor for a cast, on average [s].
    verdict
        Whether the scenario can work, and why.
    """

    scenario: Scenario
    casts: pd.DataFrame
    peak_torque_utilization: Array
    peak_velocity_utilization: Array
    step: float
    cast_time: float
    verdict: Verdict

    @property
    def hand_radii(self) -> tuple[float, float]:
        """Distances from the base axis [m] between which the hand goes down."""
        nearest, farthest = self.scenario.bounds.distance
        return self.scenario.motion.start_radius + nearest, self.scenario.motion.start_radius + farthest

    @property
    def hand_heights(self) -> tuple[float, float]:
        """Heights above the floor [m] at which the hand is lowest and highest."""
        motion = self.scenario.motion
        return motion.start_height - motion.drop_distance, motion.start_height

    @property
    def landings(self) -> tuple[float, float]:
        """Where the nearest and the farthest cast lands, from the base axis [m]; nan if none does."""
        return span_of(self.casts["landing_along"])

    @property
    def cups(self) -> tuple[float, float]:
        """The same of the good casts: between these a cup can stand."""
        return span_of(good_landings(self.casts))

    def generation_time(self, n_casts: int) -> float:
        """Return how long a dataset of so many casts should take on all of this machine's processors [s]."""
        return self.cast_time * n_casts / available_processors()

    def record(self, n_training_casts: int = 1700) -> Record:
        """Return the whole preview as JSON knows it."""
        n, n_good = len(self.casts), count(self.casts, Fate.GOOD)
        plain: Record = to_plain(
            {
                **asdict(self.verdict),
                "n_casts": n,
                "n_good": n_good,
                "good_interval": wilson_interval(n_good, n),
                "statuses": self.casts["status"].value_counts().to_dict(),
                "fates": self.casts["fate"].value_counts().to_dict(),
                "n_slack": int(self.casts["is_slack"].sum()),
                "hand_radii": self.hand_radii,
                "hand_heights": self.hand_heights,
                "bearings": arm_model(self.scenario.arm).bearing_limits,
                "landings": self.landings,
                "cups": self.cups,
                "peak_torque_utilization": self.peak_torque_utilization.tolist(),
                "peak_velocity_utilization": self.peak_velocity_utilization.tolist(),
                "step": self.step,
                "cast_s": self.cast_time,
                "n_processors": available_processors(),
                "n_training_casts": n_training_casts,
                "generate_s": self.generation_time(n_training_casts),
                "casts": records(self.casts),
            }
        )
        return plain


@checks_types
def preview_scenario(scenario: Scenario, n_casts: int | None = None, *, ends_early: bool = False) -> Preview:
    """Simulate a few random casts without a cup, and judge whether the scenario can work: a few seconds, and no model.

    Parameters
    ----------
    scenario
        What is cast.
    n_casts
        How many: the first rows of the dataset of seed 0. By default 30, or as many as should take a minute, but 8 at least.
    ends_early
        End after 8 casts or more once the answer is a plain yes; for a no all are simulated.

    Raises
    ------
    InputError
        If `n_casts` is no integer from 2 on, or the scenario cannot be simulated at all.
    """
    simulator = CastSimulator(scenario)
    affordable = int(MOST_SECONDS / simulator.integration.expected_seconds)
    by_default = min(N_CASTS, max(FEWEST_CASTS, affordable))
    n_casts = by_default if n_casts is None else checked_integer("n_casts", n_casts, 2)
    rows: list[Record] = []
    outcomes: list[Outcome] = []
    started = time.process_time()
    for row in range(n_casts):
        cast = sample_cast(scenario, 0, row)
        outcomes.append(simulator.simulate(cast, noise_seed=row_noise_seed(0, row)))
        rows.append(_columns(scenario, row, cast, outcomes[-1]))
        if ends_early and len(rows) >= FEWEST_CASTS and is_surely_good(pd.DataFrame(rows)):
            break
    cast_time = (time.process_time() - started) / len(rows)
    casts = pd.DataFrame(rows)
    return Preview(
        scenario=scenario,
        casts=casts,
        peak_torque_utilization=_peaks(outcomes, "peak_torque_utilization"),
        peak_velocity_utilization=_peaks(outcomes, "peak_velocity_utilization"),
        step=simulator.integration.expected_step,
        cast_time=cast_time,
        verdict=verdict_of(scenario, casts),
    )


def _columns(scenario: Scenario, row: int, cast: Cast, outcome: Outcome) -> dict[str, Any]:
    return {
        "cast": row,
        **dict(zip(PARAMETERS, cast.to_array().tolist(), strict=True)),
        "status": outcome.status.value,
        "fate": fate_of(scenario, cast.distance, outcome).value,
        "landing_along": outcome.landing_along,
        "is_slack": outcome.is_slack,
        "slack": outcome.slack,
        "limits_hit": outcome.limits_hit,
    }


def _peaks(outcomes: list[Outcome], name: str) -> Array:
    known = [getattr(outcome, name) for outcome in outcomes if outcome.status is not Status.DIVERGED]
    return np.max(known, axis=0) if known else np.full(7, math.nan)
