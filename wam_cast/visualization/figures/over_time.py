"""What happens during a cast over time, between bands that show its stages."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from wam_cast.motion.stages import Stage
from wam_cast.types import Array
from wam_cast.visualization.figures.looks import BESIDE, curve_looks, draw_legend
from wam_cast.visualization.recorded import stage_pieces
from wam_cast.visualization.style import STAGE_COLORS, stage_name

if TYPE_CHECKING:
    from collections.abc import Mapping

    from matplotlib.axes import Axes

    from wam_cast.simulation.recording import CastRecording


HOLD_SHOWN = 0.4
"""How much of the hold is shown over time [s]; after it only the arm goes home."""

BAND_ALPHA = 0.28
"""Of the bands of the stages: the lightest can be seen, and the darkest hides no line."""


def draw_over_time(
    axes: Axes, recording: CastRecording, curves: Mapping[str, Array], *, ylabel: str, is_named: bool = True
) -> None:
    """Draw up to seven curves over the time of a recorded cast, up to the beginning of the hold, and its stages.

    Parameters
    ----------
    axes
        Where to draw.
    recording
        Whose times and stages these are.
    curves
        By name, a value for each sample, shape (n,).
    ylabel
        What they are, with their unit.
    is_named
        Whether the stages' names are written above.
    """
    draw_stages(axes, recording)
    if is_named:
        name_stages(axes, recording)
    shown = recording.times <= end_shown(recording)
    for name, look in curve_looks(curves).items():
        axes.plot(recording.times[shown], curves[name][shown], label=name, **(look | {"marker": ""}))
    axes.set_xlabel("time [s]")
    axes.set_ylabel(ylabel)
    if len(curves) > 1:
        draw_legend(axes, **BESIDE)


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
