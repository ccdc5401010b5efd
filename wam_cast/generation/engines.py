"""What simulates a dataset's casts: Drake, a cast at a time, or the batched engine, blocks of them."""

from __future__ import annotations

from collections.abc import Callable, Collection, Generator
from concurrent.futures import Executor
from contextlib import closing
from functools import partial
from typing import TYPE_CHECKING, Any, TypeAlias, get_args

import numpy as np

from wam_cast.cast import Cast
from wam_cast.errors import InputError, quoted
from wam_cast.generation.sampling import row_noise_seed, sample_cast
from wam_cast.parallel.workers import Workers, run_rows
from wam_cast.scenario import Scenario
from wam_cast.storage.manifest import Engine

if TYPE_CHECKING:
    from wam_cast.simulation.outcome import Outcome

Row: TypeAlias = dict[str, Any]
"""A row's columns by name."""


BLOCK = 500
"""Casts that a process simulates with the batched engine before it hands them over: enough that compiling it is paid for. What is
no processor is shared by no processes: there a block is what the engine takes at once."""


def checked_engine(engine: str, scenario: Scenario, *, has_own_controller: bool) -> Engine:
    """Return the name of an engine that can simulate `scenario`. Raises `.InputError` if it cannot."""
    names: dict[str, Engine] = {name: name for name in get_args(Engine)}
    if engine not in names:
        raise InputError(f"engine = {quoted(engine)} must be {' or '.join(names)}")
    if engine == "batch":
        if has_own_controller:
            raise InputError(
                "engine = batch knows the package's own controller alone; leave make_controller out, or take drake"
            )
        from wam_cast.batch.engine import n_steps
        from wam_cast.simulation.loop_stability import check_loop

        check_loop(scenario, scenario)
        n_steps(scenario)
    return names[engine]


def simulate_row(
    scenario: Scenario, seed: int, row: int, *, make_controller: Callable[[Scenario], Any] | None = None
) -> Row:
    """Simulate one row of a dataset and return its columns; what workers run."""
    # Only who simulates needs Drake; loading a dataset does without.
    from wam_cast.simulation.simulator import simulate_cast

    cast = sample_cast(scenario, seed, row)
    outcome = simulate_cast(scenario, cast, noise_seed=row_noise_seed(seed, row), make_controller=make_controller)
    return cast_columns(row, cast) | outcome_columns(outcome)


def outcome_columns(outcome: Outcome) -> Row:
    """Return the columns of a dataset that tell what became of a cast."""
    return {
        "landing_along": outcome.landing_along,
        "landing_across": outcome.landing_across,
        "status": outcome.status.value,
        "crossing_time": outcome.crossing_time,
        "entry_speed": outcome.entry_speed,
        "entry_angle": outcome.entry_angle,
        "is_slack": outcome.is_slack,
        "slack": outcome.slack,
        "peak_torque_utilization": float(np.max(outcome.peak_torque_utilization)),
        "peak_velocity_utilization": float(np.max(outcome.peak_velocity_utilization)),
        "peak_tracking_error": outcome.peak_tracking_error,
    }


def cast_columns(row: int, cast: Cast) -> Row:
    """Return the columns of a dataset that say which cast it was."""
    return {"cast": row, "distance": cast.distance, "speed": cast.speed, "wait": cast.wait}


def rows_in_blocks(
    scenario: Scenario,
    seed: int,
    todo: Collection[int],
    executor: Executor | Workers | None = None,
    n_workers: int | None = None,
) -> Generator[Row]:
    """Yield the rows `todo` of a seed, ascending, by the batched engine, in processes as `run_rows` has them."""
    from wam_cast.batch.engine import device_chunk

    wanted = sorted(todo)
    on_device = device_chunk()
    size = on_device or BLOCK
    simulate = partial(simulate_block, scenario, seed, wanted[-1] + 1 if wanted else 0, size)
    blocks = sorted({row // size for row in wanted})
    kept = set(wanted)
    is_here = on_device and not isinstance(executor, Executor)
    done = (simulate(block) for block in blocks) if is_here else run_rows(simulate, blocks, executor, n_workers)
    with closing(done) as simulated:
        for rows in simulated:
            yield from (row for row in rows if row["cast"] in kept)


def simulate_block(scenario: Scenario, seed: int, n_casts: int, size: int, block: int) -> list[Row]:
    """Simulate the casts of a block of `size` rows, up to `n_casts`, and return their columns; what workers run."""
    from wam_cast.batch.engine import simulate_batch

    rows = range(block * size, min((block + 1) * size, n_casts))
    casts = [sample_cast(scenario, seed, row).to_array() for row in rows]
    frame = simulate_batch(scenario, casts, [row_noise_seed(seed, row) for row in rows])
    frame["cast"] = rows
    return [{str(name): value for name, value in row.items()} for row in frame.to_dict("records")]
