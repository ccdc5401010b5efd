"""What the pictures of a recorded cast need to know about it: its stages as pieces, and the room that it takes. No Drake."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from wam_cast.errors import InputError, is_finite, quoted
from wam_cast.motion.stages import Stage
from wam_cast.scenario import Arm
from wam_cast.simulation.ball_and_cup import is_inside
from wam_cast.simulation.recording import CastRecording
from wam_cast.types import Array
from wam_cast.visualization.style import status_name

MOUNT_RADIUS, MOUNT_THICKNESS = 0.18, 0.02
"""Of what the arm is mounted on in pictures [m]: a round patch of ceiling, a round pedestal, or a wall's panel."""

SAMPLED = ("times", "states", "torques", "p_WL", "v_WL", "p_WE", "p_WE_desired", "stages")
"""What of a recording has a value for each sample."""


SLOWEST, FASTEST = 0.05, 10.0
"""At which films and replays run, relative to the robot."""


def checked_speed(speed: float) -> float:
    """Return a film's speed as a float; raises `.InputError` if it is out of range."""
    if not is_finite(speed) or not SLOWEST <= speed <= FASTEST:
        raise InputError(
            f"speed = {quoted(speed)} must be from {SLOWEST:g} to {FASTEST:g}: 1 is the robot's own, less is slow motion"
        )
    return float(speed)


def finite_part(recording: CastRecording) -> CastRecording:
    """Return the recording up to its last sample before a state or the ball is no longer finite: all, unless it diverged."""
    values = np.hstack([recording.states, recording.p_WL, recording.p_WE])
    broken = np.flatnonzero(~np.isfinite(values).all(axis=1))
    return _samples(recording, slice(int(broken[0]) if len(broken) else None))


def without_turn(recording: CastRecording) -> CastRecording:
    """Return the recording from the end of the turn on, with times [s] from there, as `.Outcome.crossing_time` has them."""
    turning = min(int(np.sum(recording.stages == Stage.TURN)), len(recording.times) - 1)
    end_time = recording.outcome.end_time - float(recording.times[turning])
    recording = replace(recording, outcome=replace(recording.outcome, end_time=end_time))
    return _samples(recording, slice(turning, None))


def without_aftermath(recording: CastRecording) -> CastRecording:
    """Return the recording up to when it was judged; nothing happens after it until the return."""
    n = int(np.searchsorted(recording.times, recording.outcome.end_time + 1e-9, side="right"))
    return _samples(recording, slice(n))


def stage_before(recording: CastRecording, sample: int) -> Stage:
    """Return the stage that led to a sample: that at which a stage ends belongs to the next one, but shows what the first did."""
    return Stage(recording.stages[max(sample - 1, 0)])


def holds_ball(recording: CastRecording, samples: slice = slice(None)) -> NDArray[np.bool_]:
    """Return for each of `samples` whether the ball of a cast that was caught is in its cup; never if it was not."""
    p_WL = recording.p_WL[samples]
    if recording.cup is None or not recording.outcome.is_caught:
        return np.zeros(len(p_WL), dtype=bool)
    shape = recording.scenario.cup
    return is_inside(p_WL - [*recording.cup, shape.rim_height], shape)


def frame_moments(casts: Sequence[CastRecording], rate: float) -> list[tuple[int, int]]:
    """Return what the frames of casts that follow each other show, `rate` of them a second, to the end of the last cast.

    Each is the number of a cast, from 0 on, and the sample of it that is nearest to the frame's time. Where two casts meet
    the frame shows the end of the first.
    """
    ends = np.cumsum([recording.times[-1] for recording in casts])
    times = np.arange(math.ceil(ends[-1] * rate - 1e-9) + 1) / rate
    numbers = np.minimum(np.searchsorted(ends, times - 1e-9), len(casts) - 1)
    clocks = [recording.times - recording.times[-1] + end for recording, end in zip(casts, ends, strict=True)]
    moments = zip(numbers.tolist(), times, strict=True)
    return [(number, int(np.argmin(np.abs(clocks[number] - time)))) for number, time in moments]


