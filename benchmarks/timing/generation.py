"""How fast datasets are generated on all cores, and what memory a large one takes while it grows."""

from __future__ import annotations

import os
import tempfile
import time
from functools import partial
from pathlib import Path

import psutil

from wam_cast.cli.terminal import out, print_table
from wam_cast.learning.dataset import generate_dataset
from wam_cast.parallel.workers import Workers
from wam_cast.scenario import Scenario


def print_parallel_efficiency(n_casts: int, seed: int) -> None:
    """Print how much faster all cores generate casts by Drake than one; workers are started before."""
    n_cores = os.cpu_count() or 1
    seconds = {}
    for n_workers in sorted({1, n_cores}):
        with Workers(n_workers) as workers:
            generate = partial(generate_dataset, Scenario(), seed=seed, executor=workers)
            generate(2 * n_workers)
            start = time.perf_counter()
            generate(n_casts)
            seconds[n_workers] = time.perf_counter() - start
    speedup = seconds[1] / seconds[n_cores]
    out.print(
        f"generation by Drake of {n_casts} casts: {n_cores} workers are {speedup:.2f} times as fast as one, "
        f"a parallel efficiency of {speedup / n_cores:.0%}"
    )


def print_large_dataset(n_casts: int, seed: int) -> None:
    """Print the time that the batched engine needs for a dataset in a directory, and the processes' memory as it grows."""
    process, start = psutil.Process(), time.perf_counter()
    rows: list[tuple[str, str, str]] = []

    def memory() -> float:
        running = [process, *process.children(recursive=True)]
        return sum(one.memory_info().rss for one in running if one.is_running()) / 1e6

    def note(n_done: int, n_all: int) -> None:
        if n_done * 10 // n_all > len(rows):
            rows.append((f"{n_done:,}", f"{time.perf_counter() - start:.0f}", f"{memory():.0f}"))

    with tempfile.TemporaryDirectory() as folder:
        directory = Path(folder) / "many"
        generate_dataset(Scenario(), n_casts, seed, engine="batch", directory=directory, on_progress=note)
        size = sum(part.stat().st_size for part in directory.rglob("*") if part.is_file()) / 1e6
    out.print(
        f"generation by the batched engine of {n_casts:,} casts, {size:.0f} MB on disk, on {os.cpu_count()} cores"
    )
    print_table(rows, ["casts", "seconds", "memory of all processes [MB]"])
