"""A cast as one picture: its stages rendered in a row, and the paths of ball and hand from the side."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from numpy.typing import NDArray

from wam_cast.motion.stages import Stage
from wam_cast.perception.ball_observer import true_cameras
from wam_cast.perception.recorded_cast import Sighting
from wam_cast.robot.plant import STRING_COLOR
from wam_cast.simulation.recording import CastRecording
from wam_cast.types import Array
from wam_cast.visualization.camera import Camera, view_rotation
from wam_cast.visualization.figures.plot_style import MM, draw_legend, draw_picture, halo
from wam_cast.visualization.picture_files import picture_format, write_figure
from wam_cast.visualization.recorded import describe, finite_part, stage_before, stage_pieces, without_turn
from wam_cast.visualization.scene import CastScene
from wam_cast.visualization.side_view import draw_side_view
from wam_cast.visualization.style import INK, STAGE_COLORS, picture_style, stage_name

FRAME_SIZE = (480, 640)
"""Width and height of a rendered frame [pixels]."""

TURN, ELEVATION = math.radians(14), math.radians(9)
"""Of the frames' camera: see `.view_rotation`."""

BEFORE_LANDING = 0.02
"""How long before the landing the drop is shown [s]."""


@dataclass(frozen=True)
class Frame:
    """One rendered sample of a recording.

    Attributes
    ----------
    sample
        Its index in the recording.
    camera
        What took it.
    image
        Red, green and blue, shape (height, width, 3), from 0 to 255.
    string
        Points along the string in the world [m], from the hand to the ball, shape (n, 3).
    """

    sample: int
    camera: Camera
    image: NDArray[np.uint8]
    string: Array


def choose_moments(recording: CastRecording) -> list[int]:
    """Return the samples that tell the cast, in order.

    They are its start, late in the move, the end of the wait, just before the landing, the verdict, and the end of the return.
    Those that the recording does not reach are left out.
    """
    stages, times = recording.stages, recording.times
    ends = {stage: float(times[piece.stop - 1]) for stage, piece in stage_pieces(stages)}
    end_of_move = ends.get(Stage.MOVE, float(times[-1]))  # it may have diverged in the turn
    moments = [0.0, 0.75 * end_of_move, ends.get(Stage.WAIT, end_of_move)]
    crossing = recording.outcome.crossing_time
    moments.append(crossing - BEFORE_LANDING if math.isfinite(crossing) else ends.get(Stage.DROP, times[-1]))
    moments += [recording.outcome.end_time] if recording.cup is not None else []
    moments += [ends[Stage.RETURN]] if Stage.RETURN in ends else []
    return sorted({int(np.argmin(np.abs(times - moment))) for moment in moments})


def render_frames(
    recording: CastRecording, samples: Sequence[int], size: tuple[int, int] = FRAME_SIZE
) -> Iterator[Frame]:
    """Render `samples` of a recording, which must be finite, off screen, all from one place that sees the whole cast.

    `size` is the width and height of a frame [pixels].
    """
    bearing = recording.cast.bearing
    scene = CastScene(recording.scenario, recording.cup, light_bearing=bearing)
    camera = Camera.framing(scene.points_to_show(recording, samples), view_rotation(bearing, TURN, ELEVATION), size)
    for sample in samples:
        scene.show(recording, sample)
        yield Frame(sample, camera, scene.render(camera), scene.string())


def draw_frame(axes: Axes, frame: Frame, recording: CastRecording) -> None:
    """Draw a frame with the paths of ball and hand so far."""
    draw_picture(axes, frame.image)
    _draw_string_on_floor(axes, frame, recording)
    to_top = [0.0, 0.0, recording.scenario.ball.radius]
    ball, top = frame.camera.project(recording.p_WL[frame.sample] + [np.zeros(3), to_top])
    radius = np.linalg.norm(top - ball)
    for stage, piece in stage_pieces(recording.stages[: frame.sample + 1]):
        for path, width in ((recording.p_WE, 0.9), (recording.p_WL, 1.4)):
            pixels = frame.camera.project(path[piece])
            pixels[np.linalg.norm(pixels - ball, axis=1) < radius] = np.nan  # leave the ball itself in sight
            axes.plot(*pixels.T, color=STAGE_COLORS[stage], linewidth=width, path_effects=halo(width + 0.8))


def _draw_string_on_floor(axes: Axes, frame: Frame, recording: CastRecording) -> None:
    """Draw what of the string is below the floor, or in the stand, as lying on it: it collides with nothing."""
    support = np.zeros(len(frame.string))
    if recording.cup is not None and recording.scenario.cup.base_height > 0:
        shape, p_CQ = recording.scenario.cup, frame.string[:, :2] - recording.cup
        support[np.hypot(*p_CQ.T) < shape.base_radius] = shape.base_height
    below = frame.string[:, 2] < support
    shown = below | np.roll(below, 1) | np.roll(below, -1)  # and whereto it goes on
    on_top = np.column_stack([frame.string[:, :2], np.maximum(frame.string[:, 2], support)])
    lying = np.where(shown[:, None], on_top, np.nan)
    if np.any(below):
        axes.plot(*frame.camera.project(lying).T, color=STRING_COLOR, linewidth=0.9, solid_joinstyle="round")


