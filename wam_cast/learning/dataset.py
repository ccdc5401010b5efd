"""Datasets of simulated casts: generated in parallel, stored, loaded and split."""

from __future__ import annotations

import shlex
from collections.abc import Callable, Iterable, Iterator
from concurrent.futures import Executor
from contextlib import closing, nullcontext
from dataclasses import dataclass
from functools import partial
from itertools import islice
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import pyarrow as pa
from numpy.typing import NDArray

from wam_cast.controller_names import DEFAULT_CONTROLLER, controller_name
from wam_cast.errors import InputError, checked_integer
from wam_cast.generation.engines import Row, checked_engine, rows_in_blocks, simulate_row
from wam_cast.generation.sampling import sample_cast
from wam_cast.parallel.workers import Workers, checked_n_workers, run_rows
from wam_cast.scenario import Scenario
from wam_cast.storage.casts_part import SCHEMA, PartError, UnreadablePartError, concatenated
from wam_cast.storage.dataset_directory import DatasetDirectory, part_rows
from wam_cast.storage.manifest import MOST_CASTS
from wam_cast.types import Array, checks_types

SPLIT = (1300, 300, 100)
"""Proportions of training, validation and test rows: the paper's numbers of casts."""

MIN_SPLIT_CASTS = 34
"""Fewest rows that are split: 26 to train with, 6 to validate and 2 to test."""


