"""Figure 5 of the paper: the error over the kernel's width, or over the regularization."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from wam_cast.evaluation.figures.looks import (
    CHOSEN_LINE,
    CM,
    PALE,
    PAPER_LINE,
    curve_looks,
    draw_legend,
    mark_log_axis,
)
from wam_cast.evaluation.style import INK

if TYPE_CHECKING:
    from collections.abc import Mapping

    from matplotlib.axes import Axes

Array = NDArray[np.float64]


def draw_error_curve(
    axes: Axes,
    x: Array,
    curves: Mapping[str, Array],
    *,
    xlabel: str,
    path: tuple[Array, Array] | None = None,
    chosen: float | None = None,
    paper: float | None = None,
) -> None:
    """Draw errors over a parameter of the model, both on logarithmic axes.

    Parameters
    ----------
    axes
        Where to draw.
    x
        The parameter, shape (n,), positive.
    curves
        By name, the RMSE [m] at each `x`, shape (n,); nan where there is none.
    xlabel
        What `x` is, with its unit.
    path
        The steps of a descent: the parameter and the RMSE [m] at each, both of shape (n_steps,); or none.
    chosen, paper
        The parameter that was chosen, and the paper's; or none.
    """
    for name, look in curve_looks(curves).items():
        axes.plot(x, curves[name] * CM, label=name, **(look | {"marker": ""}))
    if path is not None:
        descent: Any = {
            "color": INK,
            "linewidth": 0.7,
            "marker": "o",
            "markersize": 4.5,
            "markerfacecolor": PALE,
        }
        axes.plot(path[0], path[1] * CM, label="descent", **descent)
    if chosen is not None:
        axes.axvline(chosen, label=f"chosen: {chosen:.3g}", **CHOSEN_LINE)
    if paper is not None:
        axes.axvline(paper, label=f"paper: {paper:.3g}", **PAPER_LINE)
    axes.set_xscale("log")
    axes.set_yscale("log")
    mark_log_axis(axes.xaxis)
    mark_log_axis(axes.yaxis)
    axes.set_xlabel(xlabel)
    axes.set_ylabel("RMSE [cm]")
    draw_legend(axes)
