"""Random scenario files: each is simulated or refused in one line; none diverges unseen, ends in a traceback, or hangs.

    python benchmarks/random_scenarios.py [--files 1000] [--seed 0] [--workers N] [--limit 120] [--keep FOLDER]

Each file sets some fields of the scenario, drawn over what is documented and now and then beyond, so that some combinations are
invalid. It is read, and a random cast is simulated twice, the second time into a cup that stands where it landed. A cast that
diverged is simulated again at half the step: what remains is the robot's own doing, what goes was the integrator's. Beforehand
`check_loop` says which controllers are unstable. `--keep` keeps the files that anything was wrong with. The exit code is 1 if
there are any.
"""

from __future__ import annotations

import argparse
import math
import multiprocessing
import sys
import tempfile
import time
import traceback
from collections import Counter
from collections.abc import Iterator
from multiprocessing.connection import Connection
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import yaml
from rich.console import Console
from rich.progress import Progress

from wam_cast.errors import InputError
from wam_cast.generation.sampling import sample_cast
from wam_cast.scenario import Scenario
from wam_cast.simulation.loop_stability import check_loop
from wam_cast.simulation.outcome import Outcome, Status
from wam_cast.simulation.simulator import CastSimulator

Values = dict[str, Any]

SHARE_SET = 0.25
"""Of the fields, in a file; the others keep their default."""

SHARE_ODD = 0.01
"""Of the fields that are set: to something that is no such value at all."""

ODD = (-1.0, 0, 0.0, 1e9, 1e-9, math.nan, math.inf, "three", True, None, [], [1.0], {"a": 1})


class Result(NamedTuple):
    """What became of a file."""

    kind: str
    """ "simulated", "refused", "unstable", "step too long", "diverged", "traceback" or "hung"."""
    words: str
    """Statuses, or the line."""


BAD = ("step too long", "diverged", "traceback", "hung")


