"""What it takes to enter the cup without touching its rim, seen from above."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from matplotlib.patches import Circle, Ellipse, Polygon

from wam_cast.types import Array
from wam_cast.visualization.figures.looks import ABOVE, DARK, LIGHT, MIDDLE, MM, draw_legend
from wam_cast.visualization.figures.parity import DOTS
from wam_cast.visualization.style import INK

if TYPE_CHECKING:
    from matplotlib.axes import Axes


N_DEVIATIONS = 2
"""Standard deviations that the drawn spread reaches to."""

ROOM = 1.15
"""Half the width of the view, by the cup's radius."""


def draw_clear_entry(
    axes: Axes,
    *,
    cup_radius: float,
    ball: tuple[float, float],
    clear: tuple[Array, Array],
    spread: tuple[float, float],
    predicted: tuple[float, float] = (0.0, 0.0),
    landings: tuple[Array, Array] | None = None,
) -> None:
    """Draw the cup's opening, what the ball sweeps of it, where it may land to enter clear, and where it is expected to.

    Parameters
    ----------
    axes
        Where to draw: along the casting plane to the right, across it upward, the cup's axis in the middle.
    cup_radius
        Inner radius of the cup [m].
    ball
        Half axes of the ellipse that the ball sweeps in the rim plane, along and across the casting plane [m].
    clear
        Offsets along the plane, shape (n,), rising, and how far across it the ball may land there at the most, shape (n,) [m].
    spread
        Standard deviations of the landing along and across [m].
    predicted
        Offset of the predicted landing along and across [m], the middle of its spread.
    landings
        Executed landings, along and across [m], each of shape (m,); or none.
    """
    along, half = clear
    known = half >= 0
    outline = np.column_stack([np.tile(along[known], 2), np.concatenate([half[known], -half[known]])]) * MM
    outline[known.sum() :] = outline[: known.sum() - 1 : -1]
    if known.any():
        axes.add_patch(Polygon(outline, facecolor=LIGHT, alpha=0.45, label="landings that enter clear"))
    axes.add_patch(
        Circle((0, 0), cup_radius * MM, fill=False, edgecolor=INK, linewidth=1.6, label="cup's rim")
    )
    swept = Ellipse((0, 0), 2 * ball[0] * MM, 2 * ball[1] * MM)
    swept.set(fill=False, edgecolor=MIDDLE, linestyle="--", linewidth=1.2, label="swept by the ball")
    axes.add_patch(swept)
    middle = predicted[0] * MM, predicted[1] * MM
    deviations = Ellipse(middle, *(2 * N_DEVIATIONS * one * MM for one in spread))
    deviations.set(fill=False, edgecolor=DARK, linewidth=1.2, label=f"{N_DEVIATIONS} standard deviations")
    axes.add_patch(deviations)
    if landings is not None:
        axes.plot(landings[0] * MM, landings[1] * MM, label="executed", **DOTS)
    view = ROOM * cup_radius * MM
    axes.set(xlim=(-view, view), ylim=(-view, view), aspect="equal")
    axes.set_xlabel("off the axis, along [mm]")
    axes.set_ylabel("off the axis, across [mm]")
    draw_legend(axes, **ABOVE)
