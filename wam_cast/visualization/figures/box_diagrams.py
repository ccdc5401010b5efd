"""Boxes and arrows: the project, from a scenario to what becomes of a planned cast, and the systems of the station's diagram."""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence
from typing import Any, NamedTuple

from matplotlib.axes import Axes
from matplotlib.patches import FancyBboxPatch, Rectangle

from wam_cast.robot.station import CastStation
from wam_cast.visualization.figures.plot_style import DARK, MIDDLE
from wam_cast.visualization.style import INK, Color

# --- the project; laid out in centimetres of a figure that is as wide

WIDTH, HEIGHT = 16.0, 8.6
"""Of the drawing."""

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

NOTE = (7.7, 3.4, "measures its error")
"""Where something is written along an arrow, and what."""


def draw_data_flow(axes: Axes) -> None:
    """Draw the project's parts as boxes in lanes, and what goes from one to another as arrows: figure 1 of the paper."""
    for number, lane in enumerate(LANES):
        left, width = number * WIDTH / len(LANES), WIDTH / len(LANES)
        axes.add_patch(Rectangle((left, 0), width, HEIGHT, color=LANE_COLORS[number % 2], linewidth=0))
        axes.text(left + width / 2, HEIGHT - 0.35, lane, ha="center", va="center", weight="bold")
    for box in BOXES:
        _draw_part(axes, box)
    axes.text(*NOTE, rotation=90, ha="center", va="center", fontsize="small")
    for corners in ARROWS:
        _draw_arrow(axes, corners, INK, linewidth=0.9, tip=8)
    axes.set(xlim=(0, WIDTH), ylim=(0, HEIGHT), aspect="equal")
    axes.set_axis_off()


def _draw_part(axes: Axes, box: Box) -> None:
    """Draw a box: its name at the top if something else is in it, else in the middle."""
    corner = box.x - box.width / 2, box.y - box.height / 2
    look: Any = {"boxstyle": "round,pad=0,rounding_size=0.08", "edgecolor": INK}
    look |= {"facecolor": PART_COLOR, "linewidth": 0.5} if box.is_part else {"facecolor": BOX_COLOR, "linewidth": 0.9}
    axes.add_patch(FancyBboxPatch(corner, box.width, box.height, **look))
    if box.is_part:
        axes.text(box.x, box.y, box.name, ha="center", va="center", fontsize="small")
        return
    top = box.y + box.height / 2
    axes.text(box.x, top - 0.3, box.name, ha="center", va="center")
    axes.text(box.x, top - 0.52, box.detail, ha="center", va="top", fontsize="small", linespacing=1.1)


def _draw_arrow(
    axes: Axes, corners: Sequence[tuple[float, float]], color: Color, *, linewidth: float, tip: float
) -> None:
    """Draw a line through `corners` with a point at its end, `tip` large [pt]."""
    axes.plot(*zip(*corners[:-1], strict=True), color=color, linewidth=linewidth, solid_capstyle="butt")
    arrow: Any = {"arrowstyle": "-|>", "color": color, "linewidth": linewidth, "shrinkA": 0, "shrinkB": 0}
    axes.annotate("", corners[-1], corners[-2], arrowprops=arrow | {"mutation_scale": tip})


# --- the station, laid out along the flow of signals from the plant back to it; lengths in the same centimetres

LINE = 0.5
"""Height of a line of text, a port's or a system's name."""

COLUMN, GAP, ROW_GAP = 6.0, 1.6, 0.5
"""Width of the boxes; what is left between columns for the connections, and between boxes above each other."""

ASIDE, LANE = 0.45, 0.2
"""How far from a box its first connection turns, and how far from each other connections run."""


class Connection(NamedTuple):
    """An output port and the input port that it feeds: the systems' names and the ports'."""

    source: str
    output: str
    target: str
    input: str


