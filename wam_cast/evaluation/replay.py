"""A cast as a web page: one file that replays it in any browser, by double click and without a network."""

from __future__ import annotations

import html
import logging
import math
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray
from pydrake.geometry import Meshcat, MeshcatAnimation, MeshcatParams, Rgba

from wam_cast.evaluation.camera import Camera, view_rotation
from wam_cast.evaluation.recorded import describe, finite_part, points_to_show, stage_pieces
from wam_cast.evaluation.scene import CastScene
from wam_cast.evaluation.style import INK, PAPER, STAGE_COLORS, css_color, stage_name
from wam_cast.files import write_file
from wam_cast.system.simulation import CastRecording

Array = NDArray[np.float64]

FRAME_RATE = 32
"""Frames for each second of the cast; the browser moves the bodies smoothly from one to the next."""

TURN, ELEVATION = math.radians(28), math.radians(8)
"""Of the page's first view: see `view_rotation`."""

FIELD_OF_VIEW = math.radians(30)
"""Of the page's camera, vertically."""

BALL_PATH_RADIUS, HAND_PATH_RADIUS = 0.003, 0.002
"""Of the tubes that show the paths [m]: browsers draw lines one pixel wide."""

N_SIDES, N_RINGS = 5, 3
"""Of each piece of a tube."""

REST_AT_END = 0.75
"""How long the last frame stays before the replay starts again [s]."""


def write_replay(recording: CastRecording, path: str | Path, predicted_landing: Array | None = None) -> None:
    """Write a web page to `path` that replays a recorded cast in real time, over and over, and lets its reader look around.

    The paths of ball and hand grow with the cast, coloured by stage.

    Parameters
    ----------
    recording
        What to show.
    path
        Of the page.
    predicted_landing
        World (x, y) [m] where a forward model said that the ball would land, for the caption; or none.

    Raises
    ------
    InputError
        If the file cannot be written; then nothing is.
    """
    recording = finite_part(recording)
    page = _with_caption(open_replay(recording).StaticHtml(), recording, predicted_landing)
    write_file(path, page.encode())


def open_replay(recording: CastRecording) -> Any:
    """Return a Meshcat whose page, at its `web_url()`, replays a recorded cast for as long as it is kept."""
    recording = finite_part(recording)
    meshcat = _quiet_meshcat()
    _dress(meshcat)
    _place_camera(meshcat, recording)
    animation = _record_bodies(meshcat, recording)
    for name, p_WQ, radius in (
        ("ball", recording.p_WL, BALL_PATH_RADIUS),
        ("hand", recording.p_WE, HAND_PATH_RADIUS),
    ):
        _record_path(meshcat, animation, name, p_WQ, recording, radius)
    meshcat.SetAnimation(animation)
    return meshcat


def frame_samples(times: Array) -> NDArray[np.int_]:
    """Return the samples of `times` [s], shape (n,), that the replay's frames show: the nearest to each frame's time.

    After the last one the replay rests on it for `REST_AT_END`.
    """
    n_frames = math.ceil(float(times[-1]) * FRAME_RATE - 1e-9) + 1
    middles = (times[:-1] + times[1:]) / 2
    return np.searchsorted(middles, np.arange(n_frames) / FRAME_RATE)


def last_frame(samples: NDArray[np.int_]) -> int:
    """Return the number of the frame, counted from 0, at which a replay of `samples` ends, rest included."""
    return len(samples) - 1 + round(REST_AT_END * FRAME_RATE)


