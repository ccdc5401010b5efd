"""What happens during a recorded cast over time, between bands that show its stages."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
from matplotlib.axes import Axes

from wam_cast.motion.stages import Stage
from wam_cast.simulation.recording import CastRecording
from wam_cast.types import Array
from wam_cast.visualization.figures.plot_style import BESIDE, DARK, MIDDLE, curve_styles, draw_legend
from wam_cast.visualization.recorded import finite_part, stage_pieces, without_turn
from wam_cast.visualization.side_view import BELOW_LABEL, DESIRED_LINE, RIM_PLANE_LINE, draw_side_view, in_casting_plane
from wam_cast.visualization.style import INK, STAGE_COLORS, stage_name

HOLD_SHOWN = 0.4
"""How much of the hold is shown over time [s]; after it only the arm goes home."""

BAND_ALPHA = 0.28
"""Of the bands of the stages: the lightest can be seen, and the darkest hides no line."""

HAND_LINE: Any = {"color": DARK, "linewidth": 1.5}
BALL_LINE: Any = {"color": MIDDLE, "linewidth": 1.5, "linestyle": (0, (5, 1.5, 1, 1.5))}
LANDING_LINE: Any = {"color": INK, "linewidth": 1.0, "linestyle": (0, (1, 1.5))}


def draw_over_time(
    axes: Axes, recording: CastRecording, curves: Mapping[str, Array], *, ylabel: str, is_named: bool = True
) -> None:
    """Draw up to seven curves over the time of a recorded cast, up to the beginning of the hold, and its stages.

    Each has, by name, a value for each sample, shape (n,); `ylabel` says what they are, with their unit. The stages' names are
    written above if `is_named`.
    """
    draw_stages(axes, recording)
    if is_named:
        name_stages(axes, recording)
    shown = recording.times <= end_shown(recording)
    for name, style in curve_styles(curves).items():
        axes.plot(recording.times[shown], curves[name][shown], label=name, **(style | {"marker": ""}))
    axes.set(xlabel="time [s]", ylabel=ylabel)
    if len(curves) > 1:
        draw_legend(axes, **BESIDE)


def draw_motion(path_axes: Axes, radius_axes: Axes, height_axes: Axes, recording: CastRecording) -> None:
    """Draw a recorded cast: its paths, and over time hand and ball and where the hand should be: figure 3 of the paper.

    It is drawn from the end of its turn on; over time, in `radius_axes` the distance from the base axis and in `height_axes`
    the height above the floor, up to the beginning of the hold.
    """
    recording = without_turn(finite_part(recording))
    draw_side_view(path_axes, recording)
    shown = recording.times <= end_shown(recording)
    times = recording.times[shown]
    paths = (recording.p_WE, recording.p_WE_desired, recording.p_WL)
    hand, desired, ball = (in_casting_plane(path[shown], recording.cast.bearing).T for path in paths)
    for row, axes in enumerate((radius_axes, height_axes)):
        draw_stages(axes, recording)
        axes.plot(times, hand[row], label="hand", **HAND_LINE)
        axes.plot(times, desired[row], label="hand, desired", color=INK, zorder=3, **DESIRED_LINE)
        axes.plot(times, ball[row], label="ball", **BALL_LINE)
        if np.isfinite(recording.outcome.crossing_time):
            axes.axvline(recording.outcome.crossing_time, label="landing", **LANDING_LINE)
    height_axes.axhline(recording.scenario.cup.rim_height, color=INK, label="rim plane", **RIM_PLANE_LINE)
    name_stages(radius_axes, recording)
    radius_axes.tick_params(labelbottom=False)
    radius_axes.set_ylabel("from the base axis [m]")
    height_axes.set(xlabel="time [s]", ylabel="above the floor [m]")
    draw_legend(height_axes, **BELOW_LABEL, ncols=3)


def end_shown(recording: CastRecording) -> float:
    """Return until when a cast is shown over time [s]."""
    held = recording.times[recording.stages >= Stage.HOLD]
    end = recording.times[-1] if len(held) == 0 else min(held[0] + HOLD_SHOWN, recording.times[-1])
    return float(end)


def draw_stages(axes: Axes, recording: CastRecording) -> None:
    """Draw a band for each stage, over the time that is shown."""
    for stage, piece in stage_pieces(recording.stages):
        start, end = recording.times[piece][[0, -1]]
        axes.axvspan(start, end, color=STAGE_COLORS[stage], alpha=BAND_ALPHA, linewidth=0, zorder=0)
        axes.axvline(start, color="white", linewidth=1.0, zorder=0.5)
    axes.set_xlim(0.0, end_shown(recording))


def name_stages(axes: Axes, recording: CastRecording) -> None:
    """Write the name of each stage above its band, aslant, so that short ones have room."""
    last = end_shown(recording)
    above: Any = {"xycoords": axes.get_xaxis_transform(), "xytext": (0, 2), "textcoords": "offset points"}
    aslant: Any = {"rotation": 30, "rotation_mode": "anchor", "fontsize": "small"}
    for stage, piece in stage_pieces(recording.stages):
        start, end = recording.times[piece][[0, -1]]
        if start < last:
            axes.annotate(stage_name(stage), ((start + min(end, last)) / 2, 1.0), **above, **aslant)
