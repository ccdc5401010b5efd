"""What `map` does: it maps the floor, and goes on where a map to the same picture was interrupted."""

from __future__ import annotations

import shutil
from pathlib import Path
from typing import TYPE_CHECKING

import wam_cast as wc
from wam_cast.cli import options
from wam_cast.cli.terminal import err, phase_progress
from wam_cast.errors import MachineError

if TYPE_CHECKING:
    from wam_cast.experiments.floor_map import FloorMap, MapSize


def write_map(
    picture: Path,
    model: wc.ForwardModel,
    size: MapSize,
    planner: options.Planner,
    solver: options.Solver,
    seed: int,
    workers: int | None,
    command: str,
) -> FloorMap:
    """Map the floor, and write its picture.

    Until that is written finished casts are kept in a directory beside it. If the work is interrupted and something is finished,
    say so, and that `command` goes on.
    """
    from wam_cast.experiments.floor_map import map_floor
    from wam_cast.experiments.floor_picture import write_floor_picture

    unfinished = picture.with_name(f"{picture.name}.unfinished")
    try:
        with phase_progress() as report:
            floor = map_floor(
                model,
                size,
                method=planner,
                solver=solver,
                seed=seed,
                n_workers=workers,
                directory=unfinished,
                on_progress=report,
            )
        write_floor_picture(floor, picture)
    except (KeyboardInterrupt, MachineError):
        if any(unfinished.glob("phases/*.json")):
            err.print(f"finished casts are kept in {unfinished}. Go on with: {command}")
        else:
            shutil.rmtree(unfinished, ignore_errors=True)
        raise
    shutil.rmtree(unfinished)
    return floor
