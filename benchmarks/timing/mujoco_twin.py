"""What the same casts cost in MuJoCo, in steps of its fourth order, with and without its controller, which is Python."""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np

from timing.clock import ratio, seconds_by_round
from wam_cast.batch.engine import simulate_batch
from wam_cast.cast import Cast
from wam_cast.cli.terminal import out, print_table
from wam_cast.crosscheck.flight_numbers import flight_numbers
from wam_cast.crosscheck.mujoco_flight import MujocoSimulator
from wam_cast.robot.plant import N_ARM
from wam_cast.scenario import Scenario, Simulation
from wam_cast.simulation.simulator import CastSimulator
from wam_cast.types import Array

FINE = 1e-4
"""Step of the landings that all are held to [s]."""


def print_mujoco_twin(casts: Sequence[Cast]) -> None:
    """Print times relative to Drake's, and each engine's own error: how far its landings are from those of a fine step."""
    scenario = Scenario()
    drake, twin, fine = CastSimulator(scenario), MujocoSimulator(scenario), MujocoSimulator(scenario, FINE)
    many = np.array([cast.to_array() for cast in casts])
    flights = [twin.fly(cast) for cast in casts]

    def steps_alone(i: int) -> None:
        control, data = twin.begin(casts[i], 0), twin.robot.data
        data.ctrl[:N_ARM] = control.torque(0, data.qpos[:N_ARM].copy(), data.qvel[:N_ARM].copy())  # all along
        twin.robot.mujoco.mj_step(twin.robot.model, data, twin.n_steps * (len(flights[i].samples.times) - 1))

    def landing(simulator: MujocoSimulator, cast: Cast) -> float:
        return float(flight_numbers(simulator.fly(cast), simulator.scenario, simulator.limits)["landing_along"])

    exact = np.array([landing(fine, cast) for cast in casts])
    by_drake = np.array([drake.simulate(cast).landing_along for cast in casts])
    by_twin = np.array([landing(twin, cast) for cast in casts])
    half = scenario.model_copy(update={"simulation": Simulation(max_step=scenario.simulation.max_step / 2)})
    batched, finer = (simulate_batch(one, many)["landing_along"].to_numpy(dtype=float) for one in (scenario, half))
    runs: dict[str, tuple[Callable[[int], object], str]] = {
        "Drake": (lambda i: drake.simulate(casts[i]), _error(by_drake - exact)),
        "MuJoCo, RK4": (lambda i: twin.fly(casts[i]), _error(by_twin - exact)),
        "MuJoCo, RK4, its steps alone": (steps_alone, "-"),
        "batched, all at once": (lambda i: simulate_batch(scenario, many) if i == 0 else None, _error(batched - exact)),
        "batched, half the step": (lambda i: simulate_batch(half, many) if i == 0 else None, _error(finer - exact)),
    }
    seconds = seconds_by_round({name: run for name, (run, _) in runs.items()}, len(casts))
    out.print(
        f"MuJoCo: {len(casts)} random casts, one core; landings off those of MuJoCo in steps of {1e3 * FINE:g} ms"
    )
    rows = [
        (name, f"{1e3 * one.min():.1f}", ratio(one, seconds["Drake"]), runs[name][1]) for name, one in seconds.items()
    ]
    print_table(rows, ["engine", "ms a cast", "of Drake's", "off [mm]: median, max"])


def _error(off: Array) -> str:
    return ", ".join(f"{1e3 * value:.2g}" for value in (np.median(np.abs(off)), np.abs(off).max()))
