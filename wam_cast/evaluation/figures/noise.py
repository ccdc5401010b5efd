"""What noise does to where one and the same cast lands."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from matplotlib.patches import Circle
from numpy.typing import NDArray

from wam_cast.evaluation.figures.looks import MM, draw_legend
from wam_cast.evaluation.figures.parity import DOTS
from wam_cast.evaluation.style import INK

if TYPE_CHECKING:
    from matplotlib.axes import Axes

Array = NDArray[np.float64]


def draw_landing_scatter(axes: Axes, along: Array, across: Array, *, clear_radius: float) -> None:
    """Draw how far noise moved each landing.

    Parameters
    ----------
    axes
        Where to draw.
    along, across
        How far noise moved each landing along and across the casting plane [m], each of shape (n,); nan if there was none.
    clear_radius
        How far from the cup's middle a ball may pass without touching the rim [m].
    """
    rim = Circle((0, 0), clear_radius * MM, facecolor="none", edgecolor=INK, label="clears the rim")
    axes.add_patch(rim)
    axes.plot(along * MM, across * MM, label="casts", **DOTS)
    axes.plot(0, 0, "+", color=INK, markersize=8)
    axes.set_aspect("equal", adjustable="datalim")
    axes.set_xlabel("moved along the plane [mm]")
    axes.set_ylabel("moved across it [mm]")
    draw_legend(axes)
