"""A cast seen from the side, in its casting plane: distance from the base axis along it, height above the floor."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.lines import Line2D
from matplotlib.patches import Circle, Polygon, Rectangle

from wam_cast.casting_plane import to_casting_plane
from wam_cast.robot.cup_mesh import cup_profile
from wam_cast.robot.plant import BALL_COLOR, CUP_COLOR, STAND_COLOR
from wam_cast.scenario import Cup
from wam_cast.simulation.recording import CastRecording
from wam_cast.types import Array
from wam_cast.visualization.recorded import stage_pieces
from wam_cast.visualization.style import INK, STAGE_COLORS, stage_name

BALL_WIDTH, HAND_WIDTH = 2.4, 1.3
"""Of the lines of their paths [pt]."""

DESIRED_LINE: Any = {"linewidth": 0.8, "linestyle": (0, (4, 3))}
RIM_PLANE_LINE: Any = {"linewidth": 0.8, "linestyle": (0, (1, 3))}
LANDING_MARK: Any = {"marker": "x", "markersize": 8, "markeredgewidth": 1.6, "linestyle": "none"}
PREDICTION_MARK: Any = {"marker": "D", "markersize": 8, "markerfacecolor": "none", "linestyle": "none"}

BELOW_LABEL: Any = {"loc": "upper center", "bbox_to_anchor": (0.5, 0.0), "borderaxespad": 4.4}
"""Of a legend below the label of the axis below, whatever the height of the axes: in letters' sizes from it."""


def in_casting_plane(p_WQ: Array, bearing: float) -> Array:
    """Return points p_WQ [m], shape (n, 3), as distance along the casting plane of `bearing` [rad] and height, shape (n, 2)."""
    along = p_WQ[:, :2] @ [np.cos(bearing), np.sin(bearing)]
    return np.column_stack([along, p_WQ[:, 2]])


def draw_side_view(
    axes: Axes, recording: CastRecording, moments: Sequence[int] = (), predicted_landing: Array | None = None
) -> None:
    """Draw the paths of ball and hand, the hand's reference, the cup and its stand to scale and the landing.

    The recording's samples must be finite. At the samples `moments` the ball is drawn and numbered, from 1 on.
    `predicted_landing`, if given, is marked: world (x, y) [m] where a forward model said that the ball would land.
    """
    _draw_surroundings(axes, recording)
    _draw_paths(axes, recording)
    _draw_balls(axes, recording, moments)
    _draw_landings(axes, recording, predicted_landing)
    # Not by the box: the layout knows it before the aspect does, and would cut off the legend below.
    axes.set_aspect("equal", adjustable="datalim")
    axes.set(xlabel="along the casting plane [m]", ylabel="height above the floor [m]", title="In the casting plane")
    axes.spines[["top", "right"]].set_visible(False)
    handles = _legend_handles(recording, predicted_landing is not None)
    axes.legend(handles=handles, **BELOW_LABEL, ncols=3, frameon=False)


def _draw_surroundings(axes: Axes, recording: CastRecording) -> None:
    shape = recording.scenario.cup
    axes.axhline(0.0, color=INK, linewidth=1.2, zorder=1)
    axes.axhline(shape.rim_height, color=INK, zorder=1, **RIM_PLANE_LINE)
    if recording.cup is None:
        return
    along, _ = to_casting_plane(np.array(recording.cup), recording.cast.bearing)
    draw_cup_section(axes, shape, along)


def draw_cup_section(axes: Axes, cup: Cup, along: float) -> None:
    """Draw a cut through the cup, and through the stand that it may have, its axis at `along` in the casting plane [m]."""
    half = np.array(cup_profile(cup))
    section = np.vstack([half, half[::-1] * [-1, 1]]) + np.array([along, cup.rim_height])
    axes.add_patch(Polygon(section, facecolor=CUP_COLOR[:3], edgecolor=INK, linewidth=0.5, zorder=2))
    if cup.base_height > 0:
        corner, size = (along - cup.base_radius, 0.0), (2 * cup.base_radius, cup.base_height)
        axes.add_patch(Rectangle(corner, *size, facecolor=STAND_COLOR[:3], edgecolor=INK, linewidth=0.5, zorder=1.5))


def _draw_paths(axes: Axes, recording: CastRecording) -> None:
    bearing = recording.cast.bearing
    for stage, piece in stage_pieces(recording.stages):
        for path, width in ((recording.p_WL, BALL_WIDTH), (recording.p_WE, HAND_WIDTH)):
            shown = in_casting_plane(path[piece], bearing)
            axes.plot(*shown.T, color=STAGE_COLORS[stage], linewidth=width, zorder=4)
    desired = in_casting_plane(recording.p_WE_desired, bearing)
    axes.plot(*desired.T, color=INK, zorder=5, **DESIRED_LINE)


def _draw_balls(axes: Axes, recording: CastRecording, moments: Sequence[int]) -> None:
    """Draw the ball at its moments, with their numbers; moments at which it is in one place share a ball."""
    centres = in_casting_plane(recording.p_WL[list(moments)], recording.cast.bearing)
    radius = recording.scenario.ball.radius
    balls: list[tuple[Array, list[int]]] = []
    for number, centre in enumerate(centres, start=1):
        same = [numbers for place, numbers in balls if np.linalg.norm(place - centre) < radius]
        if same:
            same[0].append(number)
        else:
            balls.append((centre, [number]))
    for centre, numbers in balls:
        place = (centre[0], centre[1])
        axes.add_patch(Circle(place, radius, facecolor=BALL_COLOR, edgecolor=INK, linewidth=0.6, zorder=6))
        look: Any = {"ha": "center", "va": "center", "fontsize": 7, "color": "white", "zorder": 7}
        if len(numbers) > 1:  # the ball may be too small for them
            look["bbox"] = {"boxstyle": "round,pad=0.25", "facecolor": BALL_COLOR, "edgecolor": "none"}
        axes.annotate(", ".join(map(str, numbers)), place, **look)


def _draw_landings(axes: Axes, recording: CastRecording, predicted_landing: Array | None) -> None:
    height = recording.scenario.cup.rim_height
    along = recording.outcome.landing_along
    if np.isfinite(along):
        axes.plot(along, height, color=INK, zorder=8, **LANDING_MARK)
    if predicted_landing is not None:
        along, _ = to_casting_plane(predicted_landing, recording.cast.bearing)
        axes.plot(along, height, color=INK, zorder=8, **PREDICTION_MARK)


def _legend_handles(recording: CastRecording, has_prediction: bool) -> list[Line2D]:
    stages = dict.fromkeys(stage for stage, _ in stage_pieces(recording.stages))
    looks: dict[str, Any] = {stage_name(stage): {"color": STAGE_COLORS[stage], "linewidth": 4} for stage in stages}
    looks |= {"ball": {"linewidth": BALL_WIDTH}, "hand": {"linewidth": HAND_WIDTH}}
    looks |= {"hand, desired": DESIRED_LINE, "rim plane": RIM_PLANE_LINE}
    if np.isfinite(recording.outcome.landing_along):
        looks["landing"] = LANDING_MARK
    if has_prediction:
        looks["landing, predicted"] = PREDICTION_MARK
    return [Line2D([], [], label=name, **({"color": INK} | look)) for name, look in looks.items()]
