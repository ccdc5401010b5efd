"""What is believed of one robot before and after its casts, and how its casts come nearer to the cup."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.patches import Circle
from numpy.typing import NDArray

from wam_cast.types import Array
from wam_cast.visualization.figures.plot_style import ABOVE, DARK, MIDDLE, MM, curve_styles, draw_legend, halo
from wam_cast.visualization.style import INK

N_DEVIATIONS = 2
"""Standard deviations from a band's middle to its edge."""

TRUTH_MARK: Any = {
    "color": INK,
    "marker": "x",
    "markersize": 5,
    "markeredgewidth": 1.4,
    "linestyle": "none",
    "zorder": 5,
}

CUP_COLOR = (0.93, 0.95, 0.96)

ROOM = 1.25
"""Half the width of a view from above, by the distance of the farthest landing, or by the cup's radius."""


def draw_beliefs(
    axes: Axes,
    parameter: Array,
    beliefs: Mapping[str, tuple[Array, Array]],
    truth: tuple[Array, Array] | None = None,
    *,
    xlabel: str,
) -> None:
    """Draw how far a robot's casts are believed to land beyond the believed robot's, and where they do.

    Parameters
    ----------
    parameter
        Of the casts, shape (n,).
    beliefs
        By name: mean of the offset and its standard deviation [m], each of shape (n,).
    truth
        Parameter and offset [m] of casts that were made, each of shape (m,); or none.
    xlabel
        Name and unit of the parameter.
    """
    axes.axhline(0.0, color=INK, linewidth=0.6, zorder=0.5)
    for name, style in curve_styles(beliefs).items():
        mean, std = beliefs[name]
        low, high = ((mean + sign * N_DEVIATIONS * std) * MM for sign in (-1, 1))
        axes.fill_between(parameter, low, high, color=style["color"], alpha=0.25, linewidth=0)
        axes.plot(
            parameter, mean * MM, label=f"{name}, ± {N_DEVIATIONS} standard deviations", **(style | {"marker": ""})
        )
    if truth is not None:
        axes.plot(truth[0], truth[1] * MM, label="what it does", **TRUTH_MARK)
    axes.set(xlabel=xlabel, ylabel="lands beyond the believed robot's [mm]")
    draw_legend(axes, **ABOVE)


def draw_approach(axes: Axes, landings: Array, is_caught: NDArray[np.bool_], *, cup_radius: float) -> None:
    """Draw landings about the cup from above, numbered in the order of the casts.

    Parameters
    ----------
    landings
        World (x, y) from the cup's axis [m], shape (n, 2); nan for a ball that never came down.
    is_caught
        Whether the cup caught the ball, shape (n,).
    cup_radius
        Inner radius of the cup [m].
    """
    axes.add_patch(Circle((0, 0), cup_radius * MM, facecolor=CUP_COLOR, edgecolor=INK, linewidth=1.2, label="cup"))
    axes.plot(*(landings * MM).T, color=INK, linewidth=0.5, alpha=0.6)
    for name, chosen, color in (("caught", is_caught, DARK), ("missed", ~is_caught, MIDDLE)):
        if chosen.any():
            look: Any = {"color": color, "marker": "o" if name == "caught" else "x", "linestyle": "none", "zorder": 4}
            axes.plot(*(landings[chosen] * MM).T, label=name, **look)
    for number, (x, y) in enumerate(landings * MM, 1):
        if np.isfinite(x):
            axes.annotate(
                str(number), (x, y), (4, 4), textcoords="offset points", fontsize="small", path_effects=halo()
            )
    farthest = np.nanmax(np.abs(landings), initial=0.0)
    view = ROOM * max(farthest, cup_radius) * MM
    axes.set(xlim=(-view, view), ylim=(-view, view), aspect="equal")
    axes.set(xlabel="x from the cup's axis [mm]", ylabel="y from the cup's axis [mm]")
    draw_legend(axes, ncols=3, **ABOVE)
