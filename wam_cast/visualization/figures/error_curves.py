"""Figure 5 of the paper: the error over the kernel's width, or over the regularization."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from wam_cast.types import Array
from wam_cast.visualization.figures.looks import (
    ABOVE,
    CHOSEN_LINE,
    CM,
    OTHER_CHOSEN_LINE,
    curve_looks,
    draw_legend,
    mark_log_axis,
)
from wam_cast.visualization.style import INK

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    from matplotlib.axes import Axes


DESCENT_LINE: Any = {
    "color": INK,
    "linewidth": 0.7,
    "marker": "o",
    "markersize": 4.0,
    "markerfacecolor": "white",
    "markeredgewidth": 0.7,
}


def draw_error_curve(
    axes: Axes,
    x: Array,
    curves: Mapping[str, Array],
    *,
    xlabel: str,
    descents: Sequence[tuple[Array, Array]] = (),
    chosen: Mapping[str, float] | None = None,
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
    descents
        The steps of each descent: the parameter and the RMSE [m] at each, both of shape (n_steps,).
    chosen
        By what it was chosen by, the parameter that was chosen, two of them at most; or none.
    """
    for name, look in curve_looks(curves).items():
        axes.plot(x, curves[name] * CM, label=name, **(look | {"marker": ""}))
    for number, (steps, rmse) in enumerate(descents):
        label = ("descents" if len(descents) > 1 else "descent") if number == 0 else "_"
        axes.plot(steps, rmse * CM, label=label, **DESCENT_LINE)
    lines = (CHOSEN_LINE, OTHER_CHOSEN_LINE)
    for (name, value), line in zip((chosen or {}).items(), lines, strict=False):
        axes.axvline(value, label=f"chosen by {name}: {value:.3g}", **line)
    axes.set_xscale("log")
    axes.set_yscale("log")
    mark_log_axis(axes.xaxis)
    mark_log_axis(axes.yaxis)
    axes.set_xlabel(xlabel)
    axes.set_ylabel("RMSE [cm]")
    draw_legend(axes, **ABOVE)