def draw(seed: int) -> Values:
    """Return the values of one random file."""
    rng = np.random.default_rng(seed)

    def uniform(low: float, high: float) -> float:
        return float(f"{rng.uniform(low, high):.4g}")

    def scaled(value: float, factor: float) -> float:
        return float(f"{value * math.exp(rng.uniform(-math.log(factor), math.log(factor))):.4g}")

    def seven(low: float, high: float) -> float | list[float]:
        return uniform(low, high) if rng.random() < 0.5 else [uniform(low, high) for _ in range(7)]

    def interval(low: float, high: float) -> list[float]:
        ends = [uniform(low, high), uniform(low, high)]
        return ends if rng.random() < 0.1 else sorted(ends)

    length, radius, rim = uniform(0.2, 1.5), scaled(0.02, 2), uniform(0.08, 0.3)
    base = uniform(0, 0.5) if rng.random() < 0.3 else 0.0
    start = rim + base + length + radius + uniform(-0.02, 0.15)
    # Most are within an arm's reach: its shoulder is 0.346 m from the mounting, and it is 0.91 m long.
    mount = str(rng.choice(["ceiling", "ceiling", "floor", "wall"]))
    shoulder = start + uniform(0.0, 0.3)
    mount_height = shoulder + {"ceiling": 0.346, "floor": -0.346, "wall": 0.0}[mount]
    start_radius = uniform(0.15, 0.35) + (0.35 if mount == "wall" else 0.0)
    fields: dict[str, Any] = {
        "gravity": scaled(9.81, 6),
        "arm.mount": mount,
        "arm.mount_height": round(max(mount_height, 0.0), 4),
        "arm.wrist_pitch": uniform(-1.6, 1.6),
        "arm.coulomb_friction": seven(0, 2),
        "arm.viscous_friction_scale": seven(0.2, 5),
        "arm.mass_scale": seven(0.5, 2),
        "arm.inertia_scale": seven(0.5, 2),
        "arm.rotor_inertia_scale": seven(0.5, 2),
        "arm.torque_scale": seven(0.7, 1.3),
        "arm.knee_speed": uniform(0.1, 1),
        "arm.encoder_offset": seven(-0.05, 0.05),
        "arm.base_tilt": [uniform(-0.05, 0.05), uniform(-0.05, 0.05)],
        "string.length": length,
        "string.n_links": int(rng.integers(1, 41)),
        "string.mass": scaled(0.003, 6),
        "string.bending_damping": scaled(8e-7, 10),
        "string.bending_stiffness": scaled(1e-5, 10),
        "string.hook_damping": scaled(1e-4, 10),
        "string.knot_damping": scaled(1e-5, 10),
        "ball.mass": scaled(0.02, 10),
        "ball.radius": radius,
        "ball.inertia_factor": uniform(0.3, 0.667),
        "cup.rim_height": round(rim + base, 4),
        "cup.base_height": base,
        "cup.base_radius": uniform(0.04, 0.4),
        "cup.offset": [uniform(-0.02, 0.02), uniform(-0.02, 0.02)],
        "cup.inner_radius": radius * uniform(0.95, 2),
        "cup.wall_thickness": scaled(0.0045, 2),
        "cup.bottom_thickness": scaled(0.006, 2),
        "cup.stiffness": scaled(2e4, 5),
        "cup.restitution": uniform(0.05, 0.95),
        "cup.friction": uniform(0, 1),
        "controller.kp": scaled(6000, 4),
        "controller.kd": scaled(250, 4),
        "controller.posture_stiffness": [scaled(value, 4) for value in (20, 20, 20, 20, 5, 5, 0.5)],
        "controller.posture_damping": [scaled(value, 4) for value in (3, 3, 3, 3, 0.5, 0.5, 0.02)],
        "controller.period": float(rng.choice([0.001, 0.002, 0.004, 0.01])),
        "controller.delay": int(rng.integers(0, 4)),
        "motion.start_radius": start_radius,
        "motion.start_height": round(start, 4),
        "motion.min_move_duration": uniform(0.1, 0.5),
        "motion.drop_distance": uniform(0.1, 0.5),
        "motion.drop_duration": uniform(0.25, 0.8),
        "motion.hold_duration": uniform(0.5, 3),
        "noise.torque": uniform(0, 0.02),
        "noise.encoder_counts": int(rng.choice([0, 1024, 4096])),
        "noise.swing": uniform(0, 0.05),
        "noise.distance": uniform(0, 0.01),
        "noise.speed": uniform(0, 0.05),
        "noise.wait": uniform(0, 0.01),
        "simulation.max_step": scaled(0.002, 4),
        "simulation.contact_accuracy": scaled(0.1, 4),
        "bounds.distance": interval(0.02, 0.4),
        "bounds.speed": interval(0.1, 1.2),
        "bounds.wait": interval(0, 1),
    }
    together = (
        *("string.length", "ball.radius", "cup.rim_height", "cup.base_height", "cup.inner_radius"),
        *("motion.start_height", "motion.start_radius", "motion.drop_distance", "arm.mount", "arm.mount_height"),
    )
    has_own_place = rng.random() < 0.7
    values: Values = {}
    for name, value in fields.items():
        is_set = has_own_place if name in together else rng.random() < SHARE_SET
        if is_set:
            odd = rng.random() < SHARE_ODD
            *group, last = name.split(".")
            owner = values.setdefault(group[0], {}) if group else values
            owner[last] = ODD[int(rng.integers(len(ODD)))] if odd else value
    if rng.random() < 0.03:
        values[str(rng.choice(["strings", "robot"]))] = {"length": 1}
    return values


def tried(path: Path, seed: int) -> Result:
    """Return what becomes of a file."""
    try:
        scenario = Scenario.from_yaml(path)
        check_loop(scenario, scenario)
    except InputError as error:
        line = str(error).removeprefix(f"scenario {path}: ")
        kind = "unstable" if "unstable" in line else "refused"
        return Result(kind if "\n" not in line else "traceback", line)
    try:
        simulator = CastSimulator(scenario)
        outcomes = list(_cast(simulator, seed))
    except InputError as error:
        return Result("refused" if "\n" not in str(error) else "traceback", str(error))
    statuses = ", ".join(outcome.status.value for outcome in outcomes)
    if all(outcome.status is not Status.DIVERGED for outcome in outcomes):
        return Result("simulated", statuses)
    step = simulator.integration.max_step
    finer = {"simulation": scenario.simulation.model_copy(update={"max_step": step / 2})}
    again = list(_cast(CastSimulator(scenario.model_copy(update=finer)), seed))
    remains = any(outcome.status is Status.DIVERGED for outcome in again)
    return Result("diverged" if remains else "step too long", f"{statuses} in steps of up to {step:.3g} s")


