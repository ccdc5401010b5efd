"""Whether this tree computes what another revision of it computes, bit for bit.

    python benchmarks/compare_revisions.py REVISION [--casts 200] [--plans 60] [--outcomes 40] [--sequences 10] [--seed 0]

Both trees generate a dataset, plan for random cups with both planners, execute casts with cups of two kinds (with the noise of a
typical arm in every fourth), and throw into three cups without a reset. Every number of the results is compared by its bits. What
was renamed since is compared by its new name.
"""

from __future__ import annotations

import argparse
import dataclasses
import json
import os
import subprocess
import sys
import tempfile
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import numpy as np

import wam_cast as wc

RENAMED = {
    "peak_load": "peak_torque_utilization",
    "peak_speed": "peak_velocity_utilization",
    "predicted_spread": "predicted_std",
    "predicted_peak_load": "predicted_peak_torque_utilization",
    "predicted_peak_speed": "predicted_peak_velocity_utilization",
    "clear_entry_probability": "rim_clear_probability",
}
"""New names of fields and columns by their old ones."""

SIZES = {"casts": 200, "plans": 60, "outcomes": 40, "sequences": 10}

FREE_TEXT = {"reason"}
"""Fields whose wording may change."""

Record = dict[str, Any]


def main() -> None:
    arguments = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    arguments.add_argument("revision", help="what git calls the other tree")
    for name, size in SIZES.items():
        arguments.add_argument(f"--{name}", type=int, default=size)
    arguments.add_argument("--seed", type=int, default=0)
    arguments.add_argument("--probe", metavar="FILE", type=Path, help=argparse.SUPPRESS)
    options = arguments.parse_args()
    if options.probe is not None:
        options.probe.write_text(json.dumps(probe(options)), encoding="utf-8")
        return
    here = Path(__file__).parents[1]
    with tempfile.TemporaryDirectory() as folder:
        there = Path(folder) / "tree"
        subprocess.run(["git", "worktree", "add", "-q", "--detach", there, options.revision], cwd=here, check=True)
        try:
            old, new = (_run_probe(tree, Path(folder) / name) for tree, name in ((there, "old"), (here, "new")))
        finally:
            subprocess.run(["git", "worktree", "remove", "--force", there], cwd=here, check=True)
    differences = 0
    for section, records in new.items():
        differing = list(_differences(section, old[section], records))
        differences += len(differing)
        print(f"{section}: {len(records)} compared, {len(differing)} differ")
        print(*differing[:5], sep="\n", end="\n" if differing else "")
    sys.exit(differences > 0)


def _run_probe(tree: Path, file: Path) -> dict[str, list[Record]]:
    """Return what this script finds with the package of `tree`."""
    environment = os.environ | {"PYTHONPATH": str(tree)}
    command = [sys.executable, __file__, *sys.argv[1:], "--probe", str(file)]
    subprocess.run(command, env=environment, cwd=tree, check=True)
    found: dict[str, list[Record]] = json.loads(file.read_text(encoding="utf-8"))
    return found


def probe(options: argparse.Namespace) -> dict[str, list[Record]]:
    """Return the records of each section, every number as text that tells its bits."""
    sections: dict[str, Callable[[int, np.random.Generator], list[Record]]] = {
        "casts": _generate,
        "plans": _plan,
        "outcomes": _execute,
        "sequences": _throw,
    }
    return {
        name: compute(getattr(options, name), np.random.default_rng([options.seed, i]))
        for i, (name, compute) in enumerate(sections.items())
    }


def _generate(n: int, rng: np.random.Generator) -> list[Record]:
    data = wc.generate_dataset(wc.Scenario(), n, seed=int(rng.integers(1000)))
    return [_record(row) for row in data.frame.to_dict(orient="records")]


def _plan(n: int, rng: np.random.Generator) -> list[Record]:
    model = wc.reference_model().bound_to(wc.Scenario(noise=wc.Noise.typical()))
    plans = [wc.plan_cast(model, cup, method) for cup in _cups(n, rng) for method in ("program", "gradient")]
    return [_record(_fields(plan)) for plan in plans]


def _execute(n: int, rng: np.random.Generator) -> list[Record]:
    """Cast near the middle of the cup and far from it, so that balls are caught, bounce and miss."""
    outcomes = []
    for i, cup in enumerate(_cups(n, rng)):
        noise = wc.Noise.typical() if i % 4 == 0 else wc.Noise()
        scenario = wc.Scenario.from_dict({"cup": {"restitution": (0.25, 0.6)[i % 2]}, "noise": noise.model_dump()})
        cast = wc.plan_cast(wc.reference_model(), cup).cast
        beside = np.array(cup) + rng.normal(scale=0.02, size=2)
        outcomes.append(wc.simulate_cast(scenario, cast, (float(beside[0]), float(beside[1])), noise_seed=i))
    return [_record(_fields(outcome)) for outcome in outcomes]


def _throw(n: int, rng: np.random.Generator) -> list[Record]:
    records = []
    for i in range(n):
        plans = [wc.plan_cast(wc.reference_model(), cup) for cup in _cups(3, rng)]
        casts, cups = [plan.cast for plan in plans], [plan.cup for plan in plans]
        outcomes = wc.simulate_casts(wc.Scenario(), casts, cups, noise_seed=i)
        records.append(_record({str(j): _fields(outcome) for j, outcome in enumerate(outcomes)}))
    return records


def _cups(n: int, rng: np.random.Generator) -> list[tuple[float, float]]:
    """Return cups on the floor within the reference model's reach [m]."""
    radii, bearings = rng.uniform(*wc.reference_model().reach, n), rng.uniform(-2.0, 2.0, n)
    return [(float(r * np.cos(b)), float(r * np.sin(b))) for r, b in zip(radii, bearings, strict=True)]


def _fields(thing: Any) -> Record:
    return {field.name: getattr(thing, field.name) for field in dataclasses.fields(thing)}


def _record(values: Any) -> Any:
    """Return nested values with every float as hexadecimal text, under new names."""
    if isinstance(values, dict):
        return {RENAMED.get(key, key): _record(value) for key, value in values.items() if key not in FREE_TEXT}
    if dataclasses.is_dataclass(values):
        return _record(_fields(values))
    if isinstance(values, np.ndarray):
        return _record(values.tolist())
    if isinstance(values, list | tuple):
        return [_record(value) for value in values]
    return float(values).hex() if isinstance(values, float) else values


def _differences(section: str, old: list[Record], new: list[Record]) -> Iterator[str]:
    for number, (was, now) in enumerate(zip(old, new, strict=True)):
        names = [name for name in {**was, **now} if was.get(name) != now.get(name)]
        if names:
            yield f"  {section} {number}: {', '.join(f'{name} {was.get(name)} -> {now.get(name)}' for name in names)}"


if __name__ == "__main__":
    main()
