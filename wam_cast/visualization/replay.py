"""Casts as a web page: one file that replays them in any browser, by double click and without a network."""

from __future__ import annotations

import cmath
import gc
import html
import re
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from jinja2 import Environment, FileSystemLoader, StrictUndefined
from numpy.typing import NDArray
from pydrake.geometry import MeshcatAnimation, Rgba

from wam_cast.errors import InputError
from wam_cast.simulation.recording import CastRecording
from wam_cast.storage.atomic import write_file
from wam_cast.types import Array
from wam_cast.visualization.camera import MARGIN, Camera
from wam_cast.visualization.recorded import (
    describe,
    finite_part,
    frame_moments,
    points_to_show,
    stage_pieces,
    what_became,
)
from wam_cast.visualization.scene import CastScene
from wam_cast.visualization.style import INK, PAPER, STAGE_COLORS, css_color, stage_name
from wam_cast.visualization.viewer import N_SIDES, open_meshcat, place_camera, tube

FRAME_RATE = 100
"""Frames for each second of the cast."""

TOLERANCE = 2e-3
"""How far a body may be off [m] in a frame that is not stored; the browser moves it straight from one stored frame to the next."""

BALL_PATH_RADIUS, HAND_PATH_RADIUS = 0.003, 0.002
"""Of the tubes that show the paths [m]: browsers draw lines one pixel wide."""

RING_SPACING = 0.008
"""From one ring of a tube to the next, along the path [m]."""

SHORTEST_PATH = 1e-3
"""Extent below which a stage draws no path [m]."""

REST_AT_END = 1.5
"""How long the last frame stays before the replay starts again [s]."""

DECODER = re.compile(r'"data:application/(?:wasm|javascript);base64,[A-Za-z0-9+/=]+"')
"""What Meshcat carries for compressed meshes and textures, of which a cast has none: a megabyte."""


def write_replay(
    recordings: CastRecording | Sequence[CastRecording],
    path: str | Path,
    predicted_landings: Sequence[Array | None] | None = None,
) -> None:
    """Write `replay_page` to `path`.

    Raises
    ------
    InputError
        If the file cannot be written; then nothing is.
    """
    write_file(path, replay_page(recordings, predicted_landings).encode())


def replay_page(
    recordings: CastRecording | Sequence[CastRecording],
    predicted_landings: Sequence[Array | None] | None = None,
) -> str:
    """Return a web page that replays recorded casts in real time, over and over, and lets its reader look around.

    It names the stage that runs and its time, and can be stopped and wound. The paths of ball and hand grow with each cast,
    coloured by stage, and go when the next one begins. The cup is lit while it holds the ball.

    Parameters
    ----------
    recordings
        What to show: one cast, or several that followed each other.
    predicted_landings
        World (x, y) [m] where a forward model said that each ball would land, one for each recording, for the caption; or none.

    Raises
    ------
    InputError
        If there are more or fewer landings than recordings.
    """
    casts = _casts(recordings)
    landings = [None] * len(casts) if predicted_landings is None else predicted_landings
    if len(landings) != len(casts):
        raise InputError(
            f"predicted_landings: {len(landings)} for {len(casts)} recordings; give a list with one (x, y) or None for each"
        )
    replay = _open(casts)
    page = DECODER.sub('""', replay.meshcat.StaticHtml())
    player = _player(replay, casts, landings)
    title = f"<title>{html.escape(describe_all(casts, landings)[0])}</title>"
    head, end, tail = page.replace("<title>Drake MeshCat</title>", title, 1).rpartition("</body>")
    return head + player + end + tail


def _casts(recordings: CastRecording | Sequence[CastRecording]) -> list[CastRecording]:
    several = [recordings] if isinstance(recordings, CastRecording) else recordings
    return [finite_part(recording) for recording in several]


@dataclass(frozen=True)
class _Replay:
    """What replays casts: a Meshcat, its camera in a square window, and the frames that reach the rings of each tube."""

    meshcat: Any
    camera: Camera
    growth: dict[str, list[int]]


