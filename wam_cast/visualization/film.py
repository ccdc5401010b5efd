"""A cast as a short film: rendered off screen, with the paths of ball and hand growing, as GIF or MP4."""

from __future__ import annotations

import io
from collections.abc import Iterator, Sequence
from importlib.util import find_spec
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure
from numpy.typing import NDArray
from PIL import Image

from wam_cast.errors import InputError
from wam_cast.simulation.recording import CastRecording
from wam_cast.storage.atomic import write_file
from wam_cast.visualization.film_strip import draw_frame, render_frames
from wam_cast.visualization.picture_files import check_picture, picture_format
from wam_cast.visualization.recorded import (
    checked_speed,
    finite_part,
    frame_moments,
    stage_before,
    without_aftermath,
    without_turn,
)
from wam_cast.visualization.style import INK, PAPER, STAGE_COLORS, picture_style, stage_name, status_name

Picture = NDArray[np.uint8]

FORMATS = ("gif", "mp4")
"""By their suffixes."""

FRAME_RATE = 20
"""Frames for each second of the film; GIFs count in hundredths of a second."""

SMALL_TURN = np.radians(0.5)
"""A turn that cannot be seen [rad]."""

REST_AT_END = 1.5
"""How long the last frame stays [s]."""

FRAME_SIZE, TITLE_HEIGHT = (480, 510), 30
"""Width and height of what is rendered, and the height of the strip above it, which names the stage and the time [pixels]."""

DPI = 100

N_COLORS = 255
"""Of a GIF's one palette; the last of 256 says that a pixel stays as it was."""

VIVID, VIVID_SHARE = 50, 0.3
"""By how much the largest of red, green and blue exceeds the smallest in what is not grey, from 0 to 255, and how much such
pixels weigh in the choice of a GIF's colours, beside all pixels."""


def check_animation(path: str | Path) -> None:
    """Raise `.InputError` if `write_animation` could not write what the suffix of `path` asks for; before a long computation."""
    check_picture(path, FORMATS)
    if picture_format(path, FORMATS) == "mp4" and find_spec("av") is None:
        raise InputError(
            f"cannot write {path}: MP4 takes PyAV; pip install 'wam-cast[animation]', or choose a name that ends in .gif"
        )


def write_animation(recording: CastRecording, path: str | Path, *, speed: float = 1.0) -> None:
    """Write a film of a recorded cast to `path`, as GIF or MP4 by its suffix.

    It shows the cast up to the verdict, at a `speed` relative to the robot's, below 1 in slow motion, and rests on its last frame;
    a GIF then begins anew. A turn that nobody would see is left out.

    Raises
    ------
    InputError
        If the suffix is another one, what writes MP4 is missing, the speed is out of range, or the file cannot be written; then
        nothing is.
    """
    check_animation(path)
    speed = checked_speed(speed)
    encode = {"gif": _gif, "mp4": _mp4}[picture_format(path, FORMATS)]
    with picture_style():
        frames = list(animation_frames(recording, speed))
    write_file(path, encode(frames))


def animation_samples(recording: CastRecording, speed: float = 1.0) -> list[int]:
    """Return the samples that the film shows: `FRAME_RATE` a second of the film, up to the verdict."""
    return [sample for _, sample in frame_moments([without_aftermath(recording)], FRAME_RATE / speed)]


def animation_frames(recording: CastRecording, speed: float = 1.0) -> Iterator[Picture]:
    """Return the film's frames, each of shape (height, width, 3), from 0 to 255; they are rendered one after the other."""
    recording = finite_part(recording)
    if abs(recording.cast.bearing) < SMALL_TURN:
        recording = without_turn(recording)
    samples = animation_samples(recording, speed)
    width, height = FRAME_SIZE[0], FRAME_SIZE[1] + TITLE_HEIGHT
    share = FRAME_SIZE[1] / height
    figure = Figure(figsize=(width / DPI, height / DPI), dpi=DPI, facecolor=PAPER)
    canvas: Any = FigureCanvasAgg(figure)
    for frame in render_frames(recording, samples, FRAME_SIZE):
        figure.clear()
        draw_frame(figure.add_axes((0.0, 0.0, 1.0, share)), frame, recording)
        _draw_title(figure, recording, frame.sample, is_last=frame.sample == samples[-1])
        canvas.draw()
        yield np.array(canvas.buffer_rgba())[:, :, :3]


def _draw_title(figure: Figure, recording: CastRecording, sample: int, *, is_last: bool) -> None:
    """Name the stage on the left and the time on the right, and at the end between them what became of the ball."""
    stage = stage_before(recording, sample)
    middle = 1 - TITLE_HEIGHT / 2 / (FRAME_SIZE[1] + TITLE_HEIGHT)
    figure.text(0.03, middle, stage_name(stage), va="center", weight="bold", color=STAGE_COLORS[stage])
    figure.text(0.97, middle, f"{recording.times[sample]:.2f} s", va="center", ha="right", color=INK)
    if is_last:
        status = status_name(recording.outcome.status)
        figure.text(0.5, middle, status, va="center", ha="center", weight="bold", color=INK)


def _gif(frames: Sequence[Picture]) -> bytes:
    """Return `frames` as a GIF that plays over and over, all in one palette."""
    palette = _palette(np.vstack([frames[0], frames[len(frames) // 2], frames[-1]]))
    first, *rest = (Image.fromarray(frame).quantize(palette=palette, dither=Image.Dither.NONE) for frame in frames)
    durations = [round(1000 / FRAME_RATE)] * len(rest) + [round(1000 * REST_AT_END)]
    content = io.BytesIO()
    first.save(content, "GIF", save_all=True, append_images=rest, duration=durations, loop=0, optimize=False)
    return content.getvalue()


def _palette(telling: Picture) -> Image.Image:
    """Return a picture whose palette has the colours that suit the `telling` one best, vivid ones above all.

    Ball, cup and paths are a hundredth of the picture, and would get next to no colours by their number.
    """
    pixels = telling.reshape(-1, 3)
    vivid = pixels[np.ptp(pixels, axis=1) > VIVID]
    copies = round(VIVID_SHARE * len(pixels) / max(len(vivid), 1))
    weighted = np.vstack([pixels, np.repeat(vivid, copies, axis=0)])
    return Image.fromarray(weighted[None]).quantize(N_COLORS, kmeans=1)


def _mp4(frames: Sequence[Picture]) -> bytes:
    """Return `frames` as H.264 in an MP4."""
    import av

    height, width, _ = frames[0].shape
    content = io.BytesIO()
    with av.open(content, "w", format="mp4") as container:
        stream = container.add_stream("libx264", rate=FRAME_RATE, options={"crf": "18"})
        stream.width, stream.height, stream.pix_fmt = width, height, "yuv420p"
        for picture in [*frames, *[frames[-1]] * round(REST_AT_END * FRAME_RATE)]:
            container.mux(stream.encode(av.VideoFrame.from_ndarray(picture, format="rgb24")))
        container.mux(stream.encode())
    return content.getvalue()
