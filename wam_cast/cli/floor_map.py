"""The map of the floor from the command line."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

from wam_cast.cli.output import phase_progress
from wam_cast.storage.atomic import check_writable

if TYPE_CHECKING:
    from wam_cast.experiments.floor_map import FloorMap, MapSize
    from wam_cast.learning.forward_model import ForwardModel
    from wam_cast.planning.plan import Method, Solver


def check_picture(path: Path) -> None:
    """Refuse, before any work is done, a picture that could not be written after it."""
    from wam_cast.visualization.picture_files import picture_format

    picture_format(path)
    check_writable(path)


def make_map(
    model: ForwardModel,
    size: MapSize,
    picture: Path,
    method: Method,
    solver: Solver | None,
    seed: int,
    n_workers: int | None,
) -> FloorMap:
    """Make the map under progress bars and write its picture."""
    from wam_cast.experiments.floor_map import map_floor
    from wam_cast.experiments.floor_picture import write_floor_picture

    with phase_progress() as report:
        floor = map_floor(
            model, size, method=method, solver=solver, seed=seed, n_workers=n_workers, on_progress=report
        )
    write_floor_picture(floor, picture)
    return floor
