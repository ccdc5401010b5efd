"""The picture of a map of the floor: the floor from above, and profiles over the distance from the base axis."""

from __future__ import annotations

from pathlib import Path

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from wam_cast.experiments.floor_map import FloorMap
from wam_cast.visualization.figures.floor_figures import draw_floor, draw_offsets, draw_rim_clear_probability
from wam_cast.visualization.figures.plot_style import ABOVE, draw_legend
from wam_cast.visualization.picture_files import write_figure
from wam_cast.visualization.style import figure_style

SIZE = (8.2, 4.9)
"""Width and height [in]."""

DPI = 180
"""Of a PNG."""


def write_floor_picture(floor: FloorMap, path: str | Path) -> None:
    """Write the picture of a map to `path`, as PNG, PDF or SVG by its suffix.

    Raises
    ------
    InputError
        If the suffix is another one, or the file cannot be written; then nothing is.
    """
    with figure_style():
        write_figure(draw_floor_picture(floor), path, dpi=DPI)


def draw_floor_picture(floor: FloorMap) -> Figure:
    """Draw the map."""
    figure = Figure(figsize=SIZE, layout="constrained")
    left, right = figure.subfigures(1, 2, squeeze=False, width_ratios=(1.3, 1))[0]
    _draw_top_view(left.subplots(), floor)
    along, lateral, chances = right.subplots(3, 1, sharex=True)
    _draw_profiles(along, lateral, floor)
    rings = floor.rings
    low, high = np.array(rings["hit_interval"].tolist()).T
    radii, probability, rate = (rings[name].to_numpy() for name in ("radius", "rim_clear_probability", "hit_rate"))
    draw_rim_clear_probability(chances, radii, probability, rate, low, high)
    right.align_ylabels()
    return figure


def _draw_top_view(axes: Axes, floor: FloorMap) -> None:
    cups = floor.casts.groupby(["radius", "cup_bearing"])[["cup_x", "cup_y", "is_caught"]].mean()
    draw_floor(
        axes,
        floor.rings["radius"].to_numpy(),
        floor.rings["rim_clear_probability"].to_numpy(),
        bearings=floor.bearings,
        cups=cups[["cup_x", "cup_y"]].to_numpy(),
        share_caught=cups["is_caught"].to_numpy(),
    )


def _draw_profiles(along: Axes, lateral: Axes, floor: FloorMap) -> None:
    rings, casts = floor.rings, floor.casts
    std_along, std_lateral = np.array(rings["predicted_std"].tolist()).T
    for axes, predicted, std, direction in (
        (along, rings["predicted_along"].to_numpy(), std_along, "along"),
        # Plans turn the casting plane so that the ball is expected on the line to the cup.
        (lateral, np.zeros(len(rings)), std_lateral, "lateral"),
    ):
        draw_offsets(
            axes,
            rings["radius"].to_numpy(),
            predicted,
            std,
            casts["radius"].to_numpy(),
            casts[direction].to_numpy(),
            is_caught=casts["is_caught"].to_numpy(),
            direction=f"miss {direction}",
        )
    draw_legend(along, ncols=2, **ABOVE)
