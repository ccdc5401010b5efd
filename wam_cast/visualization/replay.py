"""Casts as a web page: one file that replays them in any browser, by double click and without a network.

The page is Meshcat's, with the recording that Drake makes. Added by hand is what Meshcat has not: words, a player in sight, paths
that grow, and poses that are stored only where they are needed.
"""

from __future__ import annotations

import gc
import html
import re
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
from jinja2 import Environment, FileSystemLoader, StrictUndefined
from matplotlib.colors import to_hex
from pydrake.geometry import Meshcat, MeshcatAnimation
from pydrake.math import RotationMatrix

from wam_cast.errors import InputError
from wam_cast.motion.stages import Stage
from wam_cast.simulation.recording import CastRecording
from wam_cast.storage.atomic import write_file
from wam_cast.types import Array
from wam_cast.visualization.camera import MARGIN, Camera
from wam_cast.visualization.recorded import (
    checked_speed,
    describe_all,
    finite_part,
    frame_moments,
    stage_pieces,
    without_turn,
)
from wam_cast.visualization.scene import CastScene
from wam_cast.visualization.style import INK, PAPER, STAGE_COLORS, stage_name
from wam_cast.visualization.viewer import (
    BALL_PATH_RADIUS,
    HAND_PATH_RADIUS,
    N_SIDES,
    draw_tube,
    open_meshcat,
    place_camera,
    ring_points,
)

FRAME_RATE = 100
"""Frames for each second of the cast."""

TOLERANCE = 2e-3
"""How far a body may be off [m] in a frame that is not stored; the browser moves it straight from one stored frame to the next."""

SHORTEST_PATH = 1e-3
"""Extent below which a stage draws no path [m]."""

REST_AT_END = 1.5
"""How long the last frame stays before the replay starts again [s]."""

SPEEDS = (0.1, 0.25, 0.5, 1.0, 2.0)
"""At which a replay can be played, besides the one that it was made for."""

OFTEN_SKIPPED = (Stage.TURN, Stage.RETURN)
"""Stages that take two thirds of a replay, in which no ball is cast."""

DECODER = re.compile(r'"data:application/(?:wasm|javascript);base64,[A-Za-z0-9+/=]+"')
"""What Meshcat carries for compressed meshes and textures, of which a cast has none: without it a page is 2.4 MB, not 3.6 MB."""


def write_replay(
    recordings: CastRecording | Sequence[CastRecording],
    path: str | Path,
    predicted_landings: Sequence[Array | None] | None = None,
    *,
    speed: float = 1.0,
) -> None:
    """Write `replay_page` to `path`.

    Raises
    ------
    InputError
        If the file cannot be written; then nothing is.
    """
    write_file(path, replay_page(recordings, predicted_landings, speed=speed).encode())


def replay_page(
    recordings: CastRecording | Sequence[CastRecording],
    predicted_landings: Sequence[Array | None] | None = None,
    *,
    speed: float = 1.0,
) -> str:
    """Return a web page that replays recorded casts, over and over, and lets its reader look around.

    It names the stage that runs and its time, and can be stopped, by the space bar too, wound, and slowed down. It starts with the
    cast; turns and returns are left out unless its reader asks for them. The paths of ball and hand grow with each cast, coloured
    by stage, and go when the next one begins. The cup is lit while it holds the ball, and the camera turns to each cup.

    Parameters
    ----------
    recordings
        What to show: one cast, or several that followed each other.
    predicted_landings
        World (x, y) [m] where a forward model said that each ball would land, one for each recording, for the caption; or none.
    speed
        At which it plays at first, relative to the robot's; below 1 it is slow motion.

    Raises
    ------
    InputError
        If there are more or fewer landings than recordings, or the speed is out of range.
    """
    speed = checked_speed(speed)
    several = [recordings] if isinstance(recordings, CastRecording) else recordings
    casts = [finite_part(recording) for recording in several]
    landings = [None] * len(casts) if predicted_landings is None else predicted_landings
    if len(landings) != len(casts):
        raise InputError(
            f"predicted_landings: {len(landings)} for {len(casts)} recordings; give a list with one (x, y) or None for each"
        )
    meshcat = open_meshcat()
    p_WQ, growth = _record(meshcat, casts)
    camera = place_camera(meshcat, p_WQ, casts[0].cast.bearing)
    # The scene's diagram is a cycle that holds the Meshcat, which must end in this thread; any may collect garbage.
    gc.collect()
    page = DECODER.sub('""', meshcat.StaticHtml())
    caption = describe_all(casts, landings)
    title = f"<title>{html.escape(caption[0])}</title>"
    head, end, tail = page.replace("<title>Drake MeshCat</title>", title, 1).rpartition("</body>")
    return head + _player(casts, caption, growth, _view(p_WQ, camera), speed) + end + tail


