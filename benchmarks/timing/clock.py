"""Processor times of runs that are to be compared, and their ratios with how far they spread."""

from __future__ import annotations

import time
from collections.abc import Callable

import numpy as np

from wam_cast.types import Array

N_ROUNDS = 3


def seconds_by_round(runs: dict[str, Callable[[int], object]], n: int) -> dict[str, Array]:
    """Return each run's mean processor time over 0 to `n - 1` [s], one a round. Runs are taken in turn, since others disturb."""
    spent = {name: np.zeros((N_ROUNDS, n)) for name in runs}
    for k in range(N_ROUNDS):
        for i in range(n):
            for name, run in runs.items():
                start = time.process_time()
                run(i)
                spent[name][k, i] = time.process_time() - start
    return {name: one.mean(axis=1) for name, one in spent.items()}


def ratio(own: Array, base: Array) -> str:
    """Return the ratio of two runs, the median over the rounds, and its least and greatest."""
    ratios = own / base
    return f"{np.median(ratios):.2f} ({ratios.min():.2f}-{ratios.max():.2f})"
