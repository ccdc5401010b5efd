"""What the model has learned: the landing over distance and speed, at one wait."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from matplotlib.cm import ScalarMappable
from matplotlib.colors import BoundaryNorm
from numpy.typing import NDArray

from wam_cast.evaluation.figures.looks import MS

if TYPE_CHECKING:
    from collections.abc import Sequence

    from matplotlib.axes import Axes
    from matplotlib.contour import QuadContourSet

Array = NDArray[np.float64]

COLORS = "viridis"

FORBIDDEN = (0.97, 0.97, 0.97)

LABELLED, APART = 0.42, 0.10
"""How far from the middle of the axes contours are labelled, and how far from each other, as shares of the axes."""


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
        Of the casts [m] and [m/s], shapes (n,) and (m,), rising.
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
        places = _label_places(lines, distance, speed)
        axes.clabel(lines, fmt="%.2f", fontsize="small", colors="white", manual=places)
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
    axes.set_ylabel("speed [m/s]")


def _label_places(lines: QuadContourSet, distance: Array, speed: Array) -> list[Array]:
    """Return points (2,) for the labels: of each contour the one nearest to the middle, unless it is at the edge or taken."""
    extent = np.array([np.ptp(distance), np.ptp(speed)])
    middle = np.array([distance[0], speed[0]]) + extent / 2
    places: list[Array] = []
    for path in lines.get_paths():
        points = (np.asarray(path.vertices, dtype=float).reshape(-1, 2) - middle) / extent
        points = points[np.max(np.abs(points), axis=1) < LABELLED]
        if len(points):
            place = points[np.argmin(np.linalg.norm(points, axis=1))]
            if all(np.linalg.norm(place - taken) > APART for taken in places):
                places.append(place)
    return [middle + place * extent for place in places]


def draw_landing_scale(axes: Sequence[Axes], levels: Array) -> None:
    """Draw one colour bar beside several axes of `draw_landing_map` that have the same `levels` [m]."""
    norm = BoundaryNorm(levels, 256, extend="both")
    colors = ScalarMappable(norm, COLORS)
    axes[0].figure.colorbar(colors, ax=list(axes), label="predicted landing [m]")
