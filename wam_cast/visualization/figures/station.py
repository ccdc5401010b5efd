"""The station's diagram: its systems with their connected ports, laid out along the flow of signals from the plant back to it."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable
from typing import TYPE_CHECKING, Any, NamedTuple

from matplotlib.patches import FancyBboxPatch

from wam_cast.robot.station import CastStation
from wam_cast.visualization.figures.looks import DARK, MIDDLE
from wam_cast.visualization.style import INK

if TYPE_CHECKING:
    from matplotlib.axes import Axes

LINE = 0.5
"""Height of a line of text, a port's or a system's name; lengths are in centimetres of a figure as wide as the drawing."""

COLUMN, GAP = 6.0, 1.6
"""Width of the boxes in one column, and what is left between columns for the connections."""

ROW_GAP = 0.5
"""Between boxes above each other."""

ASIDE, LANE = 0.45, 0.2
"""How far from a box its first connection turns, and how far from each other connections run."""

FACE = (1.0, 1.0, 1.0)


class Connection(NamedTuple):
    """An output port and the input port that it feeds: the systems' names and the ports'."""

    source: str
    output: str
    target: str
    input: str


class Box(NamedTuple):
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
    found = [
        Connection(
            source.get_name(),
            source.get_output_port(output).get_name(),
            target.get_name(),
            target.get_input_port(entry).get_name(),
        )
        for (target, entry), (source, output) in station.diagram.connection_map().items()
        if target.num_output_ports() > 0
    ]
    return sorted(found)


def columns(links: Iterable[Connection]) -> dict[str, int]:
    """Return each system's column: how many connections lead to it from the plant, by the shortest way."""
    column, reached = {"plant": 0}, ["plant"]
    for source in reached:  # which grows meanwhile
        for link in links:
            if link.source == source and link.target not in column:
                column[link.target] = column[source] + 1
                reached.append(link.target)
    return column


def lay_out(links: Iterable[Connection]) -> dict[str, Box]:
    """Return a box for each system, those of a column below each other."""
    links = list(links)
    bottoms: dict[int, float] = {}
    boxes = {}
    for name, column in columns(links).items():
        inputs = list(dict.fromkeys(link.input for link in links if link.target == name))
        outputs = list(dict.fromkeys(link.output for link in links if link.source == name))
        boxes[name] = box = Box(column, bottoms.get(column, 0.0), inputs, outputs)
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
        _draw_box(axes, name, box)
    for link in links:
        source, target = boxes[link.source], boxes[link.target]
        x, y = source.left + COLUMN, source.port_height(source.outputs.index(link.output))
        end = target.left, target.port_height(target.inputs.index(link.input))
        left = end[0] - ASIDE - LANE * n_entering[target.column]
        n_entering[target.column] += 1
        if target.column > source.column:
            _draw_line(axes, [(x, y), (left, y), (left, end[1]), end], DARK)
        else:
            n_returning[source.column] += 1
            right = x + LANE * n_returning[source.column]
            _draw_line(axes, [(x, y), (right, y), (right, lane), (left, lane), (left, end[1]), end], MIDDLE)
            lane -= 1.5 * LANE
    widest = max(box.left for box in boxes.values()) + COLUMN
    axes.set(xlim=(-1.0, widest + 0.6), ylim=(lane, 0.3), aspect="equal")
    axes.set_axis_off()


def _draw_box(axes: Axes, name: str, box: Box) -> None:
    look: Any = {"boxstyle": "round,pad=0,rounding_size=0.12", "facecolor": FACE, "edgecolor": INK}
    axes.add_patch(
        FancyBboxPatch((box.left, box.top - box.height), COLUMN, box.height, linewidth=0.9, **look)
    )
    axes.text(box.left + COLUMN / 2, box.top - 0.6 * LINE, name, ha="center", va="center", weight="bold")
    for side, align, ports in ((0.15, "left", box.inputs), (COLUMN - 0.15, "right", box.outputs)):
        for number, port in enumerate(ports):
            axes.text(box.left + side, box.port_height(number), port, ha=align, va="center", fontsize="small")


def _draw_line(axes: Axes, corners: list[tuple[float, float]], color: Any) -> None:
    axes.plot(*zip(*corners[:-1], strict=True), color=color, linewidth=1.1, solid_capstyle="butt")
    tip: Any = {"arrowstyle": "-|>", "color": color, "linewidth": 1.1, "shrinkA": 0, "shrinkB": 0}
    axes.annotate("", corners[-1], corners[-2], arrowprops=tip | {"mutation_scale": 9})