def _samples(recording: CastRecording, which: slice) -> CastRecording:
    """Return some samples of the recording, with times from the first of them on."""
    recording = replace(recording, **{name: getattr(recording, name)[which] for name in SAMPLED})
    return replace(recording, times=recording.times - recording.times[0])


def stage_pieces(stages: NDArray[np.int_]) -> list[tuple[Stage, slice]]:
    """Return the runs of equal values in `stages`, shape (n,), in order; each ends with the first sample of the next one."""
    starts = [0, *(np.flatnonzero(np.diff(stages)) + 1)]
    ends = [*(start + 1 for start in starts[1:]), len(stages)]
    return [(Stage(stages[start]), slice(int(start), int(end))) for start, end in zip(starts, ends, strict=True)]


def points_to_show(recording: CastRecording) -> Array:
    """Return points p_WQ [m], shape (n, 3), such that a picture with all of them in it shows the whole cast, but for the arm."""
    scenario = recording.scenario
    points = [box_corners(*mount_box(scenario.arm)), recording.p_WE]
    radius, shape = scenario.ball.radius, scenario.cup
    points += [recording.p_WL + offset for offset in box_corners(np.full(3, -radius), np.full(3, radius))]
    foot = recording.p_WL[-1] if recording.cup is None else np.array(recording.cup)
    has_stand = recording.cup is not None and shape.base_height > 0
    around = np.full(2, shape.base_radius if has_stand else shape.outer_radius)
    points.append(box_corners(np.r_[foot[:2] - around, 0.0], np.r_[foot[:2] + around, 0.0]))
    return np.vstack(points)


def mount_box(arm: Arm) -> tuple[Array, Array]:
    """Return two opposite corners p_WQ [m], (3,) each, of the upright box about what the arm is mounted on."""
    radius, thickness, height = MOUNT_RADIUS, MOUNT_THICKNESS, arm.mount_height
    low, high = {
        "ceiling": ((-radius, -radius, height), (radius, radius, height + thickness)),
        "floor": ((-radius, -radius, 0.0), (radius, radius, height)),
        "wall": ((-thickness, -radius, 0.0), (0.0, radius, height + radius)),
    }[arm.mount]
    return np.array(low), np.array(high)


def describe(recording: CastRecording, predicted_landing: Array | None = None) -> str:
    """Return two lines: what became of the cast, and what was cast."""
    return f"{what_became(recording, predicted_landing)}\n{recording.cast}"


def what_became(recording: CastRecording, predicted_landing: Array | None = None) -> str:
    """Return a line on the cup and what became of the ball."""
    outcome, cup = recording.outcome, recording.cup
    facts = [status_name(outcome.status)]
    if cup is not None:
        facts.insert(0, f"cup at ({cup[0]:.3f}, {cup[1]:.3f}) m")
        if predicted_landing is not None:
            facts.append(f"predicted miss {1000 * math.dist(predicted_landing, cup):.1f} mm")
        if math.isfinite(outcome.miss):
            facts.append(f"miss {1000 * outcome.miss:.1f} mm")
    return ", ".join(facts).capitalize()


def describe_all(casts: Sequence[CastRecording], landings: Sequence[Array | None]) -> list[str]:
    """Return lines: of one cast what `describe` says; of several how many were caught, and then each by number.

    `landings` are the predicted ones, world (x, y) [m], or none.
    """
    if len(casts) == 1:
        return describe(casts[0], landings[0]).split("\n")
    n_caught = sum(one.outcome.is_caught for one in casts)
    pairs = enumerate(zip(casts, landings, strict=True), start=1)
    lines = [f"{number}  {what_became(*pair)}" for number, pair in pairs]
    return [f"{n_caught} of {len(casts)} cups without a reset", *lines]


def box_corners(low: Array, high: Array) -> Array:
    """Return the corners, shape (8, 3), of an upright box between two opposite ones, (3,) each."""
    which = np.stack(np.meshgrid([0, 1], [0, 1], [0, 1]), axis=-1).reshape(-1, 3)
    return np.where(which, high, low)
