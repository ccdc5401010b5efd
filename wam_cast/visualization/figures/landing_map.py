"""What the model has learned: the landing over distance and speed, at one wait."""

from __future__ import annotations

from itertools import product
from typing import TYPE_CHECKING

import numpy as np
from matplotlib.cm import ScalarMappable
from matplotlib.colors import BoundaryNorm
from matplotlib.patheffects import withStroke
from numpy.typing import NDArray

from wam_cast.types import Array
from wam_cast.visualization.figures.looks import MS
from wam_cast.visualization.style import INK

if TYPE_CHECKING:
    from collections.abc import Sequence

    from matplotlib.axes import Axes
    from matplotlib.contour import QuadContourSet


COLORS = "viridis"

FORBIDDEN = (0.97, 0.97, 0.97)

ROOM, APART = 0.08, 0.15
"""Half the room that a contour's label takes, and how far labels are apart at least, as shares of the axes."""


def draw_landing_map(
    axes: Axes,
    distance: Array,
    speed: Array,
    landing: Array,
    *,
    is_allowed: NDArray[np.bool_],
    wait: float,
    levels: Array,
    casts: Array | None = None,
) -> None:
    """Draw contours of the predicted landing; casts that are not allowed are hatched.

    Parameters
    ----------
    axes
        Where to draw; `draw_landing_scale` gives a row of them one colour bar.
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
    casts
        Known casts of nearly this wait, to be drawn as dots: rows that begin with distance and speed; or none.
    """
    norm = BoundaryNorm(levels, 256, extend="both")
    axes.contourf(distance, speed, landing, levels, norm=norm, cmap=COLORS, extend="both")
    shown = np.where(is_allowed, landing, np.nan)
    if np.isfinite(shown).any():
        lines = axes.contour(distance, speed, shown, levels, colors="white", linewidths=0.7)
        places = _label_places(lines, distance, speed, is_allowed)
        for label in axes.clabel(
            lines, fmt="%.2f", fontsize="small", colors="white", manual=places, zorder=5
        ):
            label.set_path_effects([withStroke(linewidth=1.5, foreground=INK)])
    if not is_allowed.all():
        cover = np.where(is_allowed, 1.0, 0.0)
        axes.contourf(distance, speed, cover, [-0.5, 0.5], colors=[FORBIDDEN], hatches=["////"], zorder=3)
    if casts is not None:
        axes.plot(
            casts[:, 0], casts[:, 1], "o", color="white", markersize=2.5, markeredgecolor="black", zorder=4
        )
    axes.set(xlim=(distance[0], distance[-1]), ylim=(speed[0], speed[-1]))
    axes.set_title(f"wait {wait * MS:.0f} ms")
    axes.set_xlabel("distance [m]")
    axes.set_ylabel("mean speed [m/s]")


def _label_places(
    lines: QuadContourSet, distance: Array, speed: Array, is_allowed: NDArray[np.bool_]
) -> list[Array]:
    """Return points (2,) for the labels: of each contour the one nearest to the middle that has room."""
    extent = np.array([np.ptp(distance), np.ptp(speed)])
    corner = np.array([distance[0], speed[0]])
    places: list[Array] = []
    for path in lines.get_paths():
        shares = (np.asarray(path.vertices, dtype=float).reshape(-1, 2) - corner) / extent
        shares = shares[_has_room(shares, is_allowed)]
        if len(shares):
            place = shares[np.argmin(np.linalg.norm(shares - 0.5, axis=1))]
            if all(np.linalg.norm(place - taken) > APART for taken in places):
                places.append(place)
    return [corner + place * extent for place in places]


def _has_room(shares: Array, is_allowed: NDArray[np.bool_]) -> NDArray[np.bool_]:
    """Return which points, shape (n, 2), in shares of the axes, are far enough from the axes' edge and from what is hatched."""
    room: NDArray[np.bool_] = np.all((shares > ROOM) & (shares < 1 - ROOM), axis=1)
    last = np.array(is_allowed.shape[::-1]) - 1
    for offset in product((-ROOM, ROOM), repeat=2):
        column, row = np.rint(np.clip(shares + offset, 0, 1) * last).astype(int).T
        room &= is_allowed[row, column]
    return room


def draw_landing_scale(axes: Sequence[Axes], levels: Array) -> None:
    """Draw one colour bar beside several axes of `draw_landing_map` that have the same `levels` [m]."""
    norm = BoundaryNorm(levels, 256, extend="both")
    colors = ScalarMappable(norm, COLORS)
    axes[0].figure.colorbar(colors, ax=list(axes), label="predicted landing [m]")
