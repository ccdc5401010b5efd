"""How often the ball ends in the cup, by how much the landing misses its middle, and how small the cup may be.

    python benchmarks/hit_rate.py [--cups 200] [--seed 0] [--region line|floor] [--noise] [--smallest] [--planner NAME]
                                  [--restitution E]

Cups are drawn at random over the reach of the reference model, on the line y = 0 or over the floor that joint 1 can turn to, where
the turn is part of every cast. `--noise` executes with what is typical of a real arm, and plans for it. `--smallest` lowers the
cup's inner radius, millimetre by millimetre from 30 mm, for as long as at least 98 % are caught, and tells where that ends. Beside
the planners, grid search and CMA-ES on the model may be named, at as many evaluations as the program uses about.
"""

from __future__ import annotations

import argparse
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from typing import cast

import pandas as pd
from planners.black_box import Search, search_cast
from planners.contenders import predicted_miss
from rich.console import Console
from rich.progress import Progress

from wam_cast.cast import Cast
from wam_cast.casting_plane import from_polar
from wam_cast.cli.terminal import out, print_table
from wam_cast.experiments.statistics import describe
from wam_cast.experiments.trials import Polar, Trial, draw_cups, execute, failures, hits
from wam_cast.learning.forward_model import ForwardModel
from wam_cast.learning.reference import reference_model
from wam_cast.parallel.seeds import Purpose, derived_seed
from wam_cast.parallel.workers import Workers
from wam_cast.planning.plan import METHODS, Method, plan_cast
from wam_cast.planning.reach import Reach
from wam_cast.scenario import Cup, Noise, Scenario
from wam_cast.storage.manifest import current_versions

KINDS = {"nearly inelastic": 0.25, "lively": 0.6}
RADII = [radius / 1000 for radius in range(30, 20, -1)]
LEAST_RATE = 0.98

BUDGET = 600
"""Evaluations of the model that a search has for each cup: about what the program uses."""

Throw = Callable[[ForwardModel, str, str], pd.DataFrame]
Setting = tuple[str, str, Cup]
"""A planner, a kind of cup by name, and that cup."""
Table = tuple[Sequence[str], Sequence[Sequence[str]]]
"""Headings and rows."""


def main() -> None:
    arguments = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    arguments.add_argument("--cups", type=int, default=200)
    arguments.add_argument("--seed", type=int, default=0)
    arguments.add_argument("--region", choices=("line", "floor"), default="line")
    arguments.add_argument("--noise", action="store_true")
    arguments.add_argument("--smallest", action="store_true")
    arguments.add_argument(
        "--planner", action="append", choices=(*METHODS, "grid", "cma-es"), help="repeatable; default: both planners"
    )
    arguments.add_argument(
        "--restitution",
        action="append",
        type=float,
        help=f"of the cup; repeatable; default: {' and '.join(map(str, KINDS.values()))}",
    )
    arguments.add_argument("--workers", type=int, help="default: one for each processor")
    options = arguments.parse_args()
    model = reference_model()
    noise = Noise.typical() if options.noise else Noise()
    cups = draw_cups(Reach.of(model), options.cups, options.seed, options.region)
    with Workers(options.workers) as workers, Progress(console=Console(stderr=True), transient=True) as bar:

        def throw(bound: ForwardModel, method: str, name: str) -> pd.DataFrame:
            trials = _plan(bound, cups, method, options.seed)
            task = bar.add_task(name, total=len(trials))
            frame = execute(bound.scenario, trials, workers, report=lambda n: bar.update(task, completed=n))
            bar.remove_task(task)
            return frame

        study = _smallest if options.smallest else _rates
        kinds = {f"restitution {value:g}": value for value in options.restitution or ()} or KINDS
        headings, rows = study(model, noise, _settings(options.planner or METHODS, kinds), throw)
    nearest, farthest = model.reach
    versions = ", ".join(f"{name} {number}" for name, number in current_versions().items())
    print_table(rows, headings)
    out.print(
        f"{options.cups} random cups from {nearest:.3f} to {farthest:.3f} m on the {options.region}, noise "
        f"{'on' if options.noise else 'off'}, seed {options.seed}; {versions}"
    )


def _plan(model: ForwardModel, cups: list[Polar], method: str, seed: int) -> list[Trial]:
    return [
        Trial(
            _cast(model, cup, method, derived_seed(seed, Purpose.SEARCH, i)), cup, derived_seed(seed, Purpose.NOISE, i)
        )
        for i, cup in enumerate(cups)
    ]


def _cast(model: ForwardModel, cup: Polar, method: str, seed: int) -> Cast:
    if method in METHODS:
        return plan_cast(model, from_polar(*cup), cast("Method", method)).cast
    radius, bearing = cup
    objective = predicted_miss(model, radius)
    found = search_cast(cast("Search", method), model.scenario, objective, BUDGET, seed=seed)
    return Cast.from_array(found.parameters, bearing)


def _rates(model: ForwardModel, noise: Noise, settings: Iterable[Setting], throw: Throw) -> Table:
    headings = ["planner", "cup", "caught", "95 % interval", "miss: median, P95, max [mm]"]
    headings += ["lateral: median, P95, max [mm]", "not caught"]
    rows: list[Sequence[str]] = []
    for method, kind, cup in settings:
        trials = throw(model.bound_to(Scenario(cup=cup, noise=noise)), method, f"{method}, {kind}")
        distances = _millimetres(trials["miss"]), _millimetres(trials["lateral"].abs())
        rows.append((method, kind, *_caught(trials), *distances, _failures(trials)))
    return headings, rows


def _smallest(model: ForwardModel, noise: Noise, settings: Iterable[Setting], throw: Throw) -> Table:
    headings = ["planner", "cup", "inner radius [mm]", "caught", "95 % interval", "not caught"]
    rows: list[Sequence[str]] = []
    for method, kind, cup in settings:
        for radius in RADII:
            smaller = cup.model_copy(update={"inner_radius": radius})
            trials = throw(
                model.bound_to(Scenario(cup=smaller, noise=noise)), method, f"{method}, {kind}, {1e3 * radius:g} mm"
            )
            rows.append((method, kind, f"{1e3 * radius:g}", *_caught(trials), _failures(trials)))
            if trials["is_caught"].sum() < LEAST_RATE * len(trials):
                break
    return headings, rows


def _settings(methods: Sequence[str], kinds: Mapping[str, float]) -> Iterator[Setting]:
    for method in methods:
        for kind, restitution in kinds.items():
            yield method, kind, Cup(restitution=restitution)


def _caught(trials: pd.DataFrame) -> tuple[str, str]:
    found = hits(trials)
    low, high = found["hit_interval"]
    return f"{found['n_caught']} of {found['n_cups']}", f"{low:.1%} to {high:.1%}"


def _millimetres(misses: pd.Series) -> str:
    found = describe(misses.to_numpy())
    values = (found["median"], found["p95"], found["max"])
    return ", ".join("-" if value is None else f"{1e3 * value:.1f}" for value in values)


def _failures(trials: pd.DataFrame) -> str:
    return ", ".join(f"{count} {status}" for status, count in failures(trials).items()) or "-"


if __name__ == "__main__":
    main()