def draw_film_strip(recording: CastRecording, predicted_landing: Array | None = None) -> Figure:
    """Draw a recorded cast from the end of its turn on: its stages rendered, and the paths of ball and hand in the casting plane.

    `predicted_landing`, if given, is marked: world (x, y) [m] where a forward model said that the ball would land.
    """
    recording = without_turn(finite_part(recording))
    frames = list(render_frames(recording, choose_moments(recording)))
    figure = Figure(figsize=(15.0, 8.6), layout="constrained", facecolor="white")
    n_columns = math.ceil(len(frames) / 2)
    grid = figure.add_gridspec(1, 2, width_ratios=(n_columns, 2.1))
    left, right = (figure.add_subfigure(grid[0, column]) for column in range(2))
    panels = left.subplots(2, n_columns, squeeze=False).ravel()
    for number, (axes, frame) in enumerate(zip(panels, frames, strict=False), start=1):
        draw_frame(axes, frame, recording)
        stage = stage_name(stage_before(recording, frame.sample)) if frame.sample else "start"
        axes.set_title(f"{number}  {stage}, {recording.times[frame.sample]:.2f} s")
    for axes in panels[len(frames) :]:
        axes.set_axis_off()
    draw_side_view(right.subplots(), recording, [frame.sample for frame in frames], predicted_landing)
    figure.suptitle(describe(recording, predicted_landing), color=INK)
    return figure


def draw_sighting(recording: CastRecording, sighting: Sighting) -> Figure:
    """Draw what the cameras saw of a recorded cast: the view of each with the centres found in it, and the path made of them."""
    cameras = true_cameras(recording.scenario.cameras)
    figure = Figure(figsize=(5.4 * len(cameras) + 4.2, 4.6), layout="constrained", facecolor="white")
    panels = figure.subplots(1, len(cameras) + 1, squeeze=False)[0]
    scene = CastScene(recording.scenario, recording.cup, light_bearing=recording.cast.bearing)
    n_above = int(np.isfinite(sighting.p_WL).any(axis=1).sum())
    scene.show(recording, int(np.searchsorted(recording.times, sighting.times[max(n_above - 1, 0)])))
    for number, (camera, axes) in enumerate(zip(cameras, panels, strict=False)):
        draw_picture(axes, scene.render(camera))
        found = np.array([look.detections[number, :2] for look in sighting.looks]) - 0.5
        axes.plot(*found.T, "o", color=INK, markersize=5, markerfacecolor="none", label="found in a picture")
        axes.set_title(f"camera {number + 1}")
    side = panels[-1]
    heading = np.array([math.cos(recording.cast.bearing), math.sin(recording.cast.bearing), 0.0])
    while_looking = (recording.times >= sighting.times[0]) & (recording.times <= sighting.times[-1])
    for path, style in (
        (recording.p_WL[while_looking], {"color": "0.65", "linewidth": 4.0, "label": "the ball's path"}),
        (
            sighting.p_WL,
            {"color": INK, "marker": "o", "markersize": 4, "linewidth": 0.8, "label": "as the cameras have it"},
        ),
    ):
        side.plot(path @ heading * MM, path[:, 2] * MM, **style)
    side.axhline(recording.scenario.cup.rim_height * MM, color=INK, linewidth=0.6, linestyle=":")
    if sighting.landing is not None:
        along, height = sighting.landing.position @ heading[:2], recording.scenario.cup.rim_height
        side.plot(along * MM, height * MM, "x", color="C3", markersize=9, markeredgewidth=2, label="observed landing")
    side.set(aspect="equal", xlabel="along the casting plane [mm]", ylabel="height [mm]")
    draw_legend(side, loc="lower center", bbox_to_anchor=(0.5, 1.0))
    figure.suptitle(_what_was_seen(recording, sighting), color=INK)
    return figure


def _what_was_seen(recording: CastRecording, sighting: Sighting) -> str:
    """Return a line on the landing that was observed."""
    if sighting.landing is None:
        return "The ball was not seen to land"
    error = MM * float(np.linalg.norm(sighting.landing.position - recording.outcome.landing))
    return f"Observed landing: {error:.2f} mm off, standard deviation {MM * sighting.landing.std:.2f} mm in x and in y"


def write_picture(recording: CastRecording, path: str | Path, predicted_landing: Array | None = None) -> None:
    """Write the film strip of a recorded cast to `path`, as PNG, PDF or SVG by its suffix.

    Raises
    ------
    InputError
        If the suffix is another one, or the file cannot be written; then nothing is.
    """
    picture_format(path)
    with picture_style():
        write_figure(draw_film_strip(recording, predicted_landing), path)
