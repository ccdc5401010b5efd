"""Whether the model's error bars keep what they promise."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from wam_cast.types import Array
from wam_cast.visualization.figures.looks import (
    ABOVE,
    BESIDE,
    MM,
    PERCENT,
    curve_looks,
    draw_legend,
    mark_log_axis,
)
from wam_cast.visualization.figures.parity import DOTS
from wam_cast.visualization.style import INK

if TYPE_CHECKING:
    from collections.abc import Mapping

    from matplotlib.axes import Axes


def draw_calibration(axes: Axes, nominal: Array, empirical: Mapping[str, Array]) -> None:
    """Draw which share of the casts lies within the central intervals that should hold a given share.

    Parameters
    ----------
    axes
        Where to draw.
    nominal
        The shares that the intervals should hold, shape (n,), from 0 to 1.
    empirical
        By name, the shares that they hold, shape (n,).
    """
    axes.plot([0, 100], [0, 100], color=INK, linewidth=0.8, label="calibrated", zorder=1)
    for name, look in curve_looks(empirical).items():
        axes.plot(nominal * PERCENT, empirical[name] * PERCENT, label=name, clip_on=False, **look)
    axes.set(xlim=(0, 100), ylim=(0, 100), aspect="equal")
    axes.set_xlabel("interval should hold [%]")
    axes.set_ylabel("interval holds [%]")
    axes.annotate("cautious", (0.04, 0.93), xycoords="axes fraction", fontsize="small", va="top")
    axes.annotate("overconfident", (0.96, 0.07), xycoords="axes fraction", fontsize="small", ha="right")
    draw_legend(axes, **BESIDE)


def draw_errors(axes: Axes, std: Array, errors: Array) -> None:
    """Draw each cast's error over the standard deviation that was predicted for it, on logarithmic axes.

    Parameters
    ----------
    axes
        Where to draw.
    std
        Predicted [m], shape (n,).
    errors
        Of the prediction [m], of either sign, shape (n,).
    """
    axes.plot(std * MM, np.abs(errors) * MM, label="casts", **DOTS)
    for number, dashes in ((1, "-"), (2, "--")):
        line: Any = {"color": INK, "linewidth": 0.8, "linestyle": dashes, "zorder": 1}
        axes.axline(
            (1, number), (10, 10 * number), label=f"{number} standard deviation{'s'[: number - 1]}", **line
        )
    axes.set_xscale("log")
    axes.set_yscale("log")
    mark_log_axis(axes.xaxis)
    mark_log_axis(axes.yaxis)
    axes.set_xlabel("predicted standard deviation [mm]")
    axes.set_ylabel("|error| [mm]")
    draw_legend(axes, **ABOVE)
