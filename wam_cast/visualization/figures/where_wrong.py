"""Where in the space of parameters the model is wrong."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np
from matplotlib.colors import LogNorm

from wam_cast.types import Array
from wam_cast.visualization.figures.looks import ABOVE, GREY, MM, MS, draw_legend, mark_log_axis
from wam_cast.visualization.style import INK

if TYPE_CHECKING:
    from matplotlib.axes import Axes


SMALLEST, LARGEST = 1.0, 36.0
"""Area of the dots of the smallest and the largest residual [pt^2]."""

MOST_DECADES = 3.0
"""Residuals that are smaller than the largest by more than this all look alike."""


def draw_residual_map(axes: Axes, x: Array, y: Array, residuals: Array, *, xlabel: str, ylabel: str) -> None:
    """Draw each cast as a dot, the larger and darker the farther the model is off, and a colour bar beside the axes.

    Parameters
    ----------
    axes
        Where to draw.
    x, y
        Two parameters of the casts, each of shape (n,), in the units that the labels name.
    residuals
        Of the model [m], of either sign, shape (n,); nan for casts that never landed.
    xlabel, ylabel
        What the parameters are, with their units.
    """
    sizes = np.abs(residuals) * MM
    known = np.isfinite(sizes)
    largest = max(np.max(sizes[known], initial=0.0), 1e-6)
    smallest = max(np.min(sizes[known], initial=largest), largest * 10**-MOST_DECADES)
    norm = LogNorm(min(smallest, 0.5 * largest), largest, clip=True)
    order = np.flatnonzero(known)[np.argsort(sizes[known])]  # the worst on top
    areas = SMALLEST + (LARGEST - SMALLEST) * np.asarray(norm(sizes[order])) ** 3  # most are small
    dots = axes.scatter(
        x[order],
        y[order],
        s=areas,
        c=sizes[order],
        norm=norm,
        cmap="viridis_r",
        linewidths=0.3,
        edgecolors="white",
    )
    if not known.all():
        axes.plot(x[~known], y[~known], "x", color=GREY, label="never landed")
        draw_legend(axes, **ABOVE)
    bar = axes.figure.colorbar(dots, ax=axes, label="|residual| [mm]")
    mark_log_axis(bar.ax.yaxis)
    axes.set_xlabel(xlabel)
    axes.set_ylabel(ylabel)


def draw_shortest_move(axes: Axes, duration: float, *, scale: float = 1.0) -> None:
    """Draw the line of moves that last `duration` [s] into axes of distance and mean speed [m/s], as far as these reach.

    `scale` says how many of the distance's unit make a metre, such as 100.
    """
    distance = np.array(axes.get_xlim())
    label = f"move lasts {duration * MS:.0f} ms"
    line: Any = {"color": INK, "linewidth": 1.0, "linestyle": (0, (6, 3))}
    axes.plot(distance, distance / scale / duration, label=label, scalex=False, scaley=False, **line)
    draw_legend(axes, **ABOVE)
