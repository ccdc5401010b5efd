"""The robot in a posture, rendered, with some of its frames drawn."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
from matplotlib.patheffects import withStroke
from numpy.typing import NDArray

from wam_cast.robot.plant import N_ARM
from wam_cast.scenario import Scenario
from wam_cast.types import Array
from wam_cast.visualization.camera import Camera, view_rotation
from wam_cast.visualization.recorded import CEILING_THICKNESS
from wam_cast.visualization.scene import CastScene, make_renderer
from wam_cast.visualization.style import INK, Color

if TYPE_CHECKING:
    from collections.abc import Mapping

    from matplotlib.axes import Axes


PICTURE_SIZE = (760, 900)
"""Width and height of the rendered picture [pixels]."""

TURN, ELEVATION = math.radians(30), math.radians(12)
"""Of the camera: see `view_rotation`."""

REACH, BEHIND, ASIDE = 0.95, 0.35, 0.25
"""How far in front of the base axis, behind it and to its sides the picture reaches [m]."""

AXIS_LENGTH = 0.11
"""Of a frame that is drawn [m]."""

JOINT_AXIS_LENGTH = 0.17
"""Of a joint's axis that is drawn, from the joint to its number [m]."""

AXIS_COLORS: tuple[Color, ...] = ((0.85, 0.10, 0.10), (0.05, 0.55, 0.10), (0.10, 0.25, 0.90))
"""Of a frame's x, y and z axis, as everywhere in robotics."""


@dataclass(frozen=True, eq=False)
class RobotView:
    """A rendered picture of the robot, and where in it frames are.

    Attributes
    ----------
    image
        Red, green and blue, shape (height, width, 3), from 0 to 255.
    frames
        By letter, column and row [pixels] of the frame's origin and of the tips of its x, y and z axes, shape (4, 2).
    joint_axes
        Column and row of each joint that is drawn, and of a point along its axis, shape (n, 2, 2).
    """

    image: NDArray[np.uint8]
    frames: dict[str, Array]
    joint_axes: Array


def render_robot(
    scenario: Scenario,
    q_arm: Array,
    *,
    cup: tuple[float, float] | None = None,
    frames: Mapping[str, str] | None = None,
    has_joint_axes: bool = False,
) -> RobotView:
    """Render the robot off screen, the arm at `q_arm` [rad], shape (7,), and the ball hanging at rest.

    Parameters
    ----------
    scenario
        What is rendered.
    q_arm
        Joint angles.
    cup
        World (x, y) of the cup's axis [m]; none hides the cup.
    frames
        By the letter to be written, the name that the plant has for the frame, such as `{"E": "tool_plate"}`.
    has_joint_axes
        Whether the arm's joints' axes are to be drawn.
    """
    scene = CastScene(scenario, cup, renderers={"vtk": make_renderer(0.0)})
    scene.set_posture(q_arm)
    camera = Camera.framing(room_of(scenario), view_rotation(0.0, TURN, ELEVATION), PICTURE_SIZE)
    corners = np.vstack([np.zeros(3), AXIS_LENGTH * np.eye(3)])
    poses = {letter: scene.pose(scene.plant.GetFrameByName(name)) for letter, name in (frames or {}).items()}
    joint_axes = _joint_axes(scene) if has_joint_axes else []
    return RobotView(
        scene.render(camera.to_drake("vtk")),
        {letter: camera.project((X_WF @ corners.T).T) for letter, X_WF in poses.items()},
        np.array([camera.project(ends) for ends in joint_axes]).reshape(-1, 2, 2),
    )


def room_of(scenario: Scenario) -> Array:
    """Return points p_WQ [m], shape (8, 3), such that a picture with all of them in it shows the robot in most postures."""
    heights = (0.0, scenario.arm.mount_height + CEILING_THICKNESS)
    return np.array([(x, y, z) for x in (-BEHIND, REACH) for y in (-ASIDE, ASIDE) for z in heights])


def _joint_axes(scene: CastScene) -> list[Array]:
    """Return the ends of a piece of each of the arm's joints' axes in the world [m], shape (2, 3), in their direction."""
    axes = []
    for index in scene.plant.GetJointIndices(scene.plant.GetModelInstanceByName("wam7"))[:N_ARM]:
        joint = scene.plant.get_joint(index)
        X_WJ = scene.pose(joint.frame_on_child())
        ends = np.outer([0.0, JOINT_AXIS_LENGTH], joint.revolute_axis())
        axes.append(np.asarray(X_WJ @ ends.T).T)
    return axes


def draw_robot(axes: Axes, view: RobotView) -> None:
    """Draw the picture, and in it the frames, x red, y green, z blue, and the joints' axes with their numbers."""
    height, width = view.image.shape[:2]
    axes.imshow(view.image, interpolation="antialiased")
    for letter, (origin, *tips) in view.frames.items():
        for tip, color in zip(tips, AXIS_COLORS, strict=True):
            _draw_arrow(axes, origin, tip, color)
        _write(axes, letter, origin, (-8, -8))
    for number, (middle, end) in enumerate(view.joint_axes, start=1):
        _draw_arrow(axes, middle, end, INK)
        _write(axes, str(number), end, tuple(8 * (end - middle) * [1, -1] / np.linalg.norm(end - middle)))
    axes.set_xlim(-0.5, width - 0.5)
    axes.set_ylim(height - 0.5, -0.5)
    axes.set_axis_off()


def _draw_arrow(axes: Axes, start: Array, end: Array, color: Color) -> None:
    arrow: Any = {"arrowstyle": "-|>", "color": color, "linewidth": 1.6, "shrinkA": 0, "shrinkB": 0}
    halo = [withStroke(linewidth=3, foreground="white")]
    axes.annotate("", tuple(end), tuple(start), arrowprops=arrow | {"path_effects": halo})


def _write(axes: Axes, text: str, point: Array, offset: tuple[float, float]) -> None:
    look: Any = {"ha": "center", "va": "center", "weight": "bold", "color": INK}
    halo = [withStroke(linewidth=3, foreground="white")]
    axes.annotate(text, tuple(point), offset, textcoords="offset points", path_effects=halo, **look)
