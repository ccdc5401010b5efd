"""Samples of a recorded cast as Foxglove's messages, in protobuf."""

from collections.abc import Iterable, Sequence

import numpy as np
from foxglove_schemas_protobuf.Color_pb2 import Color
from foxglove_schemas_protobuf.CylinderPrimitive_pb2 import CylinderPrimitive
from foxglove_schemas_protobuf.FrameTransform_pb2 import FrameTransform
from foxglove_schemas_protobuf.FrameTransforms_pb2 import FrameTransforms
from foxglove_schemas_protobuf.JointState_pb2 import JointState
from foxglove_schemas_protobuf.JointStates_pb2 import JointStates
from foxglove_schemas_protobuf.LinePrimitive_pb2 import LinePrimitive
from foxglove_schemas_protobuf.Log_pb2 import Log
from foxglove_schemas_protobuf.Point3_pb2 import Point3
from foxglove_schemas_protobuf.Pose_pb2 import Pose
from foxglove_schemas_protobuf.PoseInFrame_pb2 import PoseInFrame
from foxglove_schemas_protobuf.Quaternion_pb2 import Quaternion
from foxglove_schemas_protobuf.SceneEntity_pb2 import SceneEntity
from foxglove_schemas_protobuf.SceneUpdate_pb2 import SceneUpdate
from foxglove_schemas_protobuf.SpherePrimitive_pb2 import SpherePrimitive
from foxglove_schemas_protobuf.Vector3_pb2 import Vector3
from google.protobuf.timestamp_pb2 import Timestamp
from pydrake.math import RigidTransform

from wam_cast.robot.plant import BALL_COLOR, CUP_COLOR, N_ARM, STRING_COLOR
from wam_cast.scenario import Ball, Cup
from wam_cast.types import Array, Position
from wam_cast.visualization.scene import CastScene

WORLD = "world"
"""Name of the frame W."""

ARM_COLOR = (0.75, 0.76, 0.78, 1.0)
ARM_THICKNESS, STRING_THICKNESS = 0.06, 0.004
"""Of the lines that stand for arm and string [m]."""


def stamp(nanoseconds: int) -> Timestamp:
    """Return a time as protobuf has it."""
    seconds, nanos = divmod(nanoseconds, 10**9)
    return Timestamp(seconds=seconds, nanos=nanos)


def joint_states(time: int, names: Sequence[str], q: Array, v: Array, torque: Array) -> JointStates:
    """Return the arm's q [rad], v [rad/s] and torque [N m], (7,) each, at a time [ns]."""
    joints = [
        JointState(name=name, position=angle, velocity=rate, effort=effort)
        for name, angle, rate, effort in zip(names, q.tolist(), v.tolist(), torque.tolist(), strict=True)
    ]
    return JointStates(timestamp=stamp(time), joints=joints)


def point_in_world(time: int, p_WQ: Array) -> PoseInFrame:
    """Return a point p_WQ [m], (3,), at a time [ns] as a pose without rotation."""
    return PoseInFrame(timestamp=stamp(time), frame_id=WORLD, pose=_pose(p_WQ))


def vector(v: Array) -> Vector3:
    """Return a vector (3,)."""
    x, y, z = v.tolist()
    return Vector3(x=x, y=y, z=z)


def note(time: int, name: str, message: str) -> Log:
    """Return a line that says what begins at a time [ns]."""
    return Log(timestamp=stamp(time), level=Log.Level.INFO, name=name, message=message)


def transforms(time: int, poses: dict[str, RigidTransform]) -> FrameTransforms:
    """Return the poses X_WF of frames by name at a time [ns]."""

    def transform(name: str, X_WF: RigidTransform) -> FrameTransform:
        w, x, y, z = X_WF.rotation().ToQuaternion().wxyz().tolist()
        return FrameTransform(
            timestamp=stamp(time),
            parent_frame_id=WORLD,
            child_frame_id=name,
            translation=vector(X_WF.translation()),
            rotation=Quaternion(x=x, y=y, z=z, w=w),
        )

    return FrameTransforms(transforms=[transform(*pose) for pose in poses.items()])


def moving_scene(time: int, scene: CastScene, ball: Ball) -> SceneUpdate:
    """Return arm, string and ball as a scene has them at a time [ns]."""
    arm = [scene.position(name) for name in (*(f"link{i}" for i in range(1, N_ARM + 1)), "tool_plate")]
    sphere = SpherePrimitive(pose=_pose(scene.position("ball")), size=_equal(2 * ball.radius), color=_color(BALL_COLOR))
    return SceneUpdate(
        entities=[
            _entity(time, "arm", lines=[_line(arm, ARM_THICKNESS, ARM_COLOR)]),
            _entity(time, "string", lines=[_line(scene.string(), STRING_THICKNESS, STRING_COLOR)]),
            _entity(time, "ball", spheres=[sphere]),
        ]
    )


def cup_scene(time: int, cup: Position, shape: Cup) -> SceneUpdate:
    """Return the cup, whose axis is at world (x, y) [m], as it stands from a time [ns] on."""
    middle = np.array([*cup, shape.rim_height - shape.height / 2])
    size = Vector3(x=2 * shape.outer_radius, y=2 * shape.outer_radius, z=shape.height)
    cylinder = CylinderPrimitive(
        pose=_pose(middle), size=size, bottom_scale=1.0, top_scale=1.0, color=_color(CUP_COLOR)
    )
    return SceneUpdate(entities=[_entity(time, "cup", cylinders=[cylinder])])


def _entity(
    time: int,
    name: str,
    *,
    lines: Iterable[LinePrimitive] = (),
    spheres: Iterable[SpherePrimitive] = (),
    cylinders: Iterable[CylinderPrimitive] = (),
) -> SceneEntity:
    return SceneEntity(
        timestamp=stamp(time), frame_id=WORLD, id=name, lines=lines, spheres=spheres, cylinders=cylinders
    )


def _line(p_WQ: Iterable[Array], thickness: float, color: tuple[float, float, float, float]) -> LinePrimitive:
    points = [Point3(x=x, y=y, z=z) for x, y, z in map(np.ndarray.tolist, p_WQ)]
    return LinePrimitive(
        type=LinePrimitive.LINE_STRIP, pose=_pose(np.zeros(3)), thickness=thickness, points=points, color=_color(color)
    )


def _pose(p_WQ: Array) -> Pose:
    return Pose(position=vector(p_WQ), orientation=Quaternion(w=1.0))


def _equal(size: float) -> Vector3:
    return Vector3(x=size, y=size, z=size)


def _color(color: tuple[float, float, float, float]) -> Color:
    r, g, b, a = color
    return Color(r=r, g=g, b=b, a=a)
