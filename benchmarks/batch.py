"""The batched engine against Drake: casts a second on one core, and how far landings are apart.

Ratios are taken within one run, from processor times; the absolute figures are of the machine that runs it. On a machine with a GPU
JAX takes it, and the table says so: pass larger --sizes there.

    python benchmarks/batch.py [--casts 1000] [--sizes 16 32 64 128 256] [--seed 1]
"""

from __future__ import annotations

import argparse
import os
import time
from collections.abc import Callable
from functools import partial
from unittest.mock import patch

# One core: neither the numerical libraries' threads nor XLA's must help. It counts only before they are loaded.
os.environ.update(OMP_NUM_THREADS="1", OPENBLAS_NUM_THREADS="1")
os.environ.setdefault("XLA_FLAGS", "--xla_cpu_multi_thread_eigen=false intra_op_parallelism_threads=1")

import jax
import numpy as np
from pydrake.systems.analysis import ResetIntegratorFromFlags

from wam_cast.batch import engine
from wam_cast.cast import Cast, cast_bounds, is_allowed
from wam_cast.cli.terminal import out, print_table
from wam_cast.generation.sampling import sample_cast
from wam_cast.scenario import Noise, Scenario
from wam_cast.simulation import station_loop
from wam_cast.simulation.simulator import CastSimulator
from wam_cast.types import Array

LANDING = ["landing_along", "landing_across"]
N_REPEATS = 3


def best_seconds(run: Callable[[], object]) -> float:
    """Return the least processor time of some runs [s], or the least wall time on a GPU."""
    clock = time.process_time if jax.default_backend() == "cpu" else time.perf_counter
    run()
    taken = []
    for _ in range(N_REPEATS):
        start = clock()
        run()
        taken.append(clock() - start)
    return min(taken)


def drawn(scenario: Scenario, n: int, seed: int) -> Array:
    """Return casts of the bounds' whole volume, its corners first."""
    corners = np.array(np.meshgrid(*np.transpose(cast_bounds(scenario)))).reshape(3, -1).T
    corners = corners[is_allowed(scenario, corners)]
    return np.vstack([corners, *(sample_cast(scenario, seed, i).to_array() for i in range(n - len(corners)))])[:n]


def begin_in_equal_steps(simulator: object, method: str, max_step: float, _accuracy: float) -> None:
    """Let Drake integrate as the batched engine does."""
    ResetIntegratorFromFlags(simulator, method, max_step)
    simulator.get_mutable_integrator().set_fixed_step_mode(True)


def by_drake(scenario: Scenario, casts: Array) -> Array:
    """Return landings along and across [m], (n, 2); cast i has the noise seed i."""
    simulator = CastSimulator(scenario)
    told = (simulator.simulate(Cast(*cast), noise_seed=i) for i, cast in enumerate(casts))
    return np.array([[one.landing_along, one.landing_across] for one in told])


def print_speed(scenario: Scenario, sizes: list[int], seed: int) -> None:
    """Print casts a second by precision and batch size, and the ratio to Drake's free cast."""
    casts = drawn(scenario, 24, seed)
    simulator = CastSimulator(scenario)
    drake = best_seconds(lambda: [simulator.simulate(Cast(*cast)) for cast in casts]) / len(casts)
    out.print(f"Drake: {1 / drake:.1f} free casts a second on one core")
    rows = []
    for precision in ("float64", "float32"):
        for size in sizes:
            many = np.resize(casts, (4 * size, 3)) if size < 1000 else np.resize(casts, (size, 3))
            with patch.dict(engine.CHUNKS, {jax.default_backend(): size}):
                seconds = best_seconds(partial(engine.simulate_batch, scenario, many, precision=precision)) / len(many)
            rows.append((precision, str(size), f"{1 / seconds:.0f}", f"{drake / seconds:.1f}"))
    print_table(rows, ["precision", "batch", "casts a second", "of Drake's"])


def print_agreement(scenario: Scenario, n: int, seed: int) -> None:
    """Print how far landings are from Drake's, with and without noise."""
    rows = []
    quiet = Noise.typical().model_copy(update={"encoder_counts": 0})
    noises = {"none": Noise(), "typical without encoders": quiet, "typical": Noise.typical()}
    for name, noise in noises.items():
        noisy = scenario.model_copy(update={"noise": noise})
        casts = drawn(noisy, n, seed)
        own = by_drake(noisy, casts)
        with patch.object(station_loop, "begin_integration", begin_in_equal_steps):
            equal = by_drake(noisy, casts)
        for precision in ("float64", "float32"):
            batch = engine.simulate_batch(noisy, casts, range(n), precision)[LANDING].to_numpy()
            for steps, drake in (("equal", equal), ("its own", own)):
                off = 1e3 * np.linalg.norm(batch - drake, axis=1)
                rows.append(
                    (name, steps, precision, *(f"{value:.2g}" for value in np.nanpercentile(off, [50, 95, 100])))
                )
    print_table(rows, ["noise", "Drake's steps", "precision", "median mm", "P95 mm", "largest mm"])


if __name__ == "__main__":
    arguments = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    arguments.add_argument("--casts", type=int, default=1000, help="for the agreement; 0: none")
    arguments.add_argument("--sizes", type=int, nargs="+", default=[16, 32, 64, 128, 256])
    arguments.add_argument("--seed", type=int, default=1)
    options = arguments.parse_args()
    out.print(f"JAX {jax.__version__} on {jax.devices()[0].device_kind}")
    print_speed(Scenario(), options.sizes, options.seed)
    if options.casts:
        print_agreement(Scenario(), options.casts, options.seed)
