"""Figure 3 of the paper: the motion of a cast, from the side and over time."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from wam_cast.evaluation.figures.looks import DARK, MIDDLE, draw_legend
from wam_cast.evaluation.recorded import finite_part, stage_pieces, without_turn
from wam_cast.evaluation.side_view import DESIRED_LINE, RIM_PLANE_LINE, draw_side_view, in_casting_plane
from wam_cast.evaluation.style import INK, STAGE_COLORS, stage_name
from wam_cast.system.motion import Stage

if TYPE_CHECKING:
    from matplotlib.axes import Axes

    from wam_cast.system.recording import CastRecording

HOLD_SHOWN = 0.4
"""How much of the hold is shown over time [s]; after it only the arm goes home."""

HAND_LINE: Any = {"color": DARK, "linewidth": 1.5}
BAND_ALPHA = 0.28
"""Of the bands of the stages: the lightest can be seen, and the darkest hides no line."""

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
    shown = recording.times <= _time_shown(recording)
    paths = (recording.p_WE, recording.p_WE_desired, recording.p_WL)
    hand, desired, ball = (in_casting_plane(path[shown], recording.cast.bearing).T for path in paths)
    for axes, row in ((radius_axes, 0), (height_axes, 1)):
        _draw_stages(axes, recording)
        axes.plot(recording.times[shown], hand[row], label="hand", **HAND_LINE)
        axes.plot(
            recording.times[shown], desired[row], label="hand, desired", color=INK, zorder=3, **DESIRED_LINE
        )
        axes.plot(recording.times[shown], ball[row], label="ball", **BALL_LINE)
        if np.isfinite(recording.outcome.crossing_time):
            axes.axvline(recording.outcome.crossing_time, label="landing", **LANDING_LINE)
    height_axes.axhline(recording.scenario.cup.rim_height, color=INK, label="rim plane", **RIM_PLANE_LINE)
    _name_stages(radius_axes, recording)
    radius_axes.tick_params(labelbottom=False)
    radius_axes.set_ylabel("from the base axis [m]")
    height_axes.set_ylabel("above the floor [m]")
    height_axes.set_xlabel("time [s]")
    draw_legend(height_axes, loc="upper center", bbox_to_anchor=(0.5, 0.0), borderaxespad=4.4, ncols=3)


def _time_shown(recording: CastRecording) -> float:
    """Return until when the cast is shown over time [s]."""
    held = recording.times[recording.stages >= Stage.HOLD]
    end = recording.times[-1] if len(held) == 0 else min(held[0] + HOLD_SHOWN, recording.times[-1])
    return float(end)


def _draw_stages(axes: Axes, recording: CastRecording) -> None:
    for stage, piece in stage_pieces(recording.stages):
        start, end = recording.times[piece][[0, -1]]
        axes.axvspan(start, end, color=STAGE_COLORS[stage], alpha=BAND_ALPHA, linewidth=0, zorder=0)
        axes.axvline(start, color="white", linewidth=1.0, zorder=0.5)
    axes.set_xlim(0.0, _time_shown(recording))


def _name_stages(axes: Axes, recording: CastRecording) -> None:
    """Write the name of each stage above its band, aslant, so that short ones have room."""
    last = _time_shown(recording)
    above: Any = {"xycoords": axes.get_xaxis_transform(), "xytext": (0, 2), "textcoords": "offset points"}
    aslant: Any = {"rotation": 30, "rotation_mode": "anchor", "fontsize": "small"}
    for stage, piece in stage_pieces(recording.stages):
        start, end = recording.times[piece][[0, -1]]
        if start < last:
            axes.annotate(stage_name(stage), ((start + min(end, last)) / 2, 1.0), **above, **aslant)
