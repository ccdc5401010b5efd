"""What noise does to where one and the same cast lands."""

from __future__ import annotations

from typing import TYPE_CHECKING

from matplotlib.patches import Circle
from matplotlib.patheffects import withStroke

from wam_cast.types import Array
from wam_cast.visualization.figures.looks import ABOVE, MIDDLE, MM, draw_legend
from wam_cast.visualization.figures.parity import DOTS

if TYPE_CHECKING:
    from matplotlib.axes import Axes


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
    axes.plot(along * MM, across * MM, label="casts", **(DOTS | {"markersize": 2.0}))
    rim = Circle((0, 0), clear_radius * MM, facecolor="none", edgecolor=MIDDLE, linewidth=1.5, zorder=4)
    rim.set_path_effects([withStroke(linewidth=3.0, foreground="white")])
    axes.add_patch(rim)
    axes.plot([], [], "o", markerfacecolor="none", markeredgecolor=MIDDLE, label="clears the rim")
    axes.set_aspect("equal", adjustable="datalim")
    axes.set_xlabel("moved along the plane [mm]")
    axes.set_ylabel("moved across it [mm]")
    draw_legend(axes, ncols=2, **ABOVE)
