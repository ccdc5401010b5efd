"""How many casts a second the batched engine simulates, by batch size and precision, on one core or on a GPU.

And what a step of the vector environment takes beside the engine alone.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Sequence
from functools import partial
from unittest.mock import patch

import gymnasium
import jax
import numpy as np

from timing.clock import N_ROUNDS, ratio
from wam_cast.batch import engine
from wam_cast.cast import Cast
from wam_cast.cli.terminal import out, print_table
from wam_cast.environments.cast_task import CastTask
from wam_cast.scenario import Scenario
from wam_cast.simulation.simulator import CastSimulator

N_BATCHES = 2
"""In a measurement."""

N_EPISODES = 128
"""Of the vector environment."""


def print_batched(casts: Sequence[Cast], sizes: Sequence[int]) -> None:
    """Print its rate, and that of Drake in the same round over it. The compilation, once a process, is told apart."""
    device, scenario = jax.devices()[0], Scenario()
    clock = time.process_time if device.platform == "cpu" else time.perf_counter
    simulator = CastSimulator(scenario)
    few = np.array([cast.to_array() for cast in casts])

    def by_drake() -> float:
        start = time.process_time()
        for cast in casts:
            simulator.simulate(cast)
        return (time.process_time() - start) / len(casts)

    by_drake()
    out.print(f"batched: JAX {jax.__version__} on {device.device_kind}; on processors one core")
    rows = []
    for precision in ("float64", "float32"):
        for size in sizes:
            many = np.resize(few, (N_BATCHES * size, 3))
            simulate = partial(engine.simulate_batch, scenario, many, precision=precision)
            with patch.multiple(engine, CPU_CHUNK=size, GPU_CHUNK=size):
                first = _seconds(simulate, clock)
                pairs = np.array([(by_drake(), _seconds(simulate, clock) / len(many)) for _ in range(N_ROUNDS)])
            drake, batched = pairs.T
            compiled = f"{max(first - batched.min() * len(many), 0):.0f}"
            rows.append((precision, str(size), f"{1 / batched.min():.0f}", ratio(drake, batched), compiled))
    print_table(rows, ["precision", "batch", "casts a second", "Drake's time, of its", "compilation [s]"])
    _print_vector_step(clock)


def _print_vector_step(clock: Callable[[], float]) -> None:
    envs, scenario = gymnasium.make_vec("wam_cast/Cast-v0", num_envs=N_EPISODES), Scenario()
    envs.reset(seed=0)
    actions = np.tile(CastTask(scenario).action(Cast(0.3, 0.6, 0.1)), (N_EPISODES, 1))
    actions[:, 3] = np.linspace(-0.5, 0.5, N_EPISODES)
    casts = [CastTask(scenario).cast(action) for action in actions]
    step, alone = partial(envs.step, actions), partial(engine.simulate_batch, scenario, casts)
    step()
    pairs = np.array([(_seconds(step, clock), _seconds(alone, clock)) for _ in range(N_ROUNDS)])
    seconds, of_engine = pairs.T
    out.print(
        f"a vector step of {N_EPISODES} casts: {np.median(seconds):.2f} s, {ratio(seconds, of_engine)} of the engine's time"
    )


def _seconds(run: Callable[[], object], clock: Callable[[], float]) -> float:
    start = clock()
    run()
    return clock() - start
