"""Whether the model's error bars keep what they promise."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from wam_cast.evaluation.figures.looks import BESIDE, PERCENT, curve_looks, draw_legend
from wam_cast.evaluation.style import INK

if TYPE_CHECKING:
    from collections.abc import Mapping

    from matplotlib.axes import Axes

Array = NDArray[np.float64]


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