def _record(meshcat: Meshcat, casts: Sequence[CastRecording]) -> tuple[Array, dict[str, list[int]]]:
    """Give `meshcat` the scene at its start and the animation; return points to show, (n, 3), and what `_record_paths` does.

    The points are those of all casts, turned to the bearing of the first: the camera turns with the casts.
    """
    scene = CastScene(casts[0].scenario, casts[0].cup, meshcat=meshcat, frame_rate=FRAME_RATE)
    points = []
    for one in map(without_turn, casts):
        R_WP = RotationMatrix.MakeZRotation(casts[0].cast.bearing - one.cast.bearing).matrix()
        # The arm moves by little in a tenth of a second.
        points.append(scene.points_to_show(one, [s for _, s in frame_moments([one], 10.0)]) @ R_WP.T)
    p_WQ = np.vstack(points)
    moments = frame_moments(casts, FRAME_RATE)
    positions = []
    for number, sample in moments:
        scene.show(casts[number], sample)
        positions.append(scene.positions())
    scene.show(casts[0], 0)
    scene.publish()
    last = len(moments) - 1 + round(REST_AT_END * FRAME_RATE)
    stored = {frame: moments[frame] for frame in key_frames(np.array(positions), TOLERANCE)}
    stored[last] = moments[-1]
    animation = scene.record((frame, casts[number], sample) for frame, (number, sample) in stored.items())
    animation.set_loop_mode(MeshcatAnimation.LoopMode.kLoopRepeat)
    animation.set_repetitions(1_000_000)
    growth = _record_paths(meshcat, animation, casts, moments, last)
    meshcat.SetAnimation(animation)
    return p_WQ, growth


def key_frames(positions: Array, tolerance: float) -> list[int]:
    """Return frames, in order, between which straight lines have each point within `tolerance` [m] of where it is then.

    `positions` are those of m points in n frames [m], shape (n, m, 3). The frames are found as by Douglas and Peucker: where a
    line is off most, it is split. With all frames, three casts take 12 MB.
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


def _record_paths(
    meshcat: Meshcat,
    animation: MeshcatAnimation,
    casts: Sequence[CastRecording],
    moments: Sequence[tuple[int, int]],
    last: int,
) -> dict[str, list[int]]:
    """Add the paths of ball and hand, a tube for each stage of each cast; those of a cast go when the next one begins.

    Returns, by a tube's place in the scene, the frames that reach its rings: Meshcat shows a tube from the first of them on, and
    the page's script lets it grow. `last` is the animation's last frame.
    """
    numbers = np.array([number for number, _ in moments])
    growth = {}
    for number, recording in enumerate(casts):
        frames = np.flatnonzero(numbers == number)
        samples = [moments[int(frame)][1] for frame in frames]
        # Each object repeats on its own, so all must end together.
        end = {last: True} if number + 1 == len(casts) else {int(frames[-1]) + 1: False, last: False}
        bodies = (("ball", recording.p_WL, BALL_PATH_RADIUS), ("hand", recording.p_WE, HAND_PATH_RADIUS))
        for stage, piece in stage_pieces(recording.stages[samples]):
            for name, p_WQ, radius in bodies:
                points = p_WQ[samples][piece]
                if np.max(np.ptp(points, axis=0)) < SHORTEST_PATH:
                    continue
                rings = ring_points(points)
                path = f"/paths/{name}/{number}_{stage_name(stage)}"
                draw_tube(meshcat, path, points[rings], radius, STAGE_COLORS[stage])
                growth[path] = [int(frame) for frame in frames[piece][rings]]
                for frame, is_visible in ({0: False, growth[path][0]: True} | end).items():
                    animation.SetProperty(frame, path, "visible", is_visible)
    return growth


def _player(
    casts: Sequence[CastRecording],
    caption: Sequence[str],
    growth: dict[str, list[int]],
    view: list[float],
    speed: float,
) -> str:
    """Return what the page has besides Meshcat: what became of each cast, the stages, and something to stop and wind it with.

    Meshcat's own controls would do that, but they are folded away, cover the scene, and name no stage.
    """
    environment = Environment(
        loader=FileSystemLoader(Path(__file__).parent), undefined=StrictUndefined, autoescape=True
    )
    headline, *details = caption
    stages = dict.fromkeys(stage for one in casts for stage, _ in stage_pieces(one.stages))
    return environment.get_template("replay.html.j2").render(
        headline=headline,
        details=details,
        stages={stage_name(stage): to_hex(STAGE_COLORS[stage]) for stage in stages},
        casts=[_stage_starts(one) for one in casts],
        often_skipped=[stage_name(stage) for stage in OFTEN_SKIPPED if stage in stages],
        speeds={f"{one:g}": f"{one:g} x" for one in sorted({*SPEEDS, speed})},
        speed=f"{speed:g}",
        growth={path[1:]: frames for path, frames in growth.items()},
        frame_rate=FRAME_RATE,
        indices_per_ring=6 * N_SIDES,
        view=view,
        ink=to_hex(INK),
        paper=to_hex(PAPER),
    )


def _stage_starts(recording: CastRecording) -> dict[str, Any]:
    """Return how long a cast lasts, its bearing [rad], and when each stage starts [s], by name, as the page's script takes it."""
    times, pieces = recording.times, stage_pieces(recording.stages)
    starts = [[round(float(times[piece.start]), 4), stage_name(stage)] for stage, piece in pieces]
    return {"duration": round(float(times[-1]), 4), "bearing": round(recording.cast.bearing, 5), "stages": starts}


def _view(p_WQ: Array, camera: Camera) -> list[float]:
    """Return the slopes, to the side and up, of the rays from `camera` that the page must show to show all of p_WQ [m]."""
    p_VQ = (p_WQ - camera.p_WV) @ camera.R_WV
    return [float(slope) for slope in MARGIN * np.max(np.abs(p_VQ[:, :2] / p_VQ[:, 2:]), axis=0)]
