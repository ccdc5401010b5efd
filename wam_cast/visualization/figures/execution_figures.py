"""Where balls land about the cup's middle: as predicted, as executed, with noise, and where they may without touching the rim."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.patches import Circle, Ellipse, Polygon
from matplotlib.transforms import ScaledTranslation
from numpy.typing import ArrayLike

from wam_cast.simulation.outcome import Status
from wam_cast.types import Array
from wam_cast.visualization.figures.plot_style import (
    ABOVE,
    BESIDE,
    DARK,
    DOTS,
    LIGHT,
    MIDDLE,
    MM,
    PERCENT,
    curve_styles,
    draw_legend,
    halo,
    mark_log_axis,
)
from wam_cast.visualization.side_view import PREDICTION_MARK
from wam_cast.visualization.style import INK, status_name

MARKERS: dict[Status, str] = {
    Status.CAUGHT: "o",
    Status.LANDED: "o",
    Status.SHORT: "v",
    Status.LONG: "^",
    Status.SIDE: "s",
    Status.RIM_BOUNCE: "x",
    Status.CAME_OUT: "*",
    Status.HANGING: "d",
    Status.NOT_SETTLED: "p",
    Status.NEVER_CROSSED: "|",
    Status.LIMIT_HIT: "P",
    Status.DIVERGED: "+",
    Status.STOPPED: "X",
}

EDGE_ROOM, POINTS_PER_INCH = 6.0, 72.0
"""How far above the lower edge the marks of casts stand that never landed [pt], so that they are within the axes."""

CLEAR_COLOR, CUP_COLOR = (0.82, 0.88, 0.85), (0.93, 0.95, 0.96)

N_DEVIATIONS = 2
"""Standard deviations that the drawn ellipse reaches to."""

VIEW = 1.15
"""Half the width of a view of the cup from above, by the cup's radius."""


def draw_performance(
    axes: Axes,
    cups: Array,
    predicted: Array,
    executed: Array,
    statuses: Sequence[str],
    *,
    cup_radius: float,
    ball_radius: float,
) -> None:
    """Draw where balls were predicted to land and where they landed, over the cup's position: figure 6 of the paper.

    Parameters
    ----------
    cups
        Distances of the cups from the base axis [m], shape (n,).
    predicted, executed
        Signed distances of the landing from the cup's middle [m], positive beyond it, each of shape (n,); nan where the ball
        never landed, which is marked at the lower edge.
    statuses
        What became of the casts, values of `.Status`, n of them.
    cup_radius, ball_radius
        The cup's inner radius and the ball's [m].
    """
    _draw_cup(axes, cup_radius * MM, (cup_radius - ball_radius) * MM)
    axes.vlines(cups, predicted * MM, executed * MM, color=INK, linewidth=0.5, alpha=0.6)
    mark = PREDICTION_MARK | {"color": INK, "markersize": 4.0, "markeredgewidth": 0.5}
    axes.plot(cups, predicted * MM, label="predicted", **mark)
    found = np.array([Status(status) for status in statuses])
    for status in [status for status in Status if status in statuses]:
        _draw_executed(axes, cups[found == status], executed[found == status], status)
    axes.set(xlabel="distance of the cup from the base axis [m]", ylabel="signed distance from\nthe cup's middle [mm]")
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
        edge = axes.get_xaxis_transform() + up
        axes.plot(cups[~landed], np.zeros(np.sum(~landed)), transform=edge, **look)


def draw_miss_distribution(axes: Axes, misses: Mapping[str, Array]) -> None:
    """Draw which share of the casts missed the cup's middle by less than so much: by name, misses [m], each of shape (n,).

    Those that are nan never landed: they count, so that their curve ends below 100 %.
    """
    for name, style in curve_styles(misses).items():
        values = np.sort(misses[name][np.isfinite(misses[name])]) * MM
        steps = np.append(values[:1], values)
        shares = np.arange(len(steps)) / max(len(misses[name]), 1) * PERCENT
        axes.plot(steps, shares, drawstyle="steps-post", label=name, **(style | {"marker": ""}))
    axes.set_xscale("log")
    mark_log_axis(axes.xaxis)
    axes.grid()
    axes.set(ylim=(0, 101), xlabel="miss, at most [mm]", ylabel="casts [%]")
    draw_legend(axes)


