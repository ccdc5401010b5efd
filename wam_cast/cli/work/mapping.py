"""`wam-cast map`, which keeps finished casts until its picture is drawn, so that it goes on where it was interrupted."""

from __future__ import annotations

import os
import shutil
from collections.abc import Container, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Annotated

import typer

from wam_cast.cli import model_choice, options, results
from wam_cast.cli.results import print_json
from wam_cast.cli.terminal import err, out, phase_progress
from wam_cast.errors import InputError, MachineError


def map_(
    picture: Annotated[
        Path, typer.Option("--out", metavar="FILE.png", help="Where the figure goes (also .pdf, .svg).")
    ],
    radii: Annotated[int, typer.Option(min=2, help="How many distances from the base axis.")] = 12,
    bearings: Annotated[int, typer.Option(min=2, help="How many cups at each of them.")] = 9,
    casts: Annotated[
        int, typer.Option(min=1, help="How many for each cup. Without noise all would be alike: one is cast.")
    ] = 1,
    scenario: options.Scenario = None,
    model: options.Model = None,
    planner: options.Planner = "program",
    solver: options.Solver = None,
    train: options.Train = False,
    seed: Annotated[int, typer.Option(min=0, help="Draws the scenario's noise.")] = 0,
    workers: options.Workers = None,
    as_json: options.AsJson = False,
) -> None:
    """Plan and execute casts for cups all over the reachable floor, and draw it as a map.

    The work is done when the map is drawn: the exit code is 0 whatever became of the balls. An interrupted map goes on when it is
    started again: until it is drawn, finished casts are kept beside it, in FILE.png.unfinished.
    """
    from wam_cast.experiments.floor_map import MapSize, map_floor
    from wam_cast.experiments.floor_picture import write_floor_picture
    from wam_cast.visualization.picture_files import check_picture

    check_picture(picture)
    size = MapSize(radii, bearings, casts)
    _, forward = model_choice.scenario_and_model(scenario, model, train)
    chosen = {"scenario": scenario, "model": model, "planner": planner, "solver": solver, "seed": seed}
    command = model_choice.command_line(
        "map", out=picture, radii=radii, bearings=bearings, casts=casts, workers=workers, **chosen
    )
    begun: set[str] = set()
    with _kept_until_drawn(picture, command, begun) as finished:
        with phase_progress() as report:

            def note(phase: str, done: int, total: int) -> None:
                begun.add(phase)
                report(phase, done, total)

            floor = map_floor(
                forward,
                size,
                method=planner,
                solver=solver,
                seed=seed,
                n_workers=workers,
                directory=finished,
                on_progress=note,
            )
        if as_json:
            print_json({"picture": str(picture), **floor.record()})
        else:
            results.print_map(floor)
        write_floor_picture(floor, picture)
    if not as_json:
        out.print(f"the map is in {picture}")


@contextmanager
def _kept_until_drawn(picture: Path, command: str, begun: Container[str]) -> Iterator[Path]:
    """Give a directory beside `picture` for finished casts, which goes once the context ends well.

    If the context is interrupted, the machine fails, or something cannot be written after the casting has `begun`, and something
    is finished, say so, and that `command` goes on. Before, what is there may be another map's.

    Raises `.InputError` if something else is in its place.
    """
    from wam_cast.experiments.floor_map import UnfinishedMap

    unfinished = picture.with_name(f"{picture.name}.unfinished")
    if os.path.islink(unfinished):  # noqa: PTH114 -- of any name; what it leads to is not the map's to remove
        raise InputError(
            f"{unfinished} is a link, where finished casts are to be kept; move it away, or choose another --out"
        )
    UnfinishedMap.is_begun(unfinished)
    try:
        yield unfinished
    except (KeyboardInterrupt, MachineError, InputError, OSError) as error:
        if "casting" in begun or isinstance(error, KeyboardInterrupt | MachineError):
            if any(unfinished.glob("phases/*.json")):
                err.print(f"finished casts are kept in {unfinished}. Go on with: {command}")
            else:
                shutil.rmtree(unfinished, ignore_errors=True)
        raise
    shutil.rmtree(unfinished)
