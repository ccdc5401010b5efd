"""The floor from above with what can be expected where, and how that depends on the distance from the base axis."""

from __future__ import annotations

import math
from itertools import pairwise
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.collections import PatchCollection
from matplotlib.colors import Normalize
from matplotlib.patches import Wedge
from matplotlib.ticker import PercentFormatter
from numpy.typing import NDArray

from wam_cast.casting_plane import from_polar
from wam_cast.types import Array
from wam_cast.visualization.figures.plot_style import ABOVE, DARK, MIDDLE, MM, PERCENT, draw_legend
from wam_cast.visualization.style import INK

UNREACHABLE = (0.95, 0.95, 0.95)

VIEW = 1.06
"""Half the width of the view of the floor, by the largest radius."""

SMALLEST_VIEW = 1e-3
"""Of offsets, on either side of none [m]: what is smaller by far need not be told apart."""

CAUGHT: Any = {"marker": "o", "markerfacecolor": "white", "markeredgecolor": INK, "markersize": 5}
SOME: Any = CAUGHT | {"fillstyle": "left", "markerfacecoloralt": MIDDLE, "markersize": 6}
MISSED: Any = {"marker": "X", "markerfacecolor": MIDDLE, "markeredgecolor": "white", "markersize": 7}
"""Of cups: all balls, some or none were caught."""

EXECUTED: Any = {"marker": "o", "color": DARK, "markersize": 3, "markeredgewidth": 0, "alpha": 0.6}
EXECUTED_MISSED: Any = {"marker": "x", "color": MIDDLE, "markersize": 5, "markeredgewidth": 1.2}
"""Of casts: those that were caught and those that were not."""


def draw_floor(
    axes: Axes, radii: Array, probability: Array, *, bearings: tuple[float, float], cups: Array, share_caught: Array
) -> None:
    """Draw the reachable region in rings coloured by a probability, the stops of joint 1, and what became of casts.

    World x runs to the right, y up.

    Parameters
    ----------
    radii
        Of the rings, rising from the nearest to the farthest radius that can be reached [m], shape (n,); each ring's colour ends
        midway to the next.
    probability
        That a ball enters a cup there without touching its rim, shape (n,).
    bearings
        Between which the region lies, from the x axis toward y [rad].
    cups
        World (x, y) of cups for which casts were executed [m], shape (m, 2).
    share_caught
        Share of each cup's casts that ended in it, shape (m,).
    """
    low, high = np.degrees(bearings)
    edges = np.concatenate([radii[:1], (radii[:-1] + radii[1:]) / 2, radii[-1:]])
    rings = [Wedge((0, 0), outer, low, high, width=outer - inner) for inner, outer in pairwise(edges)]
    region = PatchCollection(rings, cmap="viridis", norm=Normalize(0.0, 1.0), edgecolor="face", linewidth=0.3)
    region.set_array(probability)
    axes.add_collection(region)
    _draw_blind_sector(axes, radii[0], radii[-1], low, high)
    axes.plot(0, 0, "+", color=INK, markersize=9, markeredgewidth=1.2)
    below: Any = {"textcoords": "offset points", "ha": "center", "va": "top", "fontsize": 7.5}
    axes.annotate("base axis", (0, 0), (0, -7), **below)
    is_all, is_none = share_caught == 1, share_caught == 0
    groups = {"caught": (is_all, CAUGHT), "some caught": (~is_all & ~is_none, SOME), "missed": (is_none, MISSED)}
    for label, (chosen, look) in groups.items():
        if chosen.any():
            axes.plot(*cups[chosen].T, linestyle="none", markeredgewidth=0.6, label=label, **look)
    view = VIEW * radii[-1]
    axes.set(xlim=(-view, view), ylim=(-view, view), aspect="equal", xlabel="x [m]", ylabel="y [m]")
    axes.locator_params(nbins=5)
    bar: Any = {"location": "bottom", "fraction": 0.05, "aspect": 35, "format": PercentFormatter(1.0, symbol=None)}
    axes.figure.colorbar(region, ax=axes, label="probability of entering without touching the rim [%]", **bar)
    draw_legend(axes, title="executed casts:", alignment="left", ncols=3, **ABOVE)


def _draw_blind_sector(axes: Axes, nearest: float, farthest: float, low: float, high: float) -> None:
    """Hatch what lies between the bearings [deg] `high` and, once around, `low`: there joint 1 does not turn."""
    blind = Wedge((0, 0), farthest, high, low + 360, width=farthest - nearest)
    blind.set(facecolor=UNREACHABLE, edgecolor=(0.75, 0.75, 0.75), hatch="////", linewidth=0.5)
    axes.add_patch(blind)
    place = from_polar(0.6 * farthest + 0.4 * nearest, math.radians((low + high) / 2 + 180))
    box = {"facecolor": UNREACHABLE, "edgecolor": "none", "pad": 1.5}
    axes.annotate("where the\narm does\nnot turn", place, ha="center", va="center", fontsize=7.5, bbox=box)


def draw_offsets(
    axes: Axes,
    radii: Array,
    predicted: Array,
    std: Array,
    cups: Array,
    executed: Array,
    *,
    is_caught: NDArray[np.bool_],
    direction: str,
) -> None:
    """Draw by how much balls land off the cup's axis in one direction, over the cup's radius.

    Parameters
    ----------
    radii
        At which there are predictions [m], shape (n,).
    predicted, std
        Expected offset and its standard deviation [m], each of shape (n,).
    cups, executed
        Radius of the cup and offset of each executed cast [m], each of shape (m,); nan for a ball that never came down.
    is_caught
        What became of them, shape (m,).
    direction
        In which the offset is, in words.
    """
    axes.axhline(0.0, color=INK, linewidth=0.6, zorder=1)
    low, high = (predicted - std) * MM, (predicted + std) * MM
    axes.plot(radii, predicted * MM, color=DARK, label="predicted")
    axes.fill_between(radii, low, high, color=DARK, alpha=0.2, linewidth=0, label="± standard deviation")
    for label, chosen, look in (("caught", is_caught, EXECUTED), ("missed", ~is_caught, EXECUTED_MISSED)):
        if chosen.any():
            axes.plot(cups[chosen], executed[chosen] * MM, linestyle="none", label=label, **look)
    view = max(1.1 * np.nanmax(np.abs([*low, *high, *executed * MM])), SMALLEST_VIEW * MM)
    axes.grid(axis="y")
    axes.set(ylim=(-view, view), ylabel=f"{direction} [mm]")


def draw_rim_clear_probability(
    axes: Axes, radii: Array, probability: Array, rate: Array, low: Array, high: Array
) -> None:
    """Draw the probability to clear the rim and the measured hit rate with its interval, all of shape (n,), over radii [m]."""
    axes.plot(radii, probability * PERCENT, color=DARK, label="rim-clear entry, predicted")
    errors = np.clip(np.vstack([rate - low, high - rate]), 0.0, None) * PERCENT
    bars: Any = {"fmt": "s", "color": MIDDLE, "markersize": 4, "elinewidth": 1.0, "capsize": 2}
    axes.errorbar(radii, rate * PERCENT, errors, label="caught, 95 % interval", **bars)
    axes.grid(axis="y")
    axes.set(ylim=(-4, 104), xlabel="cup's distance from the base axis [m]", ylabel="share [%]")
    draw_legend(axes, **ABOVE)
