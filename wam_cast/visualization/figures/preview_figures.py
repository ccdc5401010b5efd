"""A scenario from the side, before anything is learned: the arm, where the hand goes, where casts land, where a cup can stand."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.patches import Circle, Rectangle
from numpy.typing import NDArray

from wam_cast.robot.plant import BALL_COLOR
from wam_cast.scenario import Scenario
from wam_cast.types import Array
from wam_cast.visualization.figures.plot_style import BESIDE, DARK, GREY, LIGHT, MIDDLE, draw_legend
from wam_cast.visualization.side_view import RIM_PLANE_LINE, draw_cup_section
from wam_cast.visualization.style import INK

ARM_LINES: tuple[dict[str, Any], ...] = (
    {"color": INK, "linewidth": 3.0, "marker": "o", "markersize": 5, "markerfacecolor": "white"},
    {"color": GREY, "linewidth": 2.2, "marker": "o", "markersize": 4, "markerfacecolor": "white"},
)
"""Of the postures, in their order."""

GOOD_MARK: Any = {
    "marker": "v",
    "color": DARK,
    "markersize": 5,
    "markeredgewidth": 0,
    "alpha": 0.7,
    "linestyle": "none",
}
OTHER_MARK: Any = {"marker": "x", "color": MIDDLE, "markersize": 5, "markeredgewidth": 1.3, "linestyle": "none"}
CUPS_LINE: Any = {"color": LIGHT, "linewidth": 4.0, "solid_capstyle": "butt"}
HAND_REGION: Any = {"facecolor": DARK, "alpha": 0.12, "linewidth": 0}
STRING_LINE: Any = {"color": INK, "linewidth": 0.8}


@dataclass(frozen=True, eq=False)
class SideOfScenario:
    """What the figure shows, in a casting plane: distance from the base axis and height above the floor [m].

    Attributes
    ----------
    scenario
        Whose cup, string and ball are drawn.
    postures
        By name, the arm's joints from the base to the hand, each of shape (n, 2); the string hangs from the first posture's hand.
    hand_radii, hand_heights
        Between which the hand goes.
    landings
        Where casts land, shape (n,); nan for those that do not.
    is_good
        Which of them a cup could catch, shape (n,).
    cups
        Between which distances a cup can stand, nan if nowhere.
    cup
        Where the cup is drawn.
    """

    scenario: Scenario
    postures: Mapping[str, Array]
    hand_radii: tuple[float, float]
    hand_heights: tuple[float, float]
    landings: Array
    is_good: NDArray[np.bool_]
    cups: tuple[float, float]
    cup: float


def draw_scenario(axes: Axes, view: SideOfScenario) -> None:
    """Draw it to scale."""
    cup = view.scenario.cup
    axes.axhline(0.0, color=INK, linewidth=1.2, zorder=1)
    axes.axhline(cup.rim_height, color=INK, zorder=1, label="rim plane", **RIM_PLANE_LINE)
    (left, right), (low, high) = view.hand_radii, view.hand_heights
    region = Rectangle((left, low), right - left, high - low, label="where the hand goes down", **HAND_REGION)
    axes.add_patch(region)
    for (name, joints), look in zip(view.postures.items(), ARM_LINES, strict=False):
        axes.plot(*joints.T, label=name, zorder=4, **look)
    _draw_string(axes, view)
    draw_cup_section(axes, cup, view.cup)
    if np.isfinite(view.cups).all():
        axes.plot(view.cups, [cup.base_height] * 2, label="where a cup can stand", zorder=1.5, **CUPS_LINE)
    for label, chosen, look in (
        ("landing, good for a cup", view.is_good, GOOD_MARK),
        ("landing, not good", ~view.is_good & np.isfinite(view.landings), OTHER_MARK),
    ):
        if chosen.any():
            landings = view.landings[chosen]
            axes.plot(landings, np.full(len(landings), cup.rim_height), label=label, zorder=6, **look)
    axes.set_aspect("equal", adjustable="datalim")
    axes.set(xlabel="along the casting plane [m]", ylabel="height above the floor [m]")
    draw_legend(axes, **BESIDE)


def _draw_string(axes: Axes, view: SideOfScenario) -> None:
    """Draw string and ball as they hang at the start."""
    hand = next(iter(view.postures.values()))[-1]
    ball = hand[0], hand[1] - view.scenario.string.length
    axes.plot([hand[0], ball[0]], [hand[1], ball[1]], label="string and ball at the start", zorder=3, **STRING_LINE)
    axes.add_patch(
        Circle(ball, view.scenario.ball.radius, facecolor=BALL_COLOR, edgecolor=INK, linewidth=0.6, zorder=5)
    )