def tube(p_WQ: Array, radius: float) -> tuple[Array, NDArray[np.int32]]:
    """Return an open tube of `radius` [m] around the path p_WQ [m], shape (n, 3): vertices (3, m) and triangles (3, k)."""
    along = np.gradient(p_WQ, axis=0)
    along /= np.maximum(np.linalg.norm(along, axis=1, keepdims=True), 1e-12)
    # Of the world's axes the one that the path follows least cannot be parallel to it.
    helper = np.eye(3)[np.argmin(np.abs(along).max(axis=0))]
    side = np.cross(along, helper)
    side /= np.maximum(np.linalg.norm(side, axis=1, keepdims=True), 1e-12)
    other = np.cross(along, side)
    angles = 2 * np.pi / N_SIDES * np.arange(N_SIDES)
    rings = p_WQ[:, None] + radius * (
        np.cos(angles)[:, None] * side[:, None] + np.sin(angles)[:, None] * other[:, None]
    )
    index = np.arange(rings.size // 3).reshape(-1, N_SIDES)
    here, there = index[:-1], index[1:]
    quads = np.stack([here, there, np.roll(there, -1, axis=1), np.roll(here, -1, axis=1)], axis=-1).reshape(
        -1, 4
    )
    triangles = np.vstack([quads[:, [0, 1, 2]], quads[:, [0, 2, 3]]])
    return np.asfortranarray(rings.reshape(-1, 3).T), np.asfortranarray(triangles.T, dtype=np.int32)


def _quiet_meshcat() -> Any:
    """Return a Meshcat that listens on a free port of this machine alone, and does not say so."""
    logger = logging.getLogger("drake")
    level = logger.level
    logger.setLevel(logging.WARNING)
    try:
        return Meshcat(MeshcatParams(host="localhost", port=0))
    finally:
        logger.setLevel(level)


def _dress(meshcat: Any) -> None:
    for path in ("/Grid", "/Axes"):
        meshcat.SetProperty(path, "visible", False)
    meshcat.SetProperty("/Background", "top_color", list(PAPER))
    meshcat.SetProperty("/Background", "bottom_color", list(PAPER))


def _place_camera(meshcat: Any, recording: CastRecording) -> None:
    R_WV = view_rotation(recording.cast.bearing, TURN, ELEVATION)
    points = points_to_show(recording)
    camera = Camera.framing(points, R_WV, (1000, 1000), FIELD_OF_VIEW)
    ahead = R_WV[:, 2]
    depth = float(np.mean((points - camera.p_WV) @ ahead))
    meshcat.SetCamera(Meshcat.PerspectiveCamera(fov=math.degrees(FIELD_OF_VIEW)))
    meshcat.SetCameraPose(camera.p_WV, camera.p_WV + depth * ahead)


def _record_bodies(meshcat: Any, recording: CastRecording) -> Any:
    """Show the scene at its start and return an animation of its bodies."""
    scene = CastScene(recording.scenario, recording.cup, meshcat=meshcat, frame_rate=FRAME_RATE)
    scene.set_state(0.0, recording.states[0])
    scene.publish()
    animation = scene.visualizer.StartRecording(False)
    samples = frame_samples(recording.times)
    for frame, sample in [*enumerate(samples), (last_frame(samples), samples[-1])]:
        scene.set_state(frame / FRAME_RATE, recording.states[sample])
        scene.publish()
    scene.visualizer.StopRecording()
    animation.set_loop_mode(MeshcatAnimation.LoopMode.kLoopRepeat)
    animation.set_repetitions(1_000_000)
    return animation


def _record_path(
    meshcat: Any, animation: Any, name: str, p_WQ: Array, recording: CastRecording, radius: float
) -> None:
    """Add the path p_WQ [m], shape (n, 3), of one point to the scene, in pieces that appear with the frames that reach them."""
    samples = frame_samples(recording.times)
    for frame, (start, end) in enumerate(pairwise(samples), start=1):
        span = slice(start, end + 1)
        for stage, piece in stage_pieces(recording.stages[span]):
            points = p_WQ[span][piece]
            if len(points) < 2 or np.max(np.ptp(points, axis=0)) < 1e-4:
                continue
            few = np.linspace(0, len(points) - 1, min(len(points), N_RINGS)).round().astype(int)
            path = f"/paths/{name}/{frame}_{stage_name(stage)}"
            meshcat.SetTriangleMesh(path, *tube(points[few], radius), Rgba(*STAGE_COLORS[stage]))
            animation.SetProperty(0, path, "visible", False)
            animation.SetProperty(frame, path, "visible", True)
            # Each object repeats on its own, so all must end together.
            animation.SetProperty(last_frame(samples), path, "visible", True)


def _with_caption(page: str, recording: CastRecording, predicted_landing: Array | None) -> str:
    """Return Meshcat's `page` with a title, what became of the cast, and what the colours mean."""
    headline, details = describe(recording, predicted_landing).split("\n")
    stages = dict.fromkeys(stage for stage, _ in stage_pieces(recording.stages))
    legend = " ".join(
        f'<span style="color:{css_color(STAGE_COLORS[stage])}">&#9632;</span> {stage_name(stage)}'
        for stage in stages
    )
    caption = (
        f'<div style="position:fixed; left:16px; top:12px; max-width:18em; font:14px/1.5 sans-serif; color:{css_color(INK)}; '
        f'pointer-events:none"><b>{html.escape(headline)}</b><br>{html.escape(details)}<br>{legend}</div>'
    )
    page = page.replace("<title>Drake MeshCat</title>", f"<title>{html.escape(headline)}</title>", 1)
    head, end, tail = page.rpartition("</body>")
    return head + caption + end + tail
