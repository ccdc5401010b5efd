"""Scenario -> MuJoCo: the arm from its URDF's elements, string, ball and cup from the scenario's numbers, nothing from the plant.

Frames and the order of positions and velocities are those of `wam_cast.robot.plant`, so that states can be compared as they are.
The text is MJCF, which one may look at. Drake's continuous plant knows no joint stops, so there are none here either.
"""

from __future__ import annotations

import math
from itertools import count
from typing import Any
from xml.etree import ElementTree as ET

import numpy as np
from scipy.optimize import brentq

from wam_cast.arm.arm_chain import FRICTION_SPEED, arm_chain
from wam_cast.arm.arm_model import arm_model
from wam_cast.arm.arm_urdf import JOINTS
from wam_cast.arm.urdf_file import DRAKE, MOMENTS, Element, link_of, number, numbers, rotation
from wam_cast.errors import InputError
from wam_cast.motion.string_chain import STRING_RADIUS
from wam_cast.robot.plant import N_CUP_WALLS
from wam_cast.scenario import Cup, Scenario
from wam_cast.types import Array, Position

MOUNTS = {"ceiling": (math.pi, 0.0, 0.0), "floor": (0.0, 0.0, 0.0), "wall": (0.0, math.pi / 2, 0.0)}
"""Roll, pitch and yaw of the base [rad]."""

SLAB = (3.0, 3.0, 0.1)
"""Half lengths of the floor [m]."""


def import_mujoco() -> Any:
    """Return the package `mujoco`. Raises `.InputError` where it is not installed."""
    try:
        import mujoco
    except ImportError:
        raise InputError('MuJoCo is not installed; pip install "wam_cast[crosscheck]"') from None
    return mujoco


def compiled(mjcf: Element) -> Any:
    """Return MuJoCo's model of an MJCF. Raises `.InputError` where MuJoCo refuses its numbers."""
    try:
        return import_mujoco().MjModel.from_xml_string(ET.tostring(mjcf, encoding="unicode"))
    except ValueError as error:
        raise InputError(f"MuJoCo cannot simulate this scenario: {error}") from None


def robot_mjcf(scenario: Scenario, step: float, *, has_ball: bool = True, cup: Position | None = None) -> Element:
    """Return the MJCF of the mounted arm with motors, friction, string and ball, for steps of `step` [s].

    Its first seven actuators are the motors [N m]. Without `has_ball` it has neither string nor ball. Without a `cup`, world (x, y)
    [m] of its axis, the ball touches nothing; with one MuJoCo's own contact acts.
    """
    mjcf = _empty(scenario, step)
    base = _add_arm(mjcf, scenario, R_WB(scenario.arm.mount, scenario.arm.base_tilt))
    actuators = ET.SubElement(mjcf, "actuator")
    for joint in JOINTS:
        ET.SubElement(actuators, "motor", joint=joint)
    arm = scenario.arm
    for joint, size in zip(JOINTS, arm_chain(arm).coulomb_friction, strict=True):
        if (
            size > 0
        ):  # the actuator's force is bias[2] * velocity within its range: grows to the full friction, then stays
            ET.SubElement(
                actuators,
                "general",
                joint=joint,
                gainprm="0",
                biastype="affine",
                biasprm=_words(0, 0, -size / FRICTION_SPEED),
                forcelimited="true",
                forcerange=_words(-size, size),
            )
    if has_ball:
        (hand,) = (body for body in base.iter("body") if body.get("name") == "tool_plate")
        ball = _add_string_and_ball(hand, scenario)
        if cup is not None:
            _add_contact(mjcf, ball, scenario, cup)
    return mjcf


def believed_arm_mjcf(scenario: Scenario) -> Element:
    """Return the MJCF of the arm alone, as upright as it is said to be: the controller's own model of it."""
    mjcf = _empty(scenario, scenario.controller.period)
    _add_arm(mjcf, scenario, R_WB(scenario.arm.mount))
    return mjcf


def cup_mjcf(scenario: Scenario, cup: Position) -> Element:
    """Return the MJCF of a free ball, a cup whose axis is at world `cup` [m], its stand and the floor."""
    mjcf = _empty(scenario, scenario.controller.period)
    world = ET.SubElement(mjcf, "worldbody")
    ball = ET.SubElement(world, "body", name="ball")
    ET.SubElement(ball, "freejoint")
    _add_inertia(ball, scenario.ball.mass, np.zeros(3), _ball_inertia(scenario))
    _add_contact(mjcf, ball, scenario, cup)
    return mjcf


