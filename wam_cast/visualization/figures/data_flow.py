"""Figure 1 of the paper: how the project hangs together, from the scenario to what becomes of a planned cast."""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple

from matplotlib.patches import FancyBboxPatch, Rectangle

from wam_cast.visualization.style import INK

if TYPE_CHECKING:
    from matplotlib.axes import Axes

WIDTH, HEIGHT = 16.0, 8.6
"""Of the drawing; it is laid out in centimetres of a figure that is as wide."""

LANES = ("simulate", "learn", "plan", "execute")

LANE_COLORS = ((0.95, 0.95, 0.97), (0.90, 0.92, 0.95))

BOX_COLOR, PART_COLOR = (1.0, 1.0, 1.0), (0.93, 0.94, 0.95)


class Box(NamedTuple):
    """A box: its middle and its size, what it is called, and what is in it or happens there."""

    x: float
    y: float
    width: float
    height: float
    name: str
    detail: str = ""
    is_part: bool = False


BOXES = (
    Box(2.0, 7.1, 3.2, 1.1, "scenario", "robot, cup, bounds"),
    Box(2.0, 5.4, 3.2, 1.1, "random casts", "distance, speed, wait"),
    Box(2.0, 2.3, 3.2, 3.6, "simulation"),
    Box(2.0, 2.95, 2.4, 0.65, "controller", is_part=True),
    Box(2.0, 1.95, 2.4, 0.65, "arm", is_part=True),
    Box(1.375, 0.95, 1.15, 0.65, "string", is_part=True),
    Box(2.75, 0.95, 0.9, 0.65, "ball", is_part=True),
    Box(6.0, 5.4, 3.8, 1.1, "forward model", "kernel ridge regression"),
    Box(5.65, 3.4, 3.1, 1.1, "model selection", "gradient descent in σ"),
    Box(6.0, 1.25, 3.8, 1.5, "dataset"),
    Box(4.83, 0.95, 1.2, 0.65, "training", is_part=True),
    Box(6.2, 0.95, 1.42, 0.65, "validation", is_part=True),
    Box(7.38, 0.95, 0.8, 0.65, "test", is_part=True),
    Box(10.0, 7.1, 3.2, 1.1, "cup position", "x and y"),
    Box(10.0, 5.4, 3.2, 1.1, "planner", "inverts the model"),
    Box(10.0, 1.25, 3.2, 1.5, "plan", "cast and bearing,\npredicted landing"),
    Box(14.0, 5.2, 3.2, 1.5, "execution", "the same simulation,\nwith contact"),
    Box(14.0, 1.25, 3.2, 1.5, "outcome", "caught or not,\nexecuted miss"),
)

ARROWS = (
    ((2.0, 6.55), (2.0, 5.95)),
    ((2.0, 4.85), (2.0, 4.1)),
    ((1.7, 2.625), (1.7, 2.275)),
    ((2.3, 2.275), (2.3, 2.625)),
    ((1.375, 1.625), (1.375, 1.275)),
    ((1.95, 0.95), (2.3, 0.95)),
    ((3.6, 1.6), (4.1, 1.6)),
    ((5.65, 2.0), (5.65, 2.85)),
    ((5.65, 3.95), (5.65, 4.85)),
    ((7.45, 2.0), (7.45, 4.85)),
    ((7.9, 5.4), (8.4, 5.4)),
    ((10.0, 6.55), (10.0, 5.95)),
    ((10.0, 4.85), (10.0, 2.0)),
    ((11.6, 1.25), (12.0, 1.25), (12.0, 5.2), (12.4, 5.2)),
    ((11.6, 7.1), (14.0, 7.1), (14.0, 5.95)),
    ((14.0, 4.45), (14.0, 2.0)),
)
"""Corners from the start of each arrow to its point."""

NOTES = ((7.7, 3.4, "measures its error"),)
"""Where something is written along an arrow, and what."""


def draw_data_flow(axes: Axes) -> None:
    """Draw the parts of the project as boxes in four lanes, and what goes from one to another as arrows."""
    for number, lane in enumerate(LANES):
        left, width = number * WIDTH / len(LANES), WIDTH / len(LANES)
        axes.add_patch(Rectangle((left, 0), width, HEIGHT, color=LANE_COLORS[number % 2], linewidth=0))
        axes.text(left + width / 2, HEIGHT - 0.35, lane, ha="center", va="center", weight="bold")
    for box in BOXES:
        _draw_box(axes, box)
    for x, y, note in NOTES:
        axes.text(x, y, note, rotation=90, ha="center", va="center", fontsize="small")
    for corners in ARROWS:
        axes.plot(*zip(*corners[:-1], strict=True), color=INK, linewidth=0.9, solid_capstyle="butt")
        tip = {
            "arrowstyle": "-|>",
            "color": INK,
            "linewidth": 0.9,
            "shrinkA": 0,
            "shrinkB": 0,
            "mutation_scale": 8,
        }
        axes.annotate("", corners[-1], corners[-2], arrowprops=tip)
    axes.set(xlim=(0, WIDTH), ylim=(0, HEIGHT), aspect="equal")
    axes.set_axis_off()


def _draw_box(axes: Axes, box: Box) -> None:
    """Draw a box: its name at the top if something else is in it, else in the middle."""
    corner = (box.x - box.width / 2 + 0.08, box.y - box.height / 2 + 0.08)
    axes.add_patch(
        FancyBboxPatch(
            corner,
            box.width - 0.16,
            box.height - 0.16,
            boxstyle="round,pad=0.08",
            facecolor=PART_COLOR if box.is_part else BOX_COLOR,
            edgecolor=INK,
            linewidth=0.5 if box.is_part else 0.9,
        )
    )
    if box.is_part:
        axes.text(box.x, box.y, box.name, ha="center", va="center", fontsize="small")
        return
    top = box.y + box.height / 2
    axes.text(box.x, top - 0.3, box.name, ha="center", va="center")
    axes.text(box.x, top - 0.52, box.detail, ha="center", va="top", fontsize="small", linespacing=1.1)
