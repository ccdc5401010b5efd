"""Rendered pictures with something drawn in them: the robot with frames and joint axes, and the set-up with its dimensions."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from numpy.typing import NDArray

from wam_cast.arm.arm_model import arm_model
from wam_cast.arm.posture import starting_posture
from wam_cast.casting_plane import from_casting_plane, to_polar
from wam_cast.robot.plant import N_ARM
from wam_cast.scenario import Cup, Scenario
from wam_cast.types import Array, Position
from wam_cast.visualization.camera import Camera, view_rotation
from wam_cast.visualization.figures.plot_style import draw_picture, halo
from wam_cast.visualization.recorded import box_corners, mount_box
from wam_cast.visualization.scene import CastScene
from wam_cast.visualization.style import INK, Color

ROBOT_SIZE, SET_UP_SIZE = (760, 900), (1000, 1240)
"""Width and height of the rendered pictures [pixels]."""

ROBOT_VIEW, SET_UP_VIEW = np.radians((30, 12)), np.radians((8, 6))
"""Turn and elevation of their cameras: see `.view_rotation`."""

REACH, BEHIND, ASIDE, ABOVE = 0.95, 0.35, 0.25, 0.65
"""How far in front of its shoulder, behind it, to its sides and, if it does not hang, above it the robot's picture reaches [m]."""

AXIS_LENGTH, JOINT_AXIS_LENGTH = 0.11, 0.17
"""Of what is drawn of a frame's axes, and of a joint's, from the joint to its number [m]."""

AXIS_COLORS: tuple[Color, ...] = ((0.85, 0.10, 0.10), (0.05, 0.55, 0.10), (0.10, 0.25, 0.90))
"""Of a frame's x, y and z axis, as everywhere in robotics."""

SHORT = 0.2
"""Of an upright dimension line, by the picture's height: what it says is longer than the line."""

LEFT = ("ceiling mount", "floor mount", "wall mount", "WAM arm")
"""What is named at the set-up's left; the rest is named at its right."""

MEASURED = {"ceiling": ("ceiling", "base axis"), "floor": ("base", "base axis"), "wall": ("base axis", "wall")}
"""By mount, what the mounting height is the height of, and from what the cup's distance counts."""


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
    cup: Position | None = None,
    frames: Mapping[str, str] | None = None,
    has_joint_axes: bool = False,
) -> RobotView:
    """Render the robot off screen, the arm at the joint angles `q_arm` [rad], shape (7,), the ball hanging at rest.

    A cup stands at world (x, y) [m], or none. `frames` says, by the letter to be written, the name that the plant has for a frame,
    such as `{"E": "tool_plate"}`; `has_joint_axes`, whether the axes of the arm's joints are to be drawn.
    """
    scene = CastScene(scenario, cup, light_bearing=0.0)
    scene.set_posture(q_arm)
    camera = Camera.framing(room_of(scenario), view_rotation(0.0, *ROBOT_VIEW), ROBOT_SIZE)
    corners = np.vstack([np.zeros(3), AXIS_LENGTH * np.eye(3)])
    poses = {letter: scene.pose(scene.plant.GetFrameByName(name)) for letter, name in (frames or {}).items()}
    joint_axes = _joint_axes(scene) if has_joint_axes else []
    return RobotView(
        scene.render(camera),
        {letter: camera.project((X_WF @ corners.T).T) for letter, X_WF in poses.items()},
        np.array([camera.project(ends) for ends in joint_axes]).reshape(-1, 2, 2),
    )


def room_of(scenario: Scenario) -> Array:
    """Return points p_WQ [m], shape (8, 3), such that a picture with all of them in it shows the robot in most postures."""
    arm, (_, mount_end) = arm_model(scenario.arm), mount_box(scenario.arm)
    top = mount_end[2] if scenario.arm.mount == "ceiling" else arm.shoulder_height + ABOVE
    return box_corners(np.array([-BEHIND, -ASIDE, 0.0]), np.array([arm.shoulder_radius + REACH, ASIDE, top]))


