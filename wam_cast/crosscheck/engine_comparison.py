"""The same random casts through all engines, and how far each is from MuJoCo's converged ones."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from importlib import import_module
from typing import Any

import numpy as np
import pandas as pd

from wam_cast.cast import Cast
from wam_cast.crosscheck.flight_numbers import flight_numbers
from wam_cast.crosscheck.mujoco_flight import MujocoSimulator
from wam_cast.crosscheck.mujoco_model import import_mujoco
from wam_cast.errors import InputError, checked_integer
from wam_cast.generation.engines import Row, cast_columns, checked_engine, outcome_columns
from wam_cast.generation.sampling import row_noise_seed, sample_cast
from wam_cast.scenario import Scenario
from wam_cast.simulation.outcome import Status
from wam_cast.simulation.simulator import CastSimulator
from wam_cast.types import Array, checks_types

DRAKE, DRAKE_CONVERGED = "drake", "drake converged"
MUJOCO, MUJOCO_CONVERGED = "mujoco", "mujoco converged"
BATCH = "batch"
"""The engines: Drake and MuJoCo at the scenario's longest step and at a tenth of it, and the batched one."""

FINER = 10
"""By which steps are divided for a converged landing."""

MEDIAN_AGREEMENT, LARGEST_AGREEMENT = 1e-5, 1e-4
"""By how much the converged landings may differ, at the median and at most [m]."""

QUANTITIES = {
    "landing": 1e3,
    "ball_path": 1e3,
    "entry_speed": 1e3,
    "entry_angle": 1e3,
    "peak_torque_utilization": 100,
    "peak_velocity_utilization": 100,
}
"""What is compared, and its unit on a screen: mm, mm, mm/s, mrad, %, %."""

Simulate = Callable[[Cast, int], tuple[Row, Array]]
"""A cast and its noise seed -> its columns of a dataset, and the ball's path (n, 3) [m], a point a control period."""


@dataclass(frozen=True, eq=False)
class EngineComparison:
    """Casts through several engines.

    Attributes
    ----------
    scenario, seed
        What was cast, and by which seed the casts were drawn.
    frames
        For each engine, a dataset's columns, a row a cast, and `ball_path`: the ball's largest distance [m] from where it is in
        MuJoCo's converged cast, up to the landing there; nan where the engine tells no path.
    left_out
        Why the batched engine is not among them, or empty.
    """

    scenario: Scenario
    seed: int
    frames: dict[str, pd.DataFrame]
    left_out: str = ""

    def differences(self, engine: str) -> pd.DataFrame:
        """Return the absolute differences of one engine from MuJoCo's converged casts, a row each that both of them land."""
        own, judge = self.frames[engine], self.frames[MUJOCO_CONVERGED]
        both = (own["status"] == Status.LANDED) & (judge["status"] == Status.LANDED)
        own, judge = own[both], judge[both]
        found = {name: (own[name] - judge[name]).abs() for name in QUANTITIES if name in judge and name != "ball_path"}
        along, across = (own[name] - judge[name] for name in ("landing_along", "landing_across"))
        return pd.DataFrame({"landing": np.hypot(along, across), "ball_path": own["ball_path"], **found})[
            list(QUANTITIES)
        ]

    def n_other_statuses(self, engine: str) -> int:
        """Return how many casts end otherwise than in MuJoCo, converged."""
        return int(np.sum(self.frames[engine]["status"] != self.frames[MUJOCO_CONVERGED]["status"]))

    @property
    def agrees(self) -> bool:
        """Whether the casts of Drake, converged, and of the batched engine end and land as those of MuJoCo, converged."""
        return all(self._agrees(engine) for engine in (DRAKE_CONVERGED, BATCH) if engine in self.frames)

    def _agrees(self, engine: str) -> bool:
        off = self.differences(engine)["landing"]
        return bool(
            len(off) > 0
            and self.n_other_statuses(engine) == 0
            and off.median() <= MEDIAN_AGREEMENT
            and off.max() <= LARGEST_AGREEMENT
        )

    def record(self) -> dict[str, Any]:
        """Return all of it in SI units, as JSON takes it."""
        engines = {}
        for engine, frame in self.frames.items():
            off = self.differences(engine)
            engines[engine] = {
                "n_compared": len(off),
                "n_other_statuses": self.n_other_statuses(engine),
                "differences": {name: percentiles(off[name].to_numpy()) for name in QUANTITIES},
                "casts": frame.to_dict("records"),
            }
        return {
            "n_casts": len(self.frames[DRAKE]),
            "seed": self.seed,
            "agrees": self.agrees,
            "median_agreement": MEDIAN_AGREEMENT,
            "largest_agreement": LARGEST_AGREEMENT,
            "left_out": self.left_out,
            "engines": engines,
        }


