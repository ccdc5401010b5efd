"""What the figures share: units, the styles of curves, which differ in grey too, logarithmic axes, legends and pictures."""

from __future__ import annotations

import math
from collections.abc import Iterable
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.axis import Axis
from matplotlib.patheffects import AbstractPathEffect, withStroke
from matplotlib.ticker import LogFormatterMathtext, LogLocator, NullFormatter, NullLocator, StrMethodFormatter
from numpy.typing import NDArray

from wam_cast.visualization.style import INK, Color

CM, MM, MS, PERCENT = 1e2, 1e3, 1e3, 1e2
"""How many of each make a metre, a second or a whole."""

DARK: Color = (0.17, 0.09, 0.38)
MIDDLE: Color = (0.76, 0.27, 0.09)
LIGHT: Color = (0.27, 0.70, 0.66)
GREY: Color = (0.56, 0.58, 0.62)
"""From dark to light, told apart by those who see no colours."""

CURVE_STYLES: tuple[dict[str, Any], ...] = (
    {"color": DARK, "linestyle": "-", "marker": "o"},
    {"color": MIDDLE, "linestyle": (0, (5, 2)), "marker": "s"},
    {"color": LIGHT, "linestyle": (0, (5, 1.5, 1, 1.5)), "marker": "^"},
    {"color": GREY, "linestyle": (0, (1, 1.2)), "marker": "D"},
    {"color": DARK, "linestyle": (0, (1, 1.2)), "marker": "v"},
    {"color": MIDDLE, "linestyle": (0, (5, 1.5, 1, 1.5)), "marker": "P"},
    {"color": LIGHT, "linestyle": "-", "marker": "X"},
)

OWN_STYLES = {"validation": 0, "test": 1, "training": 2}
"""These curves look the same in all figures."""

DOTS: Any = {"color": DARK, "marker": "o", "markersize": 3, "markeredgewidth": 0, "alpha": 0.5, "linestyle": "none"}
"""Of single casts."""

PAPER_MARK: Any = {"color": INK, "marker": "D", "markersize": 6, "markerfacecolor": "white", "linestyle": "none"}
"""Of a value that the paper gives."""

THIN_LINE: Any = {"color": INK, "linewidth": 0.8, "zorder": 1}
"""Of what the data are compared with, below them."""

CHOSEN_LINE: Any = {"color": INK, "linewidth": 0.9, "linestyle": (0, (6, 3))}
OTHER_CHOSEN_LINE: Any = {"color": INK, "linewidth": 0.9, "linestyle": (0, (1, 2))}

ABOVE: Any = {"loc": "lower left", "bbox_to_anchor": (0.0, 1.0), "borderaxespad": 0.2}
BESIDE: Any = {"loc": "upper left", "bbox_to_anchor": (1.0, 1.0)}
"""Where a legend hides no data."""


def curve_styles(names: Iterable[str]) -> dict[str, dict[str, Any]]:
    """Return a colour, dash and marker for each of the names, none of them twice; there are seven."""
    names = list(names)
    taken = {OWN_STYLES[name] for name in names if name in OWN_STYLES}
    free = iter([number for number in range(len(CURVE_STYLES)) if number not in taken])
    return {name: CURVE_STYLES[OWN_STYLES[name] if name in OWN_STYLES else next(free)] for name in names}


def use_log_axes(axes: Axes) -> None:
    """Make both axes logarithmic, whose data are drawn already."""
    axes.set(xscale="log", yscale="log")
    mark_log_axis(axes.xaxis)
    mark_log_axis(axes.yaxis)


def mark_log_axis(axis: Axis) -> None:
    """Label a logarithmic axis, whose data are drawn already, with plain numbers where it spans few decades."""
    low, high = sorted(axis.get_view_interval())
    if not 0 < low < high:  # nothing is drawn, so any limits will do that have logarithms
        axis.set_view_interval(0.1, 10.0, ignore=True)
        return
    n_decades = math.log10(high / low)
    if n_decades > 5:
        axis.set_major_formatter(LogFormatterMathtext())
        return
    steps = (1.0,) if n_decades > 3 else (1.0, 2.0, 5.0) if n_decades > 0.8 else (1.0, 1.5, 2.0, 3.0, 5.0, 7.0)
    axis.set_major_locator(LogLocator(subs=steps, numticks=50))
    axis.set_major_formatter(StrMethodFormatter("{x:g}"))
    axis.set_minor_locator(LogLocator(subs=range(1, 10), numticks=50) if n_decades > 0.8 else NullLocator())
    axis.set_minor_formatter(NullFormatter())


def draw_legend(axes: Axes, **settings: Any) -> None:
    """Add a legend if anything has a label; `settings` as for matplotlib's."""
    if axes.get_legend_handles_labels()[0]:
        axes.legend(**settings)


def halo(width: float = 3.0) -> list[AbstractPathEffect]:
    """Return what surrounds lines and letters on a picture with white, `width` [pt] wide."""
    return [withStroke(linewidth=width, foreground="white")]


def draw_picture(axes: Axes, image: NDArray[np.uint8]) -> None:
    """Draw a picture, shape (height, width, 3), that fills the axes; what follows has its columns and rows as coordinates."""
    height, width = image.shape[:2]
    axes.imshow(image, interpolation="antialiased")
    axes.set(xlim=(-0.5, width - 0.5), ylim=(height - 0.5, -0.5))
    axes.set_axis_off()
