"""Figure 3 of the paper: the motion of a cast, from the side and over time."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from wam_cast.visualization.figures.looks import DARK, MIDDLE, draw_legend
from wam_cast.visualization.figures.over_time import draw_stages, end_shown, name_stages
from wam_cast.visualization.recorded import finite_part, without_turn
from wam_cast.visualization.side_view import DESIRED_LINE, RIM_PLANE_LINE, draw_side_view, in_casting_plane
from wam_cast.visualization.style import INK

if TYPE_CHECKING:
    from matplotlib.axes import Axes

    from wam_cast.simulation.recording import CastRecording

HAND_LINE: Any = {"color": DARK, "linewidth": 1.5}
BALL_LINE: Any = {"color": MIDDLE, "linewidth": 1.5, "linestyle": (0, (5, 1.5, 1, 1.5))}
LANDING_LINE: Any = {"color": INK, "linewidth": 1.0, "linestyle": (0, (1, 1.5))}


def draw_motion(path_axes: Axes, radius_axes: Axes, height_axes: Axes, recording: CastRecording) -> None:
    """Draw a recorded cast: its paths, and over time the hand's distance and height as desired and as they were, and the ball's.

    It is drawn from the end of its turn on.

    Parameters
    ----------
    path_axes
        For the paths in the casting plane.
    radius_axes, height_axes
        For the distance from the base axis and the height above the floor, up to the beginning of the hold.
    recording
        What to draw.
    """
    recording = without_turn(finite_part(recording))
    draw_side_view(path_axes, recording)
    shown = recording.times <= end_shown(recording)
    paths = (recording.p_WE, recording.p_WE_desired, recording.p_WL)
    hand, desired, ball = (in_casting_plane(path[shown], recording.cast.bearing).T for path in paths)
    for axes, row in ((radius_axes, 0), (height_axes, 1)):
        draw_stages(axes, recording)
        axes.plot(recording.times[shown], hand[row], label="hand", **HAND_LINE)
        axes.plot(
            recording.times[shown], desired[row], label="hand, desired", color=INK, zorder=3, **DESIRED_LINE
        )
        axes.plot(recording.times[shown], ball[row], label="ball", **BALL_LINE)
        if np.isfinite(recording.outcome.crossing_time):
            axes.axvline(recording.outcome.crossing_time, label="landing", **LANDING_LINE)
    height_axes.axhline(recording.scenario.cup.rim_height, color=INK, label="rim plane", **RIM_PLANE_LINE)
    name_stages(radius_axes, recording)
    radius_axes.tick_params(labelbottom=False)
    radius_axes.set_ylabel("from the base axis [m]")
    height_axes.set_ylabel("above the floor [m]")
    height_axes.set_xlabel("time [s]")
    draw_legend(height_axes, loc="upper center", bbox_to_anchor=(0.5, 0.0), borderaxespad=4.4, ncols=3)