def linear_damping_ratio(restitution: float) -> float:
    """Return the damping ratio z of a spring and damper that only push, with which an impact keeps `restitution` of its speed.

    With the undamped frequency as the unit and w^2 = 1 - z^2, the force x + 2 z x' ends at the time t with tan(w t) = -2 z w /
    (w^2 - z^2), and the speed left is exp(-z t): Schwager and Poeschel, Coefficient of restitution and linear-dashpot model
    revisited, 2007.
    """

    def left(ratio: float) -> float:
        w = math.sqrt(abs(1 - ratio**2))
        if w < 1e-6:
            return math.exp(-2)
        slow = (
            math.pi - math.atan2(2 * ratio * w, w**2 - ratio**2) if ratio < 1 else math.log((ratio + w) / (ratio - w))
        )
        return math.exp(-ratio * slow / w)

    return float(brentq(lambda ratio: left(ratio) - restitution, 0.0, 10.0))


def R_WB(mount: str, tilt: tuple[float, float] = (0.0, 0.0)) -> Array:
    """Return the orientation of the mounted arm's base, (3, 3), with a small `tilt` about the world's x and y axes [rad]."""
    return np.asarray(rotation(np.array([*tilt, 0.0])) @ rotation(np.array(MOUNTS[mount])))


def _empty(scenario: Scenario, step: float) -> Element:
    mjcf = ET.Element("mujoco", model="wam_cast")
    ET.SubElement(mjcf, "compiler", angle="radian", autolimits="false")
    ET.SubElement(mjcf, "option", integrator="RK4", timestep=_words(step), gravity=_words(0, 0, -scenario.gravity))
    return mjcf


def _add_arm(mjcf: Element, scenario: Scenario, R_WB: Array) -> Element:
    """Add the arm's links, nested as MuJoCo has them, and return the base."""
    urdf = ET.fromstring(arm_model(scenario.arm).urdf)
    world = ET.SubElement(mjcf, "worldbody")
    base = ET.SubElement(
        world, "body", name="base", pos=_words(0, 0, scenario.arm.mount_height), quat=_quaternion(R_WB)
    )
    _fill_body(base, urdf)
    return base


def _fill_body(body: Element, urdf: Element) -> None:
    """Give a body of that name what the URDF's link has, and those that hang on it."""
    name = body.get("name", "")
    inertial = urdf.find(f"link[@name='{name}']/inertial")
    if inertial is not None and number(inertial.find("mass"), "value") > 0:
        origin = inertial.find("origin")
        R, I = rotation(numbers(origin, "rpy")), _matrix(inertial.find("inertia"))  # noqa: E741 - an inertia
        _add_inertia(body, number(inertial.find("mass"), "value"), numbers(origin, "xyz"), R @ I @ R.T)
    for joint in urdf.findall("joint"):
        if link_of(joint.find("parent")) != name:
            continue
        origin = joint.find("origin")
        pose = {"pos": _words(*numbers(origin, "xyz")), "quat": _quaternion(rotation(numbers(origin, "rpy")))}
        child = ET.SubElement(body, "body", {"name": link_of(joint.find("child")), **pose})
        if joint.get("type") == "revolute":
            ET.SubElement(child, "joint", {"name": joint.get("name", ""), **_hinge(joint, urdf)})
        _fill_body(child, urdf)


def _hinge(joint: Element, urdf: Element) -> dict[str, str]:
    """Return the attributes of a joint of the arm; the rotor behind its gear is an armature."""
    motor = f"transmission/joint[@name='{joint.get('name')}']/../actuator/{DRAKE}"
    rotor, ratio = (number(urdf.find(f"{motor}{key}"), "value") for key in ("rotor_inertia", "gear_ratio"))
    return {
        "axis": _words(*numbers(joint.find("axis"), "xyz", "1 0 0")),
        "damping": _words(number(joint.find("dynamics"), "damping")),
        "armature": _words(ratio**2 * rotor),
    }


def _add_string_and_ball(hand: Element, scenario: Scenario) -> Element:
    """Hang string and ball below the hand, and return the ball.

    Each of their bodies is on a universal joint: a hinge about x, then one about y that the first one turns. Where the string hangs
    from, x is normal to the casting plane, so that the first angle swings in it; z points along the string.
    """
    string, ball, n = scenario.string, scenario.ball, scenario.string.n_links
    length, mass = (string.length - ball.radius) / n, string.mass / n
    # A thin rod's across, and a cord's about its own axis, about the centre of mass.
    rod = mass * np.diag([length**2 / 12, length**2 / 12, STRING_RADIUS**2 / 2])
    body, place = hand, {"pos": "0 0 0", "quat": _quaternion(rotation(np.array([0, 0, math.pi / 2])))}
    for i in range(n):
        body = ET.SubElement(body, "body", {"name": f"string_link{i}", **place})
        is_hook = i == 0
        damping = string.hook_damping if is_hook else string.bending_damping / length
        stiffness = 0.0 if is_hook else string.bending_stiffness / length
        _add_universal_joint(body, f"string_joint{i}", damping, stiffness)
        _add_inertia(body, mass, np.array([0, 0, length / 2]), rod)
        place = {"pos": _words(0, 0, length)}
    body = ET.SubElement(body, "body", name="ball", pos=_words(0, 0, length + ball.radius))
    _add_universal_joint(body, "knot", string.knot_damping, 0.0, below=ball.radius)
    _add_inertia(body, ball.mass, np.zeros(3), _ball_inertia(scenario))
    return body


