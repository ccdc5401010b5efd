"""Casts as a web page: one file that replays them in any browser, by double click and without a network."""

from __future__ import annotations

import cmath
import gc
import html
import math
from collections.abc import Sequence
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray
from pydrake.geometry import MeshcatAnimation, Rgba

from wam_cast.evaluation.recorded import (
    describe,
    finite_part,
    join,
    points_to_show,
    stage_pieces,
    what_became,
)
from wam_cast.evaluation.scene import CastScene
from wam_cast.evaluation.style import INK, STAGE_COLORS, css_color, stage_name
from wam_cast.evaluation.viewer import open_meshcat, place_camera, tube
from wam_cast.files import write_file
from wam_cast.system.recording import CastRecording

Array = NDArray[np.float64]

FRAME_RATE = 24
"""Frames for each second of the cast; the browser moves the bodies smoothly from one to the next."""

BALL_PATH_RADIUS, HAND_PATH_RADIUS = 0.003, 0.002
"""Of the tubes that show the paths [m]: browsers draw lines one pixel wide."""

N_RINGS = 3
"""Of each piece of a tube."""

REST_AT_END = 0.75
"""How long the last frame stays before the replay starts again [s]."""


def write_replay(
    recordings: CastRecording | Sequence[CastRecording],
    path: str | Path,
    predicted_landings: Sequence[Array | None] | None = None,
) -> None:
    """Write a web page to `path` that replays recorded casts in real time, over and over, and lets its reader look around.

    The paths of ball and hand grow with each cast, coloured by stage, and go when the next one begins.

    Parameters
    ----------
    recordings
        What to show: one cast, or several that followed each other.
    path
        Of the page.
    predicted_landings
        World (x, y) [m] where a forward model said that each ball would land, for the caption; or none.

    Raises
    ------
    InputError
        If the file cannot be written; then nothing is.
    """
    casts = _casts(recordings)
    landings = [None] * len(casts) if predicted_landings is None else predicted_landings
    page = _with_caption(open_replay(casts).StaticHtml(), casts, landings)
    write_file(path, page.encode())


def open_replay(recordings: CastRecording | Sequence[CastRecording]) -> Any:
    """Return a Meshcat whose page, at its `web_url()`, replays recorded casts for as long as it is kept."""
    casts = _casts(recordings)
    toward = sum(complex(math.cos(one.cast.bearing), math.sin(one.cast.bearing)) for one in casts)
    meshcat = open_meshcat()
    place_camera(meshcat, np.vstack([points_to_show(one) for one in casts]), cmath.phase(toward))
    animation = _record_bodies(meshcat, casts)
    joined = join(casts)
    for name, p_WQ, radius in (
        ("ball", joined.p_WL, BALL_PATH_RADIUS),
        ("hand", joined.p_WE, HAND_PATH_RADIUS),
    ):
        _record_path(meshcat, animation, name, p_WQ, casts, radius)
    meshcat.SetAnimation(animation)
    # The scene's diagram is a cycle that holds the Meshcat, which must end in this thread; any may collect garbage.
    del animation
    gc.collect()
    return meshcat


def _casts(recordings: CastRecording | Sequence[CastRecording]) -> list[CastRecording]:
    several = [recordings] if isinstance(recordings, CastRecording) else recordings
    return [finite_part(recording) for recording in several]


def cast_ends(casts: Sequence[CastRecording]) -> Array:
    """Return when each cast ends [s], from the start of the first one, shape (n,)."""
    return np.cumsum([recording.times[-1] for recording in casts])


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


def _record_bodies(meshcat: Any, casts: Sequence[CastRecording]) -> Any:
    """Show the scene at its start and return an animation of its bodies."""
    joined, ends = join(casts), cast_ends(casts)
    scene = CastScene(joined.scenario, joined.cup, meshcat=meshcat, frame_rate=FRAME_RATE)
    scene.set_state(0.0, joined.states[0])
    scene.publish()
    animation = scene.visualizer.StartRecording(False)
    samples = frame_samples(joined.times)
    for frame, sample in [*enumerate(samples), (last_frame(samples), samples[-1])]:
        number = int(np.searchsorted(ends, joined.times[sample] - 1e-9))
        scene.stand_cup(casts[number].cup)
        scene.set_state(frame / FRAME_RATE, joined.states[sample])
        scene.publish()
    scene.visualizer.StopRecording()
    animation.set_loop_mode(MeshcatAnimation.LoopMode.kLoopRepeat)
    animation.set_repetitions(1_000_000)
    return animation


def _record_path(
    meshcat: Any, animation: Any, name: str, p_WQ: Array, casts: Sequence[CastRecording], radius: float
) -> None:
    """Add the path p_WQ [m], shape (n, 3), of one point to the scene, in pieces that appear with the frames that reach them.

    A cast's pieces disappear with the first frame after its end, unless it is the last one.
    """
    joined, ends = join(casts), cast_ends(casts)
    samples = frame_samples(joined.times)
    last = last_frame(samples)
    for frame, (start, end) in enumerate(pairwise(samples), start=1):
        span = slice(start, end + 1)
        number = int(np.searchsorted(ends, joined.times[end] - 1e-9))
        for stage, piece in stage_pieces(joined.stages[span]):
            points = p_WQ[span][piece]
            if len(points) < 2 or np.max(np.ptp(points, axis=0)) < 1e-4:
                continue
            few = np.linspace(0, len(points) - 1, min(len(points), N_RINGS)).round().astype(int)
            path = f"/paths/{name}/{frame}_{stage_name(stage)}"
            meshcat.SetTriangleMesh(path, *tube(points[few], radius), Rgba(*STAGE_COLORS[stage]))
            animation.SetProperty(0, path, "visible", False)
            animation.SetProperty(frame, path, "visible", True)
            if number + 1 < len(casts):
                animation.SetProperty(math.ceil(ends[number] * FRAME_RATE) + 1, path, "visible", False)
            # Each object repeats on its own, so all must end together.
            animation.SetProperty(last, path, "visible", number + 1 == len(casts))


def _with_caption(page: str, casts: Sequence[CastRecording], landings: Sequence[Array | None]) -> str:
    """Return Meshcat's `page` with a title, what became of each cast, and what the colours mean."""
    headline, *details = describe_all(casts, landings)
    stages = dict.fromkeys(stage for one in casts for stage, _ in stage_pieces(one.stages))
    legend = " ".join(
        f'<span style="color:{css_color(STAGE_COLORS[stage])}">&#9632;</span> {stage_name(stage)}'
        for stage in stages
    )
    lines = "<br>".join(html.escape(line) for line in details)
    caption = (
        f'<div style="position:fixed; left:16px; top:12px; max-width:18em; font:14px/1.5 sans-serif; color:{css_color(INK)}; '
        f'pointer-events:none"><b>{html.escape(headline)}</b><br>{lines}<br>{legend}</div>'
    )
    page = page.replace("<title>Drake MeshCat</title>", f"<title>{html.escape(headline)}</title>", 1)
    head, end, tail = page.rpartition("</body>")
    return head + caption + end + tail


def describe_all(casts: Sequence[CastRecording], landings: Sequence[Array | None]) -> list[str]:
    """Return the caption's lines: of one cast what `describe` says; of several how many were caught, and then each by number."""
    if len(casts) == 1:
        return describe(casts[0], landings[0]).split("\n")
    n_caught = sum(one.outcome.is_caught for one in casts)
    pairs = zip(casts, landings, strict=True)
    lines = [f"{number}  {what_became(*pair)}" for number, pair in enumerate(pairs, start=1)]
    return [f"{n_caught} of {len(casts)} cups in one go", *lines]
