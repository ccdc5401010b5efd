"""How fast everything is that takes time, section by section, in one run.

    python benchmarks/speed.py [SECTION ...] [--casts 40] [--sizes 16 32 64 128 256] [--many 100000] [--seed 1]

Ratios are taken within one run, with the least and the greatest of three rounds; absolute figures are of the machine that runs it.
Sections: drake (its plant alone, free casts, casts into cups), batched (by batch size and precision; on a machine with a GPU JAX
takes it: pass larger --sizes there), mujoco, parallel (generation on all cores), many (a large dataset and its memory),
learning (fits and plans over the number of casts). All of them take about an hour on two cores.
"""

from __future__ import annotations

import argparse
import os
from collections.abc import Callable

SECTIONS = ("drake", "batched", "mujoco", "parallel", "many", "learning")
ON_ALL_CORES = {"parallel", "many"}


def parse() -> argparse.Namespace:
    """Return what is asked for."""
    arguments = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    arguments.add_argument("sections", nargs="*", metavar="SECTION", help=f"default: all of {', '.join(SECTIONS)}")
    arguments.add_argument("--casts", type=int, default=40)
    arguments.add_argument("--sizes", type=int, nargs="+", default=[16, 32, 64, 128, 256])
    arguments.add_argument("--many", type=int, default=100_000)
    arguments.add_argument("--seed", type=int, default=1)
    options = arguments.parse_args()
    unknown = sorted(set(options.sections) - set(SECTIONS))
    if unknown:
        arguments.error(f"no section {unknown[0]!r}; there are {', '.join(SECTIONS)}")
    options.sections = options.sections or SECTIONS
    return options


def use_one_core() -> None:
    """Let neither the numerical libraries' threads nor XLA's help. It counts only before they are loaded."""
    os.environ.update(OMP_NUM_THREADS="1", OPENBLAS_NUM_THREADS="1")
    os.environ.setdefault("XLA_FLAGS", "--xla_cpu_multi_thread_eigen=false intra_op_parallelism_threads=1")


def run(section: str, options: argparse.Namespace) -> None:
    """Print one section."""
    if section not in ON_ALL_CORES:
        use_one_core()
    from learning_growth import print_growth
    from timing.batched import print_batched
    from timing.drake_path import print_drake_path
    from timing.generation import print_large_dataset, print_parallel_efficiency
    from timing.mujoco_twin import print_mujoco_twin

    from wam_cast.generation.sampling import sample_cast
    from wam_cast.scenario import Scenario

    casts = [sample_cast(Scenario(), options.seed, row) for row in range(options.casts)]
    by_section: dict[str, Callable[[], None]] = {
        "drake": lambda: print_drake_path(casts),
        "batched": lambda: print_batched(casts[:8], options.sizes),
        "mujoco": lambda: print_mujoco_twin(casts),
        "parallel": lambda: print_parallel_efficiency(8 * options.casts, options.seed),
        "many": lambda: print_large_dataset(options.many, options.seed),
        "learning": lambda: print_growth((100, 300, 1000, 2000, 10_000, 20_000), 10),
    }
    by_section[section]()


if __name__ == "__main__":
    import multiprocessing

    options = parse()
    for section in options.sections:  # a process each: what one has loaded or compiled is not the next one's
        process = multiprocessing.get_context("spawn").Process(target=run, args=(section, options))
        process.start()
        process.join()
        if process.exitcode:
            raise SystemExit(process.exitcode)
