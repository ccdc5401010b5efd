"""Predicted against measured landings, and what is left between them."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from wam_cast.types import Array
from wam_cast.visualization.figures.looks import DARK, MM, draw_legend
from wam_cast.visualization.style import INK

if TYPE_CHECKING:
    from matplotlib.axes import Axes


DOTS: Any = {
    "color": DARK,
    "marker": "o",
    "markersize": 3,
    "markeredgewidth": 0,
    "alpha": 0.5,
    "linestyle": "none",
}


def draw_parity(axes: Axes, measured: Array, predicted: Array) -> None:
    """Draw predicted over measured landings [m], both of shape (n,), and where they would be equal."""
    axes.axline((0, 0), slope=1, color=INK, linewidth=0.8, label="equal", zorder=1)
    axes.plot(measured, predicted, label="casts", **DOTS)
    known = np.concatenate([measured, predicted])
    known = known[np.isfinite(known)]
    if len(known):
        margin = 0.04 * (np.ptp(known) or 1.0)
        limits = (known.min() - margin, known.max() + margin)
        axes.set(xlim=limits, ylim=limits)
    axes.set_aspect("equal")
    axes.set_xlabel("measured landing [m]")
    axes.set_ylabel("predicted landing [m]")
    draw_legend(axes)


def draw_residuals(axes: Axes, predicted: Array, residuals: Array) -> None:
    """Draw residuals over predicted landings [m], both of shape (n,)."""
    axes.axhline(0.0, color=INK, linewidth=0.8, zorder=1)
    axes.plot(predicted, residuals * MM, label="casts", **DOTS)
    axes.set_xlabel("predicted landing [m]")
    axes.set_ylabel("residual [mm]")