def percentiles(off: Array) -> dict[str, float]:
    """Return median, P95 and the largest of differences, (n,), of those that are not nan; nan if none is."""
    values = off[~np.isnan(off)]
    found = np.percentile(values, [50, 95, 100]) if len(values) else np.full(3, np.nan)
    return dict(zip(("median", "p95", "largest"), map(float, found), strict=True))


def batched_engine(scenario: Scenario) -> Callable[..., pd.DataFrame]:
    """Return the function of the batched engine. Raises `.InputError` if it is not installed or cannot simulate the scenario."""
    try:
        checked_engine("batch", scenario, has_own_controller=False)
        function: Callable[..., pd.DataFrame] = import_module("wam_cast.batch.engine").simulate_batch
    except ImportError as error:
        raise InputError(str(error)) from None
    return function


@checks_types
def compare_engines(
    scenario: Scenario, n_casts: int, seed: int = 0, *, on_progress: Callable[[str, int, int], None] | None = None
) -> EngineComparison:
    """Simulate the first `n_casts` casts of a `seed` in every engine that there is.

    `on_progress` is called with the engine's name, the number of its casts that are finished, and `n_casts`.

    Raises
    ------
    InputError
        If a number is no integer or out of range, MuJoCo is not installed, or the scenario cannot be simulated.
    """
    n_casts, seed = checked_integer("n_casts", n_casts, 1), checked_integer("seed", seed, 0)
    import_mujoco()  # before anything is simulated
    left_out = ""
    try:
        batch = batched_engine(scenario)
    except InputError as error:
        batch, left_out = None, str(error)
    report = on_progress or (lambda _engine, _done, _n_casts: None)
    casts = [sample_cast(scenario, seed, row) for row in range(n_casts)]
    noise_seeds = [row_noise_seed(seed, row) for row in range(n_casts)]
    makers: dict[str, Callable[[], Simulate]] = {
        MUJOCO_CONVERGED: lambda: _mujoco(finer(scenario)),
        MUJOCO: lambda: _mujoco(scenario),
        DRAKE_CONVERGED: lambda: _drake(finer(scenario)),
        DRAKE: lambda: _drake(scenario),
    }
    frames, judged = {}, list[tuple[Row, Array]]()
    for engine, make in makers.items():
        simulate, rows = make(), []
        for row, (cast, noise_seed) in enumerate(zip(casts, noise_seeds, strict=True)):
            columns, path = simulate(cast, noise_seed)
            if engine == MUJOCO_CONVERGED:
                judged.append((columns, path))
            rows.append({**cast_columns(row, cast), **columns, "ball_path": _path_off(path, *judged[row], scenario)})
            report(engine, row + 1, n_casts)
        frames[engine] = pd.DataFrame(rows)
    if batch is not None:
        frames[BATCH] = _batch(batch, scenario, casts, noise_seeds)
        report(BATCH, n_casts, n_casts)
    order = [DRAKE, DRAKE_CONVERGED, BATCH, MUJOCO, MUJOCO_CONVERGED]
    found = {engine: frames[engine] for engine in order if engine in frames}
    return EngineComparison(scenario, seed, found, left_out)


def finer(scenario: Scenario) -> Scenario:
    """Return the scenario with a tenth of its integration step."""
    step = scenario.simulation.max_step / FINER
    return scenario.model_copy(update={"simulation": scenario.simulation.model_copy(update={"max_step": step})})


def _drake(scenario: Scenario) -> Simulate:
    simulator = CastSimulator(scenario)

    def simulate(cast: Cast, noise_seed: int) -> tuple[Row, Array]:
        recording = simulator.record(cast, noise_seed=noise_seed)
        return outcome_columns(recording.outcome), recording.p_WL

    return simulate


def _mujoco(scenario: Scenario) -> Simulate:
    simulator = MujocoSimulator(scenario)

    def simulate(cast: Cast, noise_seed: int) -> tuple[Row, Array]:
        flight = simulator.fly(cast, noise_seed)
        return flight_numbers(flight, scenario, simulator.limits), flight.samples.p_WL

    return simulate


def _batch(
    simulate_batch: Callable[..., pd.DataFrame], scenario: Scenario, casts: Sequence[Cast], noise_seeds: Sequence[int]
) -> pd.DataFrame:
    parameters = np.array([cast.to_array() for cast in casts])
    frame = simulate_batch(scenario, parameters, noise_seeds=noise_seeds)
    return frame.assign(ball_path=np.nan)


def _path_off(path: Array, judged: Row, judged_path: Array, scenario: Scenario) -> float:
    """Return the largest distance [m] of a ball's path from the judged one's, up to the landing."""
    if np.isnan(judged["crossing_time"]):
        return float("nan")
    n = min(int(judged["crossing_time"] / scenario.controller.period) + 1, len(path), len(judged_path))
    return float(np.linalg.norm(path[:n] - judged_path[:n], axis=1).max())