class SystemBox(NamedTuple):
    """A system in the drawing: its column, its upper edge, and the names of its ports that are connected."""

    column: int
    top: float
    inputs: list[str]
    outputs: list[str]

    @property
    def left(self) -> float:
        """Where its inputs are."""
        return self.column * (COLUMN + GAP)

    @property
    def height(self) -> float:
        """With a line for its name."""
        return LINE * (1.4 + max(len(self.inputs), len(self.outputs)))

    def port_height(self, number: int) -> float:
        """Return the height of a port, counted from 0."""
        return self.top - LINE * (1.7 + number)


def connections(station: CastStation) -> list[Connection]:
    """Return the connections between the station's systems; those that only listen, such as logs, are left out."""
    return sorted(
        Connection(
            source.get_name(),
            source.get_output_port(output).get_name(),
            target.get_name(),
            target.get_input_port(entry).get_name(),
        )
        for (target, entry), (source, output) in station.diagram.connection_map().items()
        if target.num_output_ports() > 0
    )


def columns(links: Sequence[Connection]) -> dict[str, int]:
    """Return each system's column: how many connections lead to it from the plant, by the longest way."""
    column, reached = {"plant": 0}, ["plant"]
    for source in reached:  # which grows meanwhile
        for link in links:
            if link.source == source and link.target != "plant" and column.get(link.target, 0) <= column[source]:
                column[link.target] = column[source] + 1
                reached.append(link.target)
    return column


def lay_out(links: Sequence[Connection]) -> dict[str, SystemBox]:
    """Return a box for each system, those of a column below each other."""
    bottoms: dict[int, float] = {}
    boxes = {}
    for name, column in columns(links).items():
        inputs = list(dict.fromkeys(link.input for link in links if link.target == name))
        outputs = list(dict.fromkeys(link.output for link in links if link.source == name))
        boxes[name] = box = SystemBox(column, bottoms.get(column, 0.0), inputs, outputs)
        bottoms[column] = box.top - box.height - ROW_GAP
    return boxes


def draw_station(axes: Axes, station: CastStation) -> None:
    """Draw the station's systems and their connections; those that do not lead to the next column run below the systems."""
    links = connections(station)
    boxes = lay_out(links)
    n_entering: Counter[int] = Counter()
    n_returning: Counter[int] = Counter()
    lane = min(box.top - box.height for box in boxes.values()) - LINE
    for name, box in boxes.items():
        _draw_system(axes, name, box)
    for link in links:
        source, target = boxes[link.source], boxes[link.target]
        x, y = source.left + COLUMN, source.port_height(source.outputs.index(link.output))
        end = target.left, target.port_height(target.inputs.index(link.input))
        left = end[0] - ASIDE - LANE * n_entering[target.column]
        n_entering[target.column] += 1
        if target.column == source.column + 1:
            corners, color = [(x, y), (left, y), (left, end[1]), end], DARK
        else:
            n_returning[source.column] += 1
            right = x + LANE * n_returning[source.column]
            corners, color = [(x, y), (right, y), (right, lane), (left, lane), (left, end[1]), end], MIDDLE
            lane -= 1.5 * LANE
        _draw_arrow(axes, corners, color, linewidth=1.1, tip=9)
    widest = max(box.left for box in boxes.values()) + COLUMN
    axes.set(xlim=(-1.0, widest + 0.6), ylim=(lane, 0.3), aspect="equal")
    axes.set_axis_off()


def _draw_system(axes: Axes, name: str, box: SystemBox) -> None:
    look: Any = {"boxstyle": "round,pad=0,rounding_size=0.12", "facecolor": BOX_COLOR, "edgecolor": INK}
    corner = box.left, box.top - box.height
    axes.add_patch(FancyBboxPatch(corner, COLUMN, box.height, linewidth=0.9, **look))
    axes.text(box.left + COLUMN / 2, box.top - 0.6 * LINE, name, ha="center", va="center", weight="bold")
    for side, align, ports in ((0.15, "left", box.inputs), (COLUMN - 0.15, "right", box.outputs)):
        for number, port in enumerate(ports):
            axes.text(box.left + side, box.port_height(number), port, ha=align, va="center", fontsize="small")
