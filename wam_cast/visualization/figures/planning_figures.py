"""What the model predicts over distance and speed: the landing at one wait, and the family of casts that planners search."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import product
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.cm import ScalarMappable
from matplotlib.colors import BoundaryNorm, Normalize
from matplotlib.contour import QuadContourSet
from matplotlib.patheffects import withStroke
from numpy.typing import NDArray

from wam_cast.types import Array
from wam_cast.visualization.figures.plot_style import ABOVE, MS, draw_legend
from wam_cast.visualization.style import INK

COLORS = "viridis"
"""Of landings and of waits."""

FORBIDDEN = (0.97, 0.97, 0.97)

LABEL_ROOM, LABELS_APART = 0.08, 0.15
"""Half the room that a contour's label takes, and how far labels are apart at least, as shares of the axes."""

START: Any = {"marker": "s", "s": 26, "linewidths": 0.9, "zorder": 6}
ON_THE_WAY: Any = {"marker": "o", "s": 14, "linewidths": 0.6, "zorder": 5}
END: Any = {"marker": "*", "s": 110, "linewidths": 0.9, "zorder": 7}
"""Of a search."""


def draw_landing_map(
    axes: Axes,
    distance: Array,
    speed: Array,
    landing: Array,
    *,
    is_allowed: NDArray[np.bool_],
    wait: float,
    levels: Array,
) -> None:
    """Draw contours of the predicted landing; casts that are not allowed are hatched.

    `draw_landing_scale` gives a row of such axes one colour bar.

    Parameters
    ----------
    distance, speed
        Of the casts [m] and [m/s], shapes (n,) and (m,), evenly rising.
    landing
        Predicted, from the base axis outward [m], shape (m, n).
    is_allowed
        Which of the casts are allowed, shape (m, n).
    wait
        Of all of them [s].
    levels
        Landings to draw contours of [m], rising.
    """
    axes.contourf(distance, speed, landing, levels, norm=_landing_norm(levels), cmap=COLORS, extend="both")
    shown = np.where(is_allowed, landing, np.nan)
    if np.isfinite(shown).any():
        lines = axes.contour(distance, speed, shown, levels, colors="white", linewidths=0.7)
        places = _label_places(lines, distance, speed, is_allowed)
        look: Any = {"fontsize": "small", "colors": "white", "zorder": 5}
        for label in axes.clabel(lines, fmt="%.2f", manual=places, **look):
            label.set_path_effects([withStroke(linewidth=1.5, foreground=INK)])
    if not is_allowed.all():
        cover = np.where(is_allowed, 1.0, 0.0)
        axes.contourf(distance, speed, cover, [-0.5, 0.5], colors=[FORBIDDEN], hatches=["////"], zorder=3)
    _frame(axes, distance, speed)
    axes.set_title(f"wait {wait * MS:.0f} ms")


def _frame(axes: Axes, distance: Array, speed: Array) -> None:
    axes.set(xlim=(distance[0], distance[-1]), ylim=(speed[0], speed[-1]))
    axes.set(xlabel="distance [m]", ylabel="mean speed [m/s]")


def _label_places(lines: QuadContourSet, distance: Array, speed: Array, is_allowed: NDArray[np.bool_]) -> list[Array]:
    """Return points (2,) for the labels: of each contour the one nearest to the middle that has room."""
    extent, corner = np.array([np.ptp(distance), np.ptp(speed)]), np.array([distance[0], speed[0]])
    places: list[Array] = []
    for path in lines.get_paths():
        shares = (np.asarray(path.vertices, dtype=float).reshape(-1, 2) - corner) / extent
        shares = shares[_has_room(shares, is_allowed)]
        if len(shares):
            place = shares[np.argmin(np.linalg.norm(shares - 0.5, axis=1))]
            if all(np.linalg.norm(place - taken) > LABELS_APART for taken in places):
                places.append(place)
    return [corner + place * extent for place in places]


def _has_room(shares: Array, is_allowed: NDArray[np.bool_]) -> NDArray[np.bool_]:
    """Return which points, shape (n, 2), in shares of the axes, are far enough from the axes' edge and from what is hatched."""
    room: NDArray[np.bool_] = np.all((shares > LABEL_ROOM) & (shares < 1 - LABEL_ROOM), axis=1)
    last = np.array(is_allowed.shape[::-1]) - 1
    for offset in product((-LABEL_ROOM, LABEL_ROOM), repeat=2):
        column, row = np.rint(np.clip(shares + offset, 0, 1) * last).astype(int).T
        room &= is_allowed[row, column]
    return room


def draw_landing_scale(axes: Sequence[Axes], levels: Array) -> None:
    """Draw one colour bar beside several axes of `draw_landing_map` that have the same `levels` [m]."""
    axes[0].figure.colorbar(ScalarMappable(_landing_norm(levels), COLORS), ax=list(axes), label="predicted landing [m]")


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

    `draw_wait_scale` gives a row of such axes one colour bar.

    Parameters
    ----------
    distance, speed, is_allowed
        As for `draw_landing_map`; casts that are not allowed are left out.
    waits
        Of the casts [s], shape (k,), rising.
    landing
        Predicted, from the base axis outward [m], shape (k, m, n).
    radius
        Of the cup's axis from the base axis [m].
    """
    colors = ScalarMappable(_wait_norm(waits), COLORS)
    for wait, plane in zip(waits, landing, strict=True):
        shown = np.where(is_allowed, plane, np.nan)
        if np.nanmin(shown, initial=radius) < radius < np.nanmax(shown, initial=radius):
            look: Any = {"colors": [colors.to_rgba(wait * MS)], "linewidths": 1.3, "zorder": 2}
            axes.contour(distance, speed, shown, [radius], **look)
    _frame(axes, distance, speed)


def draw_search(axes: Axes, path: Array, waits: Array, *, is_named: bool = True) -> None:
    """Draw the casts `[distance, speed, wait]` that a search went through, shape (n, 3), into axes of `draw_family`.

    Where a dot has the colour of the curve that it lies on, its cast hits. `waits` are those of the family, which give the
    scale of colours; a search that is not named has no place in the legend.
    """
    axes.plot(path[:, 0], path[:, 1], color=INK, linewidth=0.6, alpha=0.45, zorder=4)
    pieces = {"start": (path[:1], START), "on the way": (path[1:-1], ON_THE_WAY), "end": (path[-1:], END)}
    for name, (piece, look) in pieces.items():
        shown: Any = {"c": piece[:, 2] * MS, "cmap": COLORS, "norm": _wait_norm(waits), "edgecolors": INK}
        axes.scatter(piece[:, 0], piece[:, 1], label=name if is_named else "_", **look, **shown)
    draw_legend(axes, ncols=3, **ABOVE)


def draw_wait_scale(axes: Sequence[Axes], waits: Array) -> None:
    """Draw one colour bar beside several axes of `draw_family` that have the same `waits` [s]."""
    axes[0].figure.colorbar(ScalarMappable(_wait_norm(waits), COLORS), ax=list(axes), label="wait [ms]")


def _landing_norm(levels: Array) -> Normalize:
    return BoundaryNorm(levels, 256, extend="both")


def _wait_norm(waits: Array) -> Normalize:
    return Normalize(float(np.min(waits)) * MS, float(np.max(waits)) * MS)
