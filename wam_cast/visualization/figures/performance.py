"""Figure 6 of the paper: how far from the cup's middle the ball was predicted to land, and how far it did."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np
from matplotlib.transforms import ScaledTranslation

from wam_cast.simulation.outcome import Status
from wam_cast.types import Array
from wam_cast.visualization.figures.looks import (
    BESIDE,
    CHOSEN_LINE,
    DARK,
    MIDDLE,
    MM,
    PERCENT,
    curve_looks,
    draw_legend,
    mark_log_axis,
)
from wam_cast.visualization.style import INK, status_name

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    from matplotlib.axes import Axes


MARKERS: dict[Status, str] = {
    Status.CAUGHT: "o",
    Status.LANDED: "o",
    Status.SHORT: "v",
    Status.LONG: "^",
    Status.SIDE: "s",
    Status.RIM_BOUNCE: "x",
    Status.CAME_OUT: "*",
    Status.NOT_SETTLED: "p",
    Status.NEVER_CROSSED: "|",
    Status.LIMIT_HIT: "P",
    Status.DIVERGED: "+",
}

PREDICTED_LOOK: Any = {
    "color": INK,
    "marker": "D",
    "markersize": 4.0,
    "markerfacecolor": "none",
    "markeredgewidth": 0.5,
    "linestyle": "none",
}

EDGE_ROOM, POINTS_PER_INCH = 6.0, 72.0
"""How far above the lower edge the marks of casts stand that never landed [pt], so that they are within the axes."""

CLEAR_COLOR, CUP_COLOR = (0.82, 0.88, 0.85), (0.93, 0.95, 0.96)


def draw_performance(
    axes: Axes,
    cups: Array,
    predicted: Array,
    executed: Array,
    statuses: Sequence[str],
    *,
    cup_radius: float,
    ball_radius: float,
    reach: tuple[float, float] | None = None,
) -> None:
    """Draw where the ball was predicted to land and where it landed, from the cup's middle outward, over the cup's position.

    Parameters
    ----------
    axes
        Where to draw.
    cups
        Distances of the cups from the base axis [m], shape (n,).
    predicted, executed
        Signed distances of the landing from the cup's middle [m], positive beyond it, each of shape (n,); nan where the ball
        never landed, which is marked at the lower edge.
    statuses
        What became of the casts, values of `Status`, n of them.
    cup_radius, ball_radius
        The cup's inner radius and the ball's [m].
    reach
        The nearest and the farthest cup that the model plans for [m], or none.
    """
    _draw_cup(axes, cup_radius * MM, (cup_radius - ball_radius) * MM)
    axes.vlines(cups, predicted * MM, executed * MM, color=INK, linewidth=0.5, alpha=0.6)
    axes.plot(cups, predicted * MM, label="predicted", **PREDICTED_LOOK)
    found = np.array([Status(status) for status in statuses])
    for status in [status for status in Status if status in statuses]:
        _draw_executed(axes, cups[found == status], executed[found == status], status)
    for edge, name in zip(reach or (), ("reach", "_"), strict=False):
        axes.axvline(edge, label=name, **CHOSEN_LINE)
    axes.set_xlabel("distance of the cup from the base axis [m]")
    axes.set_ylabel("signed distance from\nthe cup's middle [mm]")
    draw_legend(axes, handlelength=1.6, **BESIDE)


def _draw_cup(axes: Axes, radius: float, clear: float) -> None:
    """Draw the cup's opening, and within it the band in which the ball passes the rim without touching it, both in mm."""
    axes.axhspan(-radius, radius, color=CUP_COLOR, linewidth=0, zorder=0, label="cup's radius")
    axes.axhspan(-clear, clear, color=CLEAR_COLOR, linewidth=0, zorder=0, label="clears the rim")
    for edge in (-radius, -clear, clear, radius):
        axes.axhline(edge, color=INK, linewidth=0.5, zorder=0.5)
    axes.axhline(0.0, color=INK, linewidth=0.5, linestyle=(0, (1, 3)), zorder=0.5)


def _draw_executed(axes: Axes, cups: Array, executed: Array, status: Status) -> None:
    is_good = status in (Status.CAUGHT, Status.LANDED)
    look: Any = {"color": DARK if is_good else MIDDLE, "marker": MARKERS[status], "linestyle": "none"}
    look |= {"markersize": 3 if is_good else 7, "markeredgewidth": 1.3, "zorder": 3 if is_good else 4}
    landed = np.isfinite(executed)
    axes.plot(cups[landed], executed[landed] * MM, label=status_name(status), **look)
    if not landed.all():
        up = ScaledTranslation(0, EDGE_ROOM / POINTS_PER_INCH, axes.figure.dpi_scale_trans)
        edge = {"transform": axes.get_xaxis_transform() + up}
        axes.plot(cups[~landed], np.zeros(np.sum(~landed)), **(look | edge))


def draw_miss_distribution(axes: Axes, misses: Mapping[str, Array]) -> None:
    """Draw which share of the casts missed the cup's middle by less than so much.

    Parameters
    ----------
    axes
        Where to draw.
    misses
        By name, how far from the cup's middle the casts landed [m], each of shape (n,). Those that are nan never landed: they
        count, so that their curve ends below 100 %.
    """
    for name, look in curve_looks(misses).items():
        values = np.sort(misses[name][np.isfinite(misses[name])]) * MM
        steps = np.append(values[:1], values)
        shares = np.arange(len(steps)) / max(len(misses[name]), 1) * PERCENT
        line = look | {"marker": ""}
        axes.plot(steps, shares, drawstyle="steps-post", label=name, **line)
    axes.set_xscale("log")
    mark_log_axis(axes.xaxis)
    axes.set_ylim(0, 101)
    axes.grid()
    axes.set_xlabel("miss, at most [mm]")
    axes.set_ylabel("casts [%]")
    draw_legend(axes)