def _joint_axes(scene: CastScene) -> list[Array]:
    """Return the ends of a piece of each of the arm's joints' axes in the world [m], shape (2, 3), in their direction."""
    indices = scene.plant.GetJointIndices(scene.plant.GetModelInstanceByName("wam7"))[:N_ARM]
    joints = [scene.plant.get_joint(index) for index in indices]
    reach = [0.0, JOINT_AXIS_LENGTH]
    return [(scene.pose(joint.frame_on_child()) @ np.outer(joint.revolute_axis(), reach)).T for joint in joints]


def draw_robot(axes: Axes, view: RobotView) -> None:
    """Draw the picture, and in it the frames, x red, y green, z blue, and the joints' axes with their numbers."""
    draw_picture(axes, view.image)
    for letter, (origin, *tips) in view.frames.items():
        for tip, color in zip(tips, AXIS_COLORS, strict=True):
            _draw_arrow(axes, origin, tip, color)
        _write(axes, letter, origin, (-8, -8))
    for number, (middle, end) in enumerate(view.joint_axes, start=1):
        _draw_arrow(axes, middle, end, INK)
        _write(axes, str(number), end, tuple(8 * (end - middle) * [1, -1] / np.linalg.norm(end - middle)))


def _draw_arrow(axes: Axes, start: Array, end: Array, color: Color) -> None:
    arrow: Any = {"arrowstyle": "-|>", "color": color, "linewidth": 1.6, "shrinkA": 0, "shrinkB": 0}
    axes.annotate("", tuple(end), tuple(start), arrowprops=arrow | {"path_effects": halo()})


def _write(axes: Axes, text: str, point: Array, offset: tuple[float, float]) -> None:
    look: Any = {"ha": "center", "va": "center", "weight": "bold", "color": INK, "path_effects": halo()}
    axes.annotate(text, tuple(point), offset, textcoords="offset points", **look)


@dataclass(frozen=True, eq=False)
class SetUpView:
    """A rendered picture of the set-up, and where in it things are.

    Attributes
    ----------
    image
        Red, green and blue, shape (height, width, 3), from 0 to 255.
    parts
        Column and row of each named part [pixels], shape (2,).
    dimensions
        By what they say, the ends of dimension lines [pixels], shape (2, 2).
    """

    image: NDArray[np.uint8]
    parts: dict[str, Array]
    dimensions: dict[str, Array]


def render_set_up(scenario: Scenario, cup: Position) -> SetUpView:
    """Render the arm in its starting posture, the ball hanging, and a cup at world (x, y) [m], off screen."""
    distance, bearing = to_polar(cup)
    scene = CastScene(scenario, cup, light_bearing=bearing)
    scene.set_posture(starting_posture(scenario, bearing))
    parts = _parts(scenario, distance, bearing) | {"WAM arm": scene.position("link2")}
    dimensions = _dimensions(scenario, distance, bearing)
    room = [_in_world(along, 0.0, bearing) for along in (-0.34, distance + _foot_radius(scenario.cup) + 0.06)]
    shown = np.vstack([*dimensions.values(), *parts.values(), scene.arm_points(), *room])
    camera = Camera.framing(shown, view_rotation(bearing, *SET_UP_VIEW), SET_UP_SIZE)
    return SetUpView(
        scene.render(camera),
        {name: camera.project(point[None])[0] for name, point in parts.items()},
        {text: camera.project(ends) for text, ends in dimensions.items()},
    )


def _in_world(along: float, height: float, bearing: float, across: float = 0.0) -> Array:
    """Return the point [m], shape (3,), at a distance along the casting plane, across it to the left, and a height."""
    return np.array([*from_casting_plane(along, across, bearing), height])