def _open(casts: Sequence[CastRecording]) -> _Replay:
    toward = sum(cmath.rect(1.0, one.cast.bearing) for one in casts)
    meshcat = open_meshcat()
    camera = place_camera(meshcat, _points(casts), cmath.phase(toward))
    moments = frame_moments(casts, FRAME_RATE)
    animation = _record_bodies(meshcat, casts, moments)
    growth = _record_paths(meshcat, animation, casts, moments)
    meshcat.SetAnimation(animation)
    # The scene's diagram is a cycle that holds the Meshcat, which must end in this thread; any may collect garbage.
    del animation
    gc.collect()
    return _Replay(meshcat, camera, growth)


def _points(casts: Sequence[CastRecording]) -> Array:
    """Return points [m], shape (n, 3), that a page must show to show all of `casts`."""
    return np.vstack([points_to_show(one) for one in casts])


def last_frame(moments: Sequence[tuple[int, int]]) -> int:
    """Return the number of the frame, counted from 0, at which a replay of `moments` ends, rest included."""
    return len(moments) - 1 + round(REST_AT_END * FRAME_RATE)


def key_frames(positions: Array, tolerance: float) -> list[int]:
    """Return frames between which straight lines are nowhere off by more than `tolerance` [m], in order.

    They are found as by Douglas and Peucker: where a line is off most, it is split.

    Parameters
    ----------
    positions
        Of m points in n frames [m], shape (n, m, 3).
    tolerance
        Distance of a point in a frame from where the line between the frames about it has it then [m].
    """
    kept = {0, len(positions) - 1}
    spans = [(0, len(positions) - 1)]
    while spans:
        start, end = spans.pop()
        share = np.linspace(0, 1, end - start + 1)[:, None, None]
        line = positions[start] + share * (positions[end] - positions[start])
        error = np.linalg.norm(positions[start : end + 1] - line, axis=2).max(axis=1)
        worst = start + int(np.argmax(error))
        if error[worst - start] > tolerance:
            kept.add(worst)
            spans += [(start, worst), (worst, end)]
    return sorted(kept)


def _record_bodies(meshcat: Any, casts: Sequence[CastRecording], moments: Sequence[tuple[int, int]]) -> Any:
    """Show the scene at its start and return an animation of its bodies."""
    scene = CastScene(casts[0].scenario, casts[0].cup, meshcat=meshcat, frame_rate=FRAME_RATE)
    positions = []
    for number, sample in moments:
        scene.show(casts[number], sample)
        positions.append(scene.positions())
    scene.show(casts[0], 0)
    scene.publish()
    animation = scene.visualizer.StartRecording(False)
    for frame in [*key_frames(np.array(positions), TOLERANCE), last_frame(moments)]:
        number, sample = moments[min(frame, len(moments) - 1)]
        scene.show(casts[number], sample, (frame + 0.5) / FRAME_RATE)  # in its middle: Drake rounds down
        scene.publish()
    scene.visualizer.StopRecording()
    animation.set_loop_mode(MeshcatAnimation.LoopMode.kLoopRepeat)
    animation.set_repetitions(1_000_000)
    return animation


def _record_paths(
    meshcat: Any, animation: Any, casts: Sequence[CastRecording], moments: Sequence[tuple[int, int]]
) -> dict[str, list[int]]:
    """Add the paths of ball and hand, a tube for each stage of each cast; those of a cast go when the next one begins.

    Returns, by a tube's place in the scene, the frames that reach its rings: Meshcat shows a tube from the first of them on, and
    the page's script lets it grow.
    """
    numbers = np.array([number for number, _ in moments])
    growth = {}
    for number, recording in enumerate(casts):
        frames = np.flatnonzero(numbers == number)
        goes = None if number + 1 == len(casts) else int(frames[-1]) + 1
        samples = [moments[int(frame)][1] for frame in frames]
        for stage, piece in stage_pieces(recording.stages[samples]):
            for name, p_WQ, radius in (
                ("ball", recording.p_WL, BALL_PATH_RADIUS),
                ("hand", recording.p_WE, HAND_PATH_RADIUS),
            ):
                points = p_WQ[samples][piece]
                if np.max(np.ptp(points, axis=0)) < SHORTEST_PATH:
                    continue
                rings = ring_points(points)
                path = f"/paths/{name}/{number}_{stage_name(stage)}"
                meshcat.SetTriangleMesh(path, *tube(points[rings], radius), Rgba(*STAGE_COLORS[stage]))
                growth[path] = [int(frame) for frame in frames[piece][rings]]
                _record_visibility(animation, path, growth[path][0], goes, last_frame(moments))
    return growth


