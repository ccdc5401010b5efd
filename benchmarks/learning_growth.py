"""How the time and the memory of a fit, and the time of a plan, grow with the number of casts.

    python benchmarks/learning_growth.py [--casts 100 300 1000 2000 10000 20000] [--cups 10]

Up to 5,000 training casts fits are exact, beyond by landmarks. Landings are synthetic, a formula (`synthetic_landings.py`): nothing
is simulated. Times are processor time on one core in units of the first row's; of a plan the median over cups over the reach.
The exponent p is that of growth as casts^p since the row before. Memory is the peak of what a fit takes.
"""

from __future__ import annotations

import argparse
import os
import time
import tracemalloc
from collections.abc import Sequence
from typing import NamedTuple

# One core: the numerical libraries' threads must not help. It counts only before they are loaded.
os.environ.update(OMP_NUM_THREADS="1", OPENBLAS_NUM_THREADS="1")

import numpy as np
from synthetic_landings import synthetic_dataset

from wam_cast.cli.terminal import out, print_table
from wam_cast.learning.forward_model import ForwardModel
from wam_cast.planning.plan import plan_cast

HEADINGS = ("casts", "training casts", "kernel at", "fit", "p", "plan", "p", "memory [MB]", "p", "test RMSE [mm]")


class Growth(NamedTuple):
    """What one size takes."""

    n_casts: int
    n_train: int
    n_landmarks: int | None
    fit_s: float
    plan_s: float
    memory_mb: float
    test_rmse: float


def measure(n_casts: int, n_cups: int) -> Growth:
    """Fit a model to so many casts and plan with it."""
    data = synthetic_dataset(n_casts)
    tracemalloc.start()  # which costs a fit little, for it makes few objects
    start = time.process_time()
    model = ForwardModel.fit(data)
    fit_s, memory_mb = time.process_time() - start, tracemalloc.get_traced_memory()[1] / 1e6
    tracemalloc.stop()
    plans = []
    for radius in np.linspace(*model.reach, n_cups + 2)[1:-1]:
        start = time.process_time()
        plan_cast(model, (float(radius), 0.0))
        plans.append(time.process_time() - start)
    info = model.info
    return Growth(n_casts, info.n_train, info.n_landmarks, fit_s, float(np.median(plans)), memory_mb, info.test_rmse)


def print_growth(casts: Sequence[int], n_cups: int) -> None:
    """Print a row for each number of casts."""
    found = [measure(n_casts, n_cups) for n_casts in casts]
    rows = []
    for before, one in zip([None, *found], found, strict=False):
        columns = [_grown(name, one, before, found[0]) for name in ("fit_s", "plan_s")]
        rows.append(
            (
                str(one.n_casts),
                str(one.n_train),
                "all" if one.n_landmarks is None else str(one.n_landmarks),
                *(text for column in columns for text in column),
                f"{one.memory_mb:.0f}",
                _exponent("memory_mb", one, before),
                f"{1e3 * one.test_rmse:.2f}",
            )
        )
    print_table(rows, HEADINGS)
    out.print(f"first row: fit {found[0].fit_s:.2f} s, plan {1e3 * found[0].plan_s:.0f} ms")


def main() -> None:
    arguments = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    arguments.add_argument("--casts", type=int, nargs="+", default=(100, 300, 1000, 2000, 10_000, 20_000))
    arguments.add_argument("--cups", type=int, default=10)
    options = arguments.parse_args()
    print_growth(options.casts, options.cups)


def _grown(name: str, one: Growth, before: Growth | None, first: Growth) -> tuple[str, str]:
    return f"{getattr(one, name) / getattr(first, name):.3g}", _exponent(name, one, before)


def _exponent(name: str, one: Growth, before: Growth | None) -> str:
    """Return the p of growth as casts^p."""
    if before is None:
        return "-"
    ratio = getattr(one, name) / getattr(before, name)
    return f"{np.log(ratio) / np.log(one.n_casts / before.n_casts):.1f}"


if __name__ == "__main__":
    main()
