"""The picture of a map of the floor: the floor from above, and profiles over the distance from the base axis."""

from __future__ import annotations

from itertools import groupby
from pathlib import Path

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from wam_cast.casting_plane import from_polar
from wam_cast.experiments.floor_map import FloorMap
from wam_cast.experiments.paper.results import to_array
from wam_cast.visualization.figures.floor_figures import draw_chances, draw_floor, draw_offsets
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
    radii = np.array([ring.radius for ring in floor.rings])
    probability = np.array([ring.clear_entry_probability for ring in floor.rings])
    rate = np.array([ring.hit_rate for ring in floor.rings])
    low, high = np.array([ring.hit_interval for ring in floor.rings]).T
    draw_chances(chances, radii, probability, rate, low, high)
    right.align_ylabels()
    return figure


def _draw_top_view(axes: Axes, floor: FloorMap) -> None:
    cups, shares = [], []
    for ring in floor.rings:
        for bearing, casts in groupby(ring.casts, key=lambda cast: cast.bearing):
            cups.append(from_polar(ring.radius, bearing))
            shares.append(np.mean([cast.is_caught for cast in casts]))
    draw_floor(
        axes,
        np.array([ring.radius for ring in floor.rings]),
        np.array([ring.clear_entry_probability for ring in floor.rings]),
        bearings=floor.bearings,
        cups=np.array(cups),
        share_caught=np.array(shares),
    )


def _draw_profiles(along: Axes, lateral: Axes, floor: FloorMap) -> None:
    rings = floor.rings
    radii = np.array([ring.radius for ring in rings])
    spread = np.array([ring.predicted_spread for ring in rings])
    casts = [(ring.radius, cast) for ring in rings for cast in ring.casts]
    cups = np.array([radius for radius, _ in casts])
    is_caught = np.array([cast.is_caught for _, cast in casts])
    for axes, predicted, deviation, executed, direction in (
        (
            along,
            [ring.predicted_along for ring in rings],
            spread[:, 0],
            [c.along for _, c in casts],
            "miss along",
        ),
        # Plans turn the casting plane so that the ball is expected on the line to the cup.
        (lateral, np.zeros(len(rings)), spread[:, 1], [c.lateral for _, c in casts], "miss lateral"),
    ):
        draw_offsets(
            axes,
            radii,
            np.array(predicted),
            deviation,
            cups,
            to_array(executed),
            is_caught=is_caught,
            direction=direction,
        )
    draw_legend(along, ncols=2, **ABOVE)
