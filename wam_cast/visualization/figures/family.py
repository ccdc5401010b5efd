"""The family of casts that hit one cup, and how planners search it: over distance and speed, the wait as a colour."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np
from matplotlib.cm import ScalarMappable
from matplotlib.colors import Normalize
from numpy.typing import NDArray

from wam_cast.types import Array
from wam_cast.visualization.figures.looks import ABOVE, MS, draw_legend
from wam_cast.visualization.style import INK

if TYPE_CHECKING:
    from collections.abc import Sequence

    from matplotlib.axes import Axes


COLORS = "viridis"

START: Any = {"marker": "s", "s": 26, "linewidths": 0.9, "zorder": 6}
ON_THE_WAY: Any = {"marker": "o", "s": 14, "linewidths": 0.6, "zorder": 5}
END: Any = {"marker": "*", "s": 110, "linewidths": 0.9, "zorder": 7}


def draw_family(
    axes: Axes,
    distance: Array,
    speed: Array,
    waits: Array,
    landing: Array,
    *,
    radius: float,
    is_allowed: NDArray[np.bool_],
) -> None:
    """Draw, for each wait, the curve of casts that are predicted to land at a radius.

    Parameters
    ----------
    axes
        Where to draw; `draw_wait_scale` gives a row of them one colour bar.
    distance, speed, waits
        Of the casts [m], [m/s] and [s], shapes (n,), (m,) and (k,), each rising.
    landing
        Predicted, from the base axis outward [m], shape (k, m, n).
    radius
        Of the cup's axis from the base axis [m].
    is_allowed
        Which of the casts are allowed, shape (m, n): the others are left out.
    """
    colors = ScalarMappable(_wait_scale(waits), COLORS)
    for wait, plane in zip(waits, landing, strict=True):
        shown = np.where(is_allowed, plane, np.nan)
        if np.nanmin(shown, initial=radius) < radius < np.nanmax(shown, initial=radius):
            axes.contour(
                distance, speed, shown, [radius], colors=[colors.to_rgba(wait * MS)], linewidths=1.3, zorder=2
            )
    axes.set(xlim=(distance[0], distance[-1]), ylim=(speed[0], speed[-1]))
    axes.set_xlabel("distance [m]")
    axes.set_ylabel("mean speed [m/s]")


def draw_search(axes: Axes, path: Array, waits: Array, *, is_named: bool = True) -> None:
    """Draw the casts `[distance, speed, wait]` that a search went through, shape (n, 3), into axes of `draw_family`.

    Where a dot has the colour of the curve that it lies on, its cast hits. `waits` are those of the family, which give the
    scale of colours; a search that is not named has no place in the legend.
    """
    axes.plot(path[:, 0], path[:, 1], color=INK, linewidth=0.6, alpha=0.45, zorder=4)
    names = ("start", "on the way", "end")
    pieces = (path[:1], path[1:-1], path[-1:])
    for name, look, piece in zip(names, (START, ON_THE_WAY, END), pieces, strict=True):
        shown: Any = {"c": piece[:, 2] * MS, "cmap": COLORS, "norm": _wait_scale(waits), "edgecolors": INK}
        axes.scatter(piece[:, 0], piece[:, 1], label=name if is_named else "_", **look, **shown)
    draw_legend(axes, ncols=3, **ABOVE)


def draw_wait_scale(axes: Sequence[Axes], waits: Array) -> None:
    """Draw one colour bar beside several axes of `draw_family` that have the same `waits` [s]."""
    colors = ScalarMappable(_wait_scale(waits), COLORS)
    axes[0].figure.colorbar(colors, ax=list(axes), label="wait [ms]")


def _wait_scale(waits: Array) -> Normalize:
    return Normalize(float(np.min(waits)) * MS, float(np.max(waits)) * MS)