def draw_landing_scatter(axes: Axes, along: Array, across: Array, *, clear_radius: float) -> None:
    """Draw how far noise moved each landing along and across the casting plane [m], each of shape (n,); nan if there was none.

    Within `clear_radius` [m] of the cup's middle a ball passes without touching the rim.
    """
    axes.plot(along * MM, across * MM, label="casts", **(DOTS | {"markersize": 2.0}))
    look: Any = {"fill": False, "edgecolor": MIDDLE, "linewidth": 1.5, "zorder": 4, "path_effects": halo()}
    axes.add_patch(Circle((0, 0), clear_radius * MM, **look))
    axes.plot([], [], "o", markerfacecolor="none", markeredgecolor=MIDDLE, label="clears the rim")
    axes.set_aspect("equal", adjustable="datalim")
    axes.set(xlabel="moved along the plane [mm]", ylabel="moved across it [mm]")
    draw_legend(axes, ncols=2, **ABOVE)


def draw_rim_clear_entry(
    axes: Axes,
    *,
    cup_radius: float,
    ball: tuple[float, float],
    clear: tuple[Array, Array],
    std: tuple[float, float],
    predicted: tuple[float, float] = (0.0, 0.0),
    landings: tuple[Array, Array] | None = None,
) -> None:
    """Draw the cup's opening from above, what the ball sweeps of it, where it may land to clear the rim, and where it will.

    The casting plane runs to the right; the cup's axis is in the middle.

    Parameters
    ----------
    cup_radius
        Inner radius of the cup [m].
    ball
        Half axes of the ellipse that the ball sweeps in the rim plane, along and across the casting plane [m].
    clear
        Offsets along the plane, shape (n,), rising, and how far across it the ball may land there at the most, shape (n,) [m].
    std
        Standard deviations of the landing along and across [m].
    predicted
        Offset of the predicted landing along and across [m].
    landings
        Executed landings, along and across [m], each of shape (m,); or none.
    """
    along, half = np.compress(clear[1] >= 0, clear, axis=1) * MM
    if len(along):
        outline = np.column_stack([[*along, *along[::-1]], [*half, *-half[::-1]]])
        axes.add_patch(Polygon(outline, facecolor=LIGHT, alpha=0.45, label="landings that clear the rim"))
    _draw_ellipse(axes, [cup_radius] * 2, label="cup's rim", edgecolor=INK, linewidth=1.6)
    _draw_ellipse(axes, ball, label="swept by the ball", edgecolor=MIDDLE, linestyle="--", linewidth=1.2)
    deviations, label = np.multiply(N_DEVIATIONS, std), f"{N_DEVIATIONS} standard deviations"
    _draw_ellipse(axes, deviations, predicted, label=label, edgecolor=DARK, linewidth=1.2)
    if landings is not None:
        axes.plot(landings[0] * MM, landings[1] * MM, label="executed", **DOTS)
    view = VIEW * cup_radius * MM
    axes.set(xlim=(-view, view), ylim=(-view, view), aspect="equal")
    axes.set(xlabel="off the axis, along [mm]", ylabel="off the axis, across [mm]")
    draw_legend(axes, **ABOVE)


def _draw_ellipse(axes: Axes, half_axes: ArrayLike, middle: ArrayLike = (0.0, 0.0), **look: Any) -> None:
    """Draw an ellipse's outline; all lengths in metres."""
    axes.add_patch(Ellipse(tuple(np.multiply(middle, MM)), *np.multiply(half_axes, 2 * MM), fill=False, **look))