def _parts(scenario: Scenario, cup_distance: float, bearing: float) -> dict[str, Array]:
    """Return a point of each named part [m], shape (3,); the arm's depend on its posture and are not here."""
    radius, hand, cup = scenario.motion.start_radius, scenario.motion.start_height, scenario.cup
    _, mount_end = mount_box(scenario.arm)
    places = {
        f"{scenario.arm.mount} mount": (0.0, mount_end[2]),
        "hand": (radius, hand),
        "string": (radius, hand - 0.15 * scenario.string.length),
        "ball": (radius, hand - scenario.string.length),
        "cup": (cup_distance, cup.base_height + 0.7 * cup.height),
    }
    if cup.base_height > 0:
        places["stand"] = (cup_distance + 0.5 * cup.base_radius, 0.5 * cup.base_height)
    return {name: _in_world(*place, bearing) for name, place in places.items()}


def _dimensions(scenario: Scenario, cup_distance: float, bearing: float) -> dict[str, Array]:
    """Return the ends of each dimension line [m], shape (2, 3), by what it says."""
    radius, hand = scenario.motion.start_radius, scenario.motion.start_height
    rim, mount, string = scenario.cup.rim_height, scenario.arm.mount_height, scenario.string.length
    behind, beside_string, beside_cup = -0.27, radius + 0.07, cup_distance - _foot_radius(scenario.cup) - 0.04
    name, origin = MEASURED[scenario.arm.mount]
    spans: dict[str, tuple[tuple[float, ...], tuple[float, ...]]] = {}
    if mount > 0:
        spans[f"{name} {_m(mount)}"] = ((behind, 0.0), (behind, mount))
    spans |= {
        f"string {_m(string)}": ((beside_string, hand - string), (beside_string, hand)),
        f"hand {_m(hand)}": ((beside_string + 0.12, 0.0), (beside_string + 0.12, hand)),
        f"rim {_m(rim)}": ((beside_cup, 0.0), (beside_cup, rim)),
        f"cup {_m(cup_distance)} from the {origin}": ((0.0, 0.0, -0.15), (cup_distance, 0.0, -0.15)),
    }
    return {
        text: np.array([_in_world(along, height, bearing, *across) for along, height, *across in ends])
        for text, ends in spans.items()
    }


def _foot_radius(cup: Cup) -> float:
    """Return the radius of the cup, or of the stand that it has [m]."""
    return cup.base_radius if cup.base_height > 0 else cup.outer_radius


def _m(length: float) -> str:
    return f"{round(length, 3):g} m"


def draw_set_up(axes: Axes, view: SetUpView) -> None:
    """Draw the picture with its parts named beside it, and dimension lines in it: figure 2 of the paper."""
    draw_picture(axes, view.image)
    for text, ends in view.dimensions.items():
        _draw_dimension(axes, text, ends, is_long=bool(np.ptp(ends[:, 1]) > SHORT * len(view.image)))
    width = view.image.shape[1]
    leader: Any = {"arrowstyle": "-", "color": INK, "linewidth": 0.6, "shrinkB": 0}
    for name, point in view.parts.items():
        column, align = (-0.04 * width, "right") if name in LEFT else (1.04 * width, "left")
        label: Any = {"ha": align, "va": "center", "annotation_clip": False, "arrowprops": leader}
        axes.annotate(name, tuple(point), (column, point[1]), **label)
        axes.plot(*point, "o", color=INK, markersize=2.5)


def _draw_dimension(axes: Axes, text: str, ends: Array, *, is_long: bool) -> None:
    """Draw a line with a bar at each end, and what it says: below it if it lies, else at its left, along it if it is long."""
    bars: Any = {"arrowstyle": "|-|,widthA=0.25,widthB=0.25", "color": INK, "linewidth": 0.7}
    axes.annotate("", tuple(ends[0]), tuple(ends[1]), arrowprops=bars | {"shrinkA": 0, "shrinkB": 0})
    across, up = np.abs(ends[1] - ends[0])
    where: Any = {"xytext": (0, -4), "ha": "center", "va": "top"}
    if up > across:
        where = {"xytext": (-2 if is_long else -5, 0), "ha": "right", "va": "center", "rotation": 90 * is_long}
    look: Any = {"textcoords": "offset points", "fontsize": "small", "path_effects": halo(2.5)}
    axes.annotate(text, tuple(ends.mean(axis=0)), **look, **where)