def _record_visibility(animation: Any, path: str, comes: int, goes: int | None, last: int) -> None:
    """Show what is at `path` from one frame to another, or on to the `last` one."""
    animation.SetProperty(0, path, "visible", False)
    animation.SetProperty(comes, path, "visible", True)
    if goes is not None:
        animation.SetProperty(goes, path, "visible", False)
    # Each object repeats on its own, so all must end together.
    animation.SetProperty(last, path, "visible", goes is None)


def ring_points(points: Array) -> NDArray[np.int_]:
    """Return the indices of the first and the last of `points` [m], shape (n, 3), and of one for each `RING_SPACING` between."""
    travelled = np.cumsum(np.linalg.norm(np.diff(points, axis=0, prepend=points[:1]), axis=1))
    passed = np.diff(np.floor(travelled / RING_SPACING), prepend=-1) > 0
    passed[-1] = True
    return np.flatnonzero(passed)


def _player(replay: _Replay, casts: Sequence[CastRecording], landings: Sequence[Array | None]) -> str:
    """Return what the page has besides Meshcat: what became of each cast, the stages, and something to stop and wind it with."""
    environment = Environment(
        loader=FileSystemLoader(Path(__file__).parent), undefined=StrictUndefined, autoescape=True
    )
    headline, *details = describe_all(casts, landings)
    stages = dict.fromkeys(stage for one in casts for stage, _ in stage_pieces(one.stages))
    return environment.get_template("replay.html.j2").render(
        headline=headline,
        details=details,
        stages={stage_name(stage): css_color(STAGE_COLORS[stage]) for stage in stages},
        casts=[_stage_starts(one) for one in casts],
        growth={path[1:]: frames for path, frames in replay.growth.items()},
        frame_rate=FRAME_RATE,
        indices_per_ring=6 * N_SIDES,
        view=_view(_points(casts), replay.camera),
        ink=css_color(INK),
        paper=css_color(PAPER),
    )


def _stage_starts(recording: CastRecording) -> dict[str, Any]:
    """Return how long a cast lasts and when each stage of it starts [s], by name, as the page's script takes it."""
    times = recording.times
    pieces = stage_pieces(recording.stages)
    starts = [[round(float(times[piece.start]), 4), stage_name(stage)] for stage, piece in pieces]
    return {"duration": round(float(times[-1]), 4), "stages": starts}


def _view(p_WQ: Array, camera: Camera) -> list[float]:
    """Return the slopes, to the side and up, of the rays from `camera` that the page must show to show all of p_WQ [m]."""
    p_VQ = (p_WQ - camera.p_WV) @ camera.R_WV
    return [float(slope) for slope in MARGIN * np.max(np.abs(p_VQ[:, :2] / p_VQ[:, 2:]), axis=0)]


def describe_all(casts: Sequence[CastRecording], landings: Sequence[Array | None]) -> list[str]:
    """Return the caption's lines: of one cast what `describe` says; of several how many were caught, and then each by number."""
    if len(casts) == 1:
        return describe(casts[0], landings[0]).split("\n")
    n_caught = sum(one.outcome.is_caught for one in casts)
    pairs = zip(casts, landings, strict=True)
    lines = [f"{number}  {what_became(*pair)}" for number, pair in enumerate(pairs, start=1)]
    return [f"{n_caught} of {len(casts)} cups in one go", *lines]
