"""The forward model against what it is compared with."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np
from matplotlib.markers import CARETDOWN
from matplotlib.ticker import MaxNLocator

from wam_cast.types import Array
from wam_cast.visualization.figures.looks import (
    BESIDE,
    CM,
    DARK,
    PAPER_MARK,
    curve_looks,
    draw_legend,
    mark_log_axis,
)

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    from matplotlib.axes import Axes


PAPER_DEGREE = 12
"""Of the paper's best polynomial."""

LEAST_RMSE = 1e-4
"""Smaller errors only get a mark [m]: with as many terms as casts they vanish, and would stretch the axis without end."""


def draw_comparison(
    axes: Axes,
    names: Sequence[str],
    rmse: Array,
    low: Array,
    high: Array,
    *,
    paper: Mapping[str, float] | None = None,
) -> None:
    """Draw test errors one below the other, on a logarithmic axis, with their values at the right.

    Parameters
    ----------
    axes
        Where to draw.
    names
        Of what is compared, from top to bottom.
    rmse, low, high
        Test RMSE and the ends of its interval [m], each of shape (n,); nan where there is none.
    paper
        By name, the paper's RMSE [m], or none.
    """
    rows = np.arange(len(names))
    axes.hlines(rows, low * CM, high * CM, color=DARK, linewidth=2.2, alpha=0.45)
    axes.plot(rmse * CM, rows, "o", color=DARK, label="test RMSE and interval")
    for row, value in enumerate(rmse * CM):
        text = f"{value:#.3g} cm".replace(". ", " ") if np.isfinite(value) else "none"
        axes.annotate(
            text,
            (1.02, row),
            xycoords=axes.get_yaxis_transform(),
            va="center",
            fontsize="small",
            annotation_clip=False,
        )
    theirs = {name: value for name, value in (paper or {}).items() if name in names}
    if theirs:
        at = [names.index(name) for name in theirs]
        axes.plot(np.array(list(theirs.values())) * CM, at, label="paper", zorder=3, **PAPER_MARK)
    axes.set_xscale("log")
    mark_log_axis(axes.xaxis)
    axes.set_yticks(rows, names)
    axes.set_ylim(len(names) - 0.5, -0.5)
    axes.grid(axis="x")
    axes.set_xlabel("test RMSE [cm]")
    draw_legend(axes, loc="lower center", bbox_to_anchor=(0.5, 1.0), ncols=2)


def draw_polynomials(
    axes: Axes, degrees: Array, curves: Mapping[str, Array], *, paper: float | None = None
) -> None:
    """Draw the errors of polynomials over their degree; errors below `LEAST_RMSE` are marked at the lower edge.

    Parameters
    ----------
    axes
        Where to draw.
    degrees
        Shape (n,).
    curves
        By name, the RMSE [m] at each degree, shape (n,); may hold nan.
    paper
        The paper's test RMSE [m] at its best degree, or none.
    """
    for name, look in curve_looks(curves).items():
        curve = curves[name]
        axes.plot(degrees, np.where(curve < LEAST_RMSE, np.nan, curve) * CM, label=name, **look)
    if paper is not None:
        axes.plot(PAPER_DEGREE, paper * CM, label=f"paper, test: {paper * CM:.3g} cm", **PAPER_MARK)
    axes.set_yscale("log")
    _draw_least(axes, degrees, curves)
    mark_log_axis(axes.yaxis)
    axes.xaxis.set_major_locator(MaxNLocator(integer=True))
    axes.grid(axis="y")
    axes.set_xlabel("degree of the polynomial [1]")
    axes.set_ylabel("RMSE [cm]")
    draw_legend(axes, **BESIDE)


def _draw_least(axes: Axes, degrees: Array, curves: Mapping[str, Array]) -> None:
    """Mark errors below `LEAST_RMSE` at the lower edge of the axes, which hold the other ones already."""
    for name, look in curve_looks(curves).items():
        below = degrees[curves[name] < LEAST_RMSE]
        if len(below):
            axes.set_ylim(LEAST_RMSE * CM, max(axes.get_ylim()[1], 10 * LEAST_RMSE * CM))
            mark: Any = {"color": look["color"], "marker": CARETDOWN, "markersize": 6, "linestyle": "none"}
            label = f"{name}, below {LEAST_RMSE * CM:g} cm"
            axes.plot(below, np.zeros(len(below)), transform=axes.get_xaxis_transform(), label=label, **mark)