def _cast(simulator: CastSimulator, seed: int) -> Iterator[Outcome]:
    """Simulate a cast that only lands, and one more into a cup, where it would land if it did as the first one did."""
    scenario = simulator.scenario
    first = simulator.simulate(sample_cast(scenario, seed, 0), noise_seed=seed)
    yield first
    cup = first.landing if np.all(np.isfinite(first.landing)) else (0.6, 0.0)
    yield simulator.simulate(sample_cast(scenario, seed, 0), (float(cup[0]), float(cup[1])), noise_seed=seed)


def _serve(connection: Connection) -> None:
    """Try the files that come in, in a process that can be ended."""
    while True:
        try:
            path, seed = connection.recv()
        except EOFError:  # no more are to come
            return
        try:
            result = tried(path, seed)
        except BaseException as error:  # whatever it is, it is to be counted
            result = Result("traceback", f"{traceback.format_exc(limit=-3)}{error!r}")
        connection.send(result)


class Worker:
    """A process that tries one file after the other, and is ended if one takes too long."""

    def __init__(self) -> None:
        self._start()

    def _start(self) -> None:
        context = multiprocessing.get_context("spawn")
        self._connection, far_end = context.Pipe()
        self._process = context.Process(target=_serve, args=(far_end,), daemon=True)
        self._process.start()
        far_end.close()

    def send(self, path: Path, seed: int) -> None:
        """Begin with a file."""
        self._connection.send((path, seed))
        self._since = time.monotonic()

    def result(self, limit: float) -> Result | None:
        """Return the result, if it is there or never will be."""
        try:
            if self._connection.poll(0.02):
                return self._connection.recv()
        except EOFError:
            self._start()
            return Result("traceback", "the process died")
        if time.monotonic() - self._since < limit:
            return None
        self._process.kill()
        self._start()
        return Result("hung", f"more than {limit:g} s")


def main() -> None:
    arguments = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    arguments.add_argument("--files", type=int, default=1000)
    arguments.add_argument("--seed", type=int, default=0)
    arguments.add_argument("--workers", type=int, default=2)
    arguments.add_argument(
        "--limit", type=float, default=120.0, help="seconds that a file may take; default: %(default)s"
    )
    arguments.add_argument("--keep", type=Path, help="folder for the files that anything was wrong with")
    options = arguments.parse_args()
    counts, lines = Counter[str](), Counter[tuple[str, str]]()
    console = Console(stderr=True)
    with tempfile.TemporaryDirectory() as folder, Progress(console=console, transient=True) as bar:
        task = bar.add_task("files", total=options.files)
        for seed, path, result in _results(Path(folder), options):
            bar.advance(task)
            counts[result.kind] += 1
            lines[result.kind, _first_words(result)] += 1
            if result.kind in BAD:
                console.print(f"file {seed}: {result.kind}: {result.words}", markup=False)
                if options.keep is not None:
                    options.keep.mkdir(parents=True, exist_ok=True)
                    (options.keep / path.name).write_text(path.read_text(encoding="utf-8"), encoding="utf-8")
    for kind, count in counts.most_common():
        print(f"{count:5d} {kind}")
        for (_, words), n in sorted(
            ((key, n) for key, n in lines.items() if key[0] == kind), key=lambda pair: -pair[1]
        ):
            print(f"      {n:5d} {words}")
    sys.exit(1 if any(counts[kind] for kind in BAD) else 0)


def _first_words(result: Result) -> str:
    """Return what a line is about: of a refusal what comes before the first number."""
    if result.kind in ("refused", "unstable"):
        return " ".join(result.words.replace("=", ":").split(":")[0].split()[:5])
    return result.words.splitlines()[-1][:100] if result.words else ""


def _results(folder: Path, options: argparse.Namespace) -> Iterator[tuple[int, Path, Result]]:
    """Yield the number, the path and the result of each file, as they come."""
    todo = iter(range(options.seed, options.seed + options.files))
    busy: dict[Worker, tuple[int, Path]] = {}
    idle = [Worker() for _ in range(min(options.workers, options.files))]
    while True:
        while idle and (seed := next(todo, None)) is not None:
            path = folder / f"scenario-{seed}.yaml"
            path.write_text(yaml.safe_dump(draw(seed), sort_keys=False), encoding="utf-8")
            idle[-1].send(path, seed)
            busy[idle.pop()] = seed, path
        if not busy:
            return
        for worker in list(busy):
            result = worker.result(options.limit)
            if result is not None:
                yield *busy.pop(worker), result
                idle.append(worker)


if __name__ == "__main__":
    main()