@checks_types
@dataclass(frozen=True, eq=False)
class CastDataset:
    """Casts that were drawn at random, and what became of them.

    Attributes
    ----------
    scenario
        Under which they were simulated, without a cup.
    seed
        Row i of a seed is always the same cast, and has the same noise.
    frame
        A row a cast, in order:

        - `cast`: the row's number
        - `distance` [m], `speed` [m/s], `wait` [s]: the cast as commanded, whatever noise the scenario has; its bearing is 0
        - `landing_along`, `landing_across` [m]: where the ball crossed the rim plane
        - `status`: a value of `.Status`, such as "landed"
        - `crossing_time` [s], `entry_speed` [m/s], `entry_angle` [rad], `is_slack`: how it crossed
        - `slack` [m]: of the string, the least from the landing until the whole ball was below the rim plane
        - `peak_torque_utilization`, `peak_velocity_utilization`: the largest over the joints up to the end of the drop, relative
          to their limits
        - `peak_tracking_error` [m]: of the hand

        Casts that failed are rows too: what they have no value for is nan.
    controller
        Name of what made the controller, see `.controller_name`.
    engine
        What simulated the casts: "drake" or "batch".
    """

    scenario: Scenario
    seed: int
    frame: pd.DataFrame
    controller: str = DEFAULT_CONTROLLER
    engine: str = "drake"

    def __post_init__(self) -> None:
        checked_integer("seed", self.seed, 0)

    def __len__(self) -> int:
        return len(self.frame)

    @classmethod
    @checks_types
    def load(cls, directory: str | Path, scenario: Scenario | None = None) -> CastDataset:
        """Read the dataset that `generate_dataset` wrote; by default for the `scenario` that is stored with it.

        Raises
        ------
        InputError
            If this is no dataset or an unfinished one, its casts are of another scenario, where the arm's model counts too, or they
            are not what the seed and their rows say that they must be.
        """
        store = DatasetDirectory(directory)
        manifest = store.read_manifest()
        remedy = "generate a dataset for this scenario"
        if scenario is None:
            try:
                scenario = store.read_scenario(manifest)
            except InputError as error:
                raise InputError(
                    f"dataset {directory}: {error}; or name the scenario as it is now (--scenario)"
                ) from None
            remedy = "its scenario.yaml or the arm's model changed since; restore it, or generate the dataset again"
        if scenario.fingerprint != manifest.fingerprint:
            raise InputError(
                f"dataset {directory}: its casts are of the scenario {manifest.fingerprint}, not of "
                f"{scenario.fingerprint}; {remedy}"
            )
        tables = [
            table for table in store.read_parts(manifest.n_casts, _draw(scenario, manifest.seed)) if table is not None
        ]
        n_kept = sum(table.num_rows for table in tables)
        if n_kept < manifest.n_casts:
            words = ["wam-cast", "generate", "--casts", str(manifest.n_casts), "--seed", str(manifest.seed)]
            command = shlex.join([*words, "--scenario", str(store.scenario_path), "--out", str(directory)])
            raise InputError(
                f"dataset {directory}: only {n_kept} of its {manifest.n_casts} casts are there; finish it with `{command}`"
            )
        return cls(
            scenario,
            manifest.seed,
            concatenated(tables).to_pandas(use_threads=False),
            manifest.controller,
            manifest.engine,
        )

    def split(self) -> tuple[NDArray[np.intp], NDArray[np.intp], NDArray[np.intp]]:
        """Return the row numbers to train, to validate and to test with.

        They are in the proportions 1300 : 300 : 100, the first rows to train with and the last ones to test with: rows are
        independent of each other, so their order is as good as any.

        Raises
        ------
        InputError
            If there are fewer than 34 rows.
        """
        n = len(self)
        if n < MIN_SPLIT_CASTS:
            raise InputError(
                f"dataset of {n} casts: too few to split into training, validation and test; "
                f"generate at least {MIN_SPLIT_CASTS}"
            )
        train, validation, test = np.split(np.arange(n), n * np.cumsum(SPLIT[:2]) // sum(SPLIT))
        return train, validation, test


@checks_types
def generate_dataset(
    scenario: Scenario,
    n_casts: int = 1700,
    seed: int = 0,
    *,
    make_controller: Callable[[Scenario], Any] | None = None,
    engine: str = "drake",
    executor: Executor | Workers | None = None,
    n_workers: int | None = None,
    directory: str | Path | None = None,
    force: bool = False,
    on_progress: Callable[[int, int], None] | None = None,
) -> CastDataset:
    """Simulate casts drawn at random.

    The rows depend on the scenario and the seed alone, not on who computes them or in how many runs; to the last digit on
    processors of one kind, to about 1e-11 mm on others, whose BLAS sums in another order. Where no worker processes can start,
    as in a daemonic process, a `RuntimeWarning` says so and this process simulates.

    Parameters
    ----------
    scenario, n_casts, seed
        What is cast, how often, and which casts are drawn.
    make_controller
        Makes a controller of your own from the scenario, as for `.CastSimulator`: a class or a function at the top level of a
        module that worker processes can import. If that is the script itself, they import it: call this under
        `if __name__ == "__main__":` then. The dataset keeps its name, and a directory takes no other's casts.
    engine
        `"drake"`, or `"batch"`: the same casts by `.simulate_batch`, many times as fast. Landings differ by about 1e-4 mm, with
        noise of the encoders by 0.1 mm, since a count more or less is a matter of rounding. A directory takes no other's casts.
    executor
        Runs the simulations: a Dask cluster's `Client.get_executor()`, `MPIPoolExecutor`, or any other. Threads gain nothing:
        they take turns. By default processes on this machine, or `.Workers` that are kept for more; then a cast whose process
        died is simulated again.
    n_workers
        Number of these processes, by default one for each processor.
    directory
        Where to store the dataset, part by part. A run that was interrupted goes on where it stopped, and a dataset grows
        when more casts are asked for. A part that is damaged is moved to `set_aside/`, and its casts are simulated again. By
        default the dataset is kept in memory only.
    force
        Do so with parts that can be read but are not what they must be, too, which are refused otherwise.
    on_progress
        Called with the number of casts that are finished, and `n_casts`.

    Raises
    ------
    InputError
        If a number is no integer or out of range, there is no such engine here, workers could not import the controller, the
        directory holds something else, cannot be written or is in use, or the scenario cannot be simulated.
    MachineError
        If the process of a cast dies again and again; finished parts stay.
    KeyboardInterrupt
        As always; finished parts stay.
    """
    n_casts, seed = checked_integer("n_casts", n_casts, 1, MOST_CASTS), checked_integer("seed", seed, 0)
    if n_workers is not None:
        checked_n_workers(n_workers)
        if executor is not None:
            raise InputError(f"n_workers = {n_workers}: an executor brings its own workers; leave one of the two out")
    simulator = checked_engine(engine, scenario, has_own_controller=make_controller is not None)
    controller, simulate = controller_name(make_controller), partial(simulate_row, scenario, seed)
    if make_controller is not None:
        simulate = partial(simulate, make_controller=make_controller)
    store = None if directory is None else DatasetDirectory(directory)
    with store or nullcontext():
        tables: list[pa.Table] = [SCHEMA.empty_table()] * len(part_rows(n_casts))
        if store is not None:
            store.open(scenario, seed, n_casts, controller, simulator)
            found = store.read_parts(
                n_casts, _draw(scenario, seed), set_aside=(PartError if force else UnreadablePartError,)
            )
            tables = [empty if table is None else table for empty, table in zip(tables, found, strict=True)]
        missing = [rows[len(table) :] for rows, table in zip(part_rows(n_casts), tables, strict=True)]
        todo = [row for rows in missing for row in rows]
        simulated = (
            run_rows(simulate, todo, executor, n_workers)
            if simulator == "drake"
            else rows_in_blocks(scenario, seed, todo, executor, n_workers)
        )
        with closing(simulated):
            counted = _counted(simulated, n_casts - len(todo), n_casts, on_progress)
            for part, rows in enumerate(missing):
                if rows:
                    new = pa.Table.from_pylist(list(islice(counted, len(rows))), SCHEMA)
                    tables[part] = concatenated([tables[part], new])
                    if store is not None:
                        store.write_part(part, tables[part])
    return CastDataset(scenario, seed, concatenated(tables).to_pandas(use_threads=False), controller, engine)


def _draw(scenario: Scenario, seed: int) -> Callable[[int], Array]:
    return lambda row: sample_cast(scenario, seed, row).to_array()


def _counted(
    rows: Iterable[Row], n_done: int, n_casts: int, on_progress: Callable[[int, int], None] | None
) -> Iterator[Row]:
    report = on_progress or (lambda _done, _n_casts: None)
    report(n_done, n_casts)
    for done, row in enumerate(rows, n_done + 1):
        report(done, n_casts)
        yield row