def _ball_inertia(scenario: Scenario) -> Array:
    ball = scenario.ball
    return ball.inertia_factor * ball.mass * ball.radius**2 * np.eye(3)


def _add_universal_joint(body: Element, name: str, damping: float, stiffness: float, below: float = 0.0) -> None:
    """Let a body turn about x and y of a point that its origin is `below` [m]."""
    for axis, unit in (("x", "1 0 0"), ("y", "0 1 0")):
        ET.SubElement(
            body,
            "joint",
            name=f"{name}_{axis}",
            pos=_words(0, 0, -below),
            axis=unit,
            damping=_words(damping),
            stiffness=_words(stiffness),
        )


def _add_inertia(body: Element, mass: float, centre: Array, inertia: Array) -> None:
    """Give a body its mass [kg], with its centre [m] and the inertia about that [kg m^2] in the body's axes."""
    # MuJoCo's own search for the principal axes stops at an absolute error, which is large for a wrist.
    moments, axes = np.linalg.eigh(inertia)
    axes[:, 2] *= np.linalg.det(axes)
    ET.SubElement(
        body, "inertial", pos=_words(*centre), mass=_words(mass), diaginertia=_words(*moments), quat=_quaternion(axes)
    )


def _add_contact(mjcf: Element, ball: Element, scenario: Scenario, position: Position) -> None:
    """Give the ball its surface, and add cup, stand and floor: MuJoCo's own contact is a spring and a damper for each kilogram."""
    cup, rate = scenario.cup, math.sqrt(scenario.cup.stiffness / scenario.ball.mass)
    geom = ET.SubElement(ET.SubElement(mjcf, "default"), "geom")
    geom.set("solref", _words(-(rate**2), -2 * linear_damping_ratio(cup.restitution) * rate))
    geom.set("solimp", "0.9999 0.9999 0.001 0.5 2")  # as stiff and damped as that, whatever the overlap
    geom.set("friction", _words(cup.friction, 0, 0))
    for option in mjcf.findall("option"):
        option.set("cone", "elliptic")
    ET.SubElement(ball, "geom", type="sphere", size=_words(scenario.ball.radius))
    (world,) = mjcf.findall("worldbody")
    _add_cup(world, cup, position)


def _add_cup(world: Element, cup: Cup, position: Position) -> None:
    """Add the cup, turned to face the base axis, its stand and the floor: for contact the wall is a ring of boxes."""
    body = ET.SubElement(world, "body", name="cup", pos=_words(*position, 0))
    names = (f"cup_part{i}" for i in count())
    facing = math.atan2(position[1], position[0])
    half_width = cup.outer_radius * math.tan(math.pi / N_CUP_WALLS)
    for angle in facing + 2 * math.pi * np.arange(N_CUP_WALLS) / N_CUP_WALLS:
        middle = cup.inner_radius + cup.wall_thickness / 2
        ET.SubElement(
            body,
            "geom",
            name=next(names),
            type="box",
            pos=_words(middle * math.cos(angle), middle * math.sin(angle), cup.rim_height - cup.height / 2),
            quat=_quaternion(rotation(np.array([0, 0, angle]))),
            size=_words(cup.wall_thickness / 2, half_width, cup.height / 2),
        )
    for radius, low, high in (
        (cup.outer_radius, cup.base_height, cup.bottom_height),
        (cup.base_radius, 0.0, cup.base_height),
    ):
        if high > low:
            place, size = _words(0, 0, (low + high) / 2), _words(radius, (high - low) / 2)
            ET.SubElement(body, "geom", name=next(names), type="cylinder", pos=place, size=size)
    ET.SubElement(world, "geom", name="floor", type="box", pos=_words(0, 0, -SLAB[2]), size=_words(*SLAB))


def _matrix(inertia: Element | None) -> Array:
    xx, xy, xz, yy, yz, zz = (number(inertia, key) for key in MOMENTS)
    return np.array([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]])


def _quaternion(R: Array) -> str:
    """Return a rotation matrix as MuJoCo writes it, w first."""
    quaternion = np.zeros(4)
    import_mujoco().mju_mat2Quat(quaternion, R.flatten())
    return _words(*quaternion)


def _words(*numbers: float) -> str:
    return " ".join(repr(float(one)) for one in numbers)
