"""Recorded casts as MCAP, the open container of robots' recordings: Foxglove and Rerun open it, `mcap` and ROS 2 tools read it.

::

    /joint_states   foxglove.JointStates      q [rad], v [rad/s] and effort [N m] of joints 1 to 7, every sample
    /ball           foxglove.PoseInFrame      p_WL [m], every sample
    /ball_velocity  foxglove.Vector3          v_WL [m/s], every sample
    /hand           foxglove.PoseInFrame      p_WE [m], every sample
    /hand_desired   foxglove.PoseInFrame      the hand's reference [m], every sample that has one
    /tf             foxglove.FrameTransforms  the frames of all bodies of arm and ball in the world, 50 a second
    /scene          foxglove.SceneUpdate      arm and string as lines, the ball, the cup, 50 a second
    /log            foxglove.Log              the stages as they begin, and what became of the cast

Messages are protobuf, whose descriptions the file carries: of Foxglove's own types Rerun draws those that are protobuf and no
others. Times count from the start of the first cast, of several on through all. Metadata `cast 1` and so on have each cast's
numbers, in SI, and the attachments are the scenario and the arm's URDF.
"""

from __future__ import annotations

import io
from collections.abc import Iterator, Sequence
from importlib.util import find_spec
from pathlib import Path
from typing import Any

import numpy as np

from wam_cast.arm.arm_model import arm_model
from wam_cast.errors import InputError
from wam_cast.motion.stages import Stage
from wam_cast.robot.plant import N_ARM
from wam_cast.simulation.recording import CastRecording
from wam_cast.storage.atomic import check_writable, write_file
from wam_cast.visualization.recorded import finite_part, stage_pieces
from wam_cast.visualization.scene import CastScene

SCENE_RATE = 50.0
"""Of what is only looked at [1/s]."""

Message = tuple[int, str, Any]
"""Time [ns], topic and message."""


def check_mcap(path: str | Path) -> None:
    """Raise `.InputError` if `write_mcap` could not write to `path`; for asking before a long computation."""
    if Path(path).suffix.lower() != ".mcap":
        raise InputError(f"cannot write {path}: a recording is MCAP; choose a name that ends in .mcap")
    if find_spec("mcap_protobuf") is None or find_spec("foxglove_schemas_protobuf") is None:
        raise InputError(
            f'cannot write {path}: MCAP lacks its packages; install them with `pip install "wam_cast[mcap]"`'
        )
    check_writable(path)


def write_mcap(recordings: CastRecording | Sequence[CastRecording], path: str | Path) -> None:
    """Write recorded casts that followed each other to `path`; what was there before is replaced.

    Raises
    ------
    InputError
        If the name does not end in `.mcap`, what writes it is not installed, or the file cannot be written; then nothing is.
    """
    check_mcap(path)
    casts = [recordings] if isinstance(recordings, CastRecording) else list(recordings)
    write_file(path, mcap_content(casts))


def mcap_content(casts: Sequence[CastRecording]) -> bytes:
    """Return the content of the file."""
    from mcap_protobuf.writer import Writer

    file, start = io.BytesIO(), 0
    with Writer(file) as writer:
        for recording in map(finite_part, casts):
            for time, topic, message in _messages(recording, start):
                writer.write_message(topic, message, log_time=time, publish_time=time)
            start += _nanoseconds(recording.times[-1])
        scenario = casts[0].scenario
        for name, media_type, text in (
            ("scenario.yaml", "application/yaml", scenario.to_yaml()),
            ("arm.urdf", "application/xml", arm_model(scenario.arm).urdf),
        ):
            writer.add_attachment(0, 0, name, media_type, text.encode())
        for number, recording in enumerate(casts, 1):
            writer.add_metadata(f"cast {number}", cast_metadata(recording))
    return file.getvalue()


def cast_metadata(recording: CastRecording) -> dict[str, str]:
    """Return what was cast and what became of it, as texts that give back the numbers."""
    cast, outcome, cup = recording.cast, recording.outcome, recording.cup
    numbers = {
        "distance": cast.distance,
        "speed": cast.speed,
        "wait": cast.wait,
        "bearing": cast.bearing,
        "landing_x": outcome.landing[0],
        "landing_y": outcome.landing[1],
        "miss": outcome.miss,
        "crossing_time": outcome.crossing_time,
    }
    if cup is not None:
        numbers |= {"cup_x": cup[0], "cup_y": cup[1]}
    return {"status": str(outcome.status)} | {name: repr(float(value)) for name, value in numbers.items()}


def _nanoseconds(time: float) -> int:
    return round(1e9 * float(time))


def _messages(recording: CastRecording, start: int) -> Iterator[Message]:
    """Yield the messages of a cast that starts at a time [ns], in the order of their times."""
    from wam_cast.exchange import foxglove_messages as fox

    scene = CastScene(recording.scenario, recording.cup)
    frames = _frames_of(scene)
    n_q, names = scene.plant.num_positions(), _joint_names(scene)
    seen = np.diff(np.floor(SCENE_RATE * recording.times + 1e-9), prepend=-1) > 0
    begins = {piece.start: stage for stage, piece in stage_pieces(recording.stages)}
    has_reference = np.asarray(np.isfinite(recording.p_WE_desired).all(axis=1))
    for i, time in enumerate(start + _nanoseconds(one) for one in recording.times):
        state = recording.states[i]
        if i == 0 and recording.cup is not None:
            yield time, "/scene", fox.cup_scene(time, recording.cup, recording.scenario.cup)
        if i in begins:
            yield time, "/log", fox.note(time, "stage", Stage(begins[i]).name.lower())
        q, v = state[:N_ARM], state[n_q : n_q + N_ARM]
        yield time, "/joint_states", fox.joint_states(time, names, q, v, recording.torques[i])
        yield time, "/ball", fox.point_in_world(time, recording.p_WL[i])
        yield time, "/ball_velocity", fox.vector(recording.v_WL[i])
        yield time, "/hand", fox.point_in_world(time, recording.p_WE[i])
        if has_reference[i]:
            yield time, "/hand_desired", fox.point_in_world(time, recording.p_WE_desired[i])
        if seen[i]:
            scene.set_state(0.0, state)
            yield time, "/tf", fox.transforms(time, {name: scene.pose(frame) for name, frame in frames.items()})
            yield time, "/scene", fox.moving_scene(time, scene, recording.scenario.ball)
    yield time, "/log", fox.note(time, "outcome", str(recording.outcome.status))


def _joint_names(scene: CastScene) -> list[str]:
    """Return the names of the joints 1 to 7, which are those of the attached URDF."""
    plant = scene.plant
    indices = plant.GetJointIndices(plant.GetModelInstanceByName("wam7"))
    return [plant.get_joint(index).name() for index in indices][:N_ARM]


def _frames_of(scene: CastScene) -> dict[str, Any]:
    """Return the frames of the arm's bodies and of the ball, by name."""
    plant = scene.plant
    bodies = [plant.get_body(i) for i in plant.GetBodyIndices(plant.GetModelInstanceByName("wam7"))]
    return {body.name(): body.body_frame() for body in [*bodies, plant.GetBodyByName("ball")]}
