"""Reading an arm's URDF: any arm of seven revolute joints that are arranged as the WAM's, under the names of the shipped one.

At zero the joints turn about z, y, z, y, z, y, z of the base; the axes of the first three meet in the shoulder, and the other
joints and the hand lie in the plane y = 0. How the links' own frames are turned does not matter.
"""

from __future__ import annotations

from pathlib import Path
from typing import NamedTuple
from xml.etree import ElementTree as ET

import numpy as np

from wam_cast.arm.urdf_file import (
    DRAKE,
    Element,
    check_inertia,
    check_shapes,
    link_of,
    named,
    number,
    numbers,
    parent_joints,
    parse_urdf,
    resolve_meshes,
    rotation,
    rpy_of,
)
from wam_cast.errors import InputError
from wam_cast.scenario_parts import Arm
from wam_cast.types import Array

AXES = "zyzyzyz"
"""About which the joints turn at zero."""

JOINTS = (
    *("j1_base_yaw", "j2_shoulder_pitch", "j3_shoulder_yaw", "j4_elbow_pitch"),
    *("j5_wrist_yaw", "j6_wrist_pitch", "j7_wrist_twist"),
)
"""Their names in the shipped file."""

MAX_MISALIGNMENT = 1e-3
"""By which an axis [rad] or its position [m] may be off."""


class ArmUrdf(NamedTuple):
    """A URDF that was read."""

    root: Element
    """Its `<robot>`, base, hand, joints and the links that they carry under the names of the shipped one."""
    joints: list[Element]
    """The seven joints from base to hand."""
    places: Array
    """Where they and the hand are at zero, in the base's frame [m], shape (8, 3)."""


def read_urdf(path: Path, arm: Arm) -> ArmUrdf:
    """Return the arm of a URDF.

    Links above the base are left out: how the arm is mounted is the scenario's to say.

    Raises
    ------
    InputError
        If the file cannot be used: the line names the link or joint and what is missing or wrong.
    """
    try:
        return _read(path, arm)
    except InputError as error:
        raise InputError(f"arm.urdf = {path}: {error}") from None


def _read(path: Path, arm: Arm) -> ArmUrdf:
    root = parse_urdf(path)
    links, parents = named(root, "link"), parent_joints(root)
    for what, name in (("base_frame", arm.base_frame), ("hand_frame", arm.hand_frame)):
        if name not in links:
            raise InputError(
                f"no link {name!r}; set arm.{what} to one of {', '.join(links) or 'its links: it has none'}"
            )
    chain = _chain(parents, arm)
    moving = [joint for joint in chain if joint.get("type") != "fixed"]
    _check_joints(moving, arm)
    _keep_below(root, arm.base_frame, parents)
    _check_nothing_else_moves(root, moving)
    for joint in moving:
        _check_limits(joint)
    carried = {link_of(joint.find("child")) for joint in moving}
    for link in root.findall("link"):
        check_inertia(link, must_be=link.get("name") in carried)
    places, R_BE = _checked_frames(chain)
    check_shapes(root)
    resolve_meshes(path, root)
    _replace_motors(root, moving)
    _rename(root, arm, moving, R_BE)
    return ArmUrdf(root, moving, places)


def _chain(parents: dict[str, Element], arm: Arm) -> list[Element]:
    """Return the joints from the base to the hand."""
    chain: list[Element] = []
    link = arm.hand_frame
    while link != arm.base_frame:
        if link not in parents or parents[link] in chain:
            raise InputError(
                f"no joints lead from {arm.base_frame!r} to {arm.hand_frame!r}; choose another arm.base_frame or arm.hand_frame"
            )
        chain.insert(0, parents[link])
        link = link_of(parents[link].find("parent"))
    return chain


def _check_joints(moving: list[Element], arm: Arm) -> None:
    names = [joint.get("name", "") for joint in moving]
    types = {joint.get("type", "") for joint in moving}
    if len(names) != len(AXES) or types != {"revolute"}:
        what = ", ".join(f"{joint.get('name')} ({joint.get('type')})" for joint in moving) or "none"
        raise InputError(
            f"{len(names)} joints move between {arm.base_frame!r} and {arm.hand_frame!r}: {what}; a WAM has 7 of type revolute, "
            "with limits"
        )
    if arm.joints is not None and names != list(arm.joints):
        raise InputError(
            f"its joints are, from base to hand, {', '.join(names)}, and arm.joints names {', '.join(arm.joints)}; name these, or "
            "leave arm.joints out"
        )


def _keep_below(root: Element, base: str, parents: dict[str, Element]) -> None:
    """Remove the links that do not hang on the base, and the joints that lead to them and to the base."""
    kept, found = {base}, True
    while found:
        new = {child for child, joint in parents.items() if link_of(joint.find("parent")) in kept} - kept
        kept, found = kept | new, bool(new)
    for link in root.findall("link"):
        if link.get("name") not in kept:
            root.remove(link)
    for child, joint in parents.items():
        if child not in kept or child == base:
            root.remove(joint)


def _check_nothing_else_moves(root: Element, moving: list[Element]) -> None:
    others = [
        joint.get("name", "") for joint in root.findall("joint") if joint.get("type") != "fixed" and joint not in moving
    ]
    if others:
        raise InputError(f'beside the arm\'s joints {", ".join(others)} move; make them type="fixed"')


def _check_limits(joint: Element) -> None:
    name, limit, dynamics = joint.get("name"), joint.find("limit"), joint.find("dynamics")
    lower, upper, effort, velocity = (number(limit, key) for key in ("lower", "upper", "effort", "velocity"))
    if not (lower < upper and effort > 0 and velocity > 0):
        raise InputError(
            f"joint {name!r} has limits that cannot be used: lower {lower:g}, upper {upper:g}, effort {effort:g}, velocity "
            f"{velocity:g}; give it <limit lower= upper= effort= velocity=/> in rad, N m and rad/s"
        )
    for key in ("damping", "friction"):
        value = number(dynamics, key)
        if not value >= 0:
            what = f"the {key} {value:g}" if value < 0 else f"no {key}"
            raise InputError(
                f"joint {name!r} has {what}; give it <dynamics damping= friction=/> in N m s/rad and N m, 0 if it has none"
            )


def _checked_frames(chain: list[Element]) -> tuple[Array, Array]:
    """Return where joints and hand are at zero, in the base's frame, shape (8, 3), and R_BE, if all is arranged as the WAM's."""
    R, p, points = np.eye(3), np.zeros(3), []
    axes = iter(AXES)
    for joint in chain:
        origin = joint.find("origin")
        p = p + R @ numbers(origin, "xyz")
        R = R @ rotation(numbers(origin, "rpy"))
        if joint.get("type") == "fixed":
            continue
        points.append(p)
        axis = R @ numbers(joint.find("axis"), "xyz", "1 0 0")
        wanted = np.eye(3)["xyz".index(next(axes))]
        if not np.linalg.norm(axis - np.linalg.norm(axis) * wanted) < MAX_MISALIGNMENT * np.linalg.norm(axis):
            raise InputError(
                f"at zero joint {joint.get('name')!r} turns about {_vector(axis)} of the base, a WAM's about {_vector(wanted)}; "
                "correct its <origin rpy=/> or <axis xyz=/>"
            )
    places = np.array([*points, p])
    for what, offsets in (
        ("joints 1 to 3 must be on the z axis", places[:3, :2]),
        ("joints 4 to 7 and the hand must be in the plane y = 0", places[3:, 1]),
    ):
        off = np.max(np.abs(offsets))
        if off > MAX_MISALIGNMENT:
            raise InputError(f"at zero {what} of the base, they are off by {off:.3g} m; correct an <origin xyz=/>")
    if not np.all(np.linalg.norm(np.diff(places[[1, 3, 7]], axis=0), axis=1) > 0.01):
        raise InputError("upper arm or forearm has no length; correct an <origin xyz=/>")
    return places, R


def _vector(values: Array) -> str:
    return f"({', '.join(f'{round(value, 3) + 0:g}' for value in values)})"


def _replace_motors(root: Element, moving: list[Element]) -> None:
    """Put one transmission for each joint, in their order, in place of the file's."""
    old = root.findall("transmission")
    for transmission in old:
        root.remove(transmission)
    for joint in moving:
        name = joint.get("name", "")
        own = [one for one in old if any(driven.get("name") == name for driven in one.findall("joint"))]
        if len(own) > 1:
            raise InputError(f"joint {name!r} has {len(own)} transmissions; keep one")
        transmission = ET.SubElement(root, "transmission", name=f"{name}_motor")
        ET.SubElement(transmission, "type").text = "transmission_interface/SimpleTransmission"
        ET.SubElement(transmission, "joint", name=name)
        actuator = ET.SubElement(transmission, "actuator", name=f"{name}_motor")
        for key, may_be_zero in (("rotor_inertia", True), ("gear_ratio", False)):
            given = own[0].find(f"actuator/{DRAKE}{key}") if own else None
            value = number(given, "value")
            if given is None or not (value > 0 or (may_be_zero and value == 0)):
                raise InputError(
                    f"joint {name!r} has no {key} of its motor; give it a <transmission> whose <actuator> has <drake:rotor_inertia "
                    "value=/> in kg m^2 and <drake:gear_ratio value=/>"
                )
            actuator.append(given)


def _rename(root: Element, arm: Arm, moving: list[Element], R_BE: Array) -> None:
    """Give all that is named in the shipped arm the same names; a hand that moves or is turned gets a tool plate."""
    root.set("name", "wam7")
    joints = {joint.get("name", ""): name for joint, name in zip(moving, JOINTS, strict=True)}
    for joint in root.findall("joint"):
        name = joint.get("name", "")
        joint.set("name", joints.get(name, f"fixed_{name}" if name in JOINTS else name))
    for joint in root.iterfind("transmission/joint"):
        joint.set("name", joints[joint.get("name", "")])
    links = {link_of(joint.find("child")): f"link{i}" for i, joint in enumerate(moving, 1)} | {arm.base_frame: "base"}
    is_hand = arm.hand_frame not in links and bool(np.allclose(R_BE, np.eye(3), rtol=0, atol=1e-12))
    if is_hand:
        links[arm.hand_frame] = "tool_plate"

    def new_name(name: str) -> str:
        return links.get(name, f"fixed_{name}")

    for link in root.findall("link"):
        link.set("name", new_name(link.get("name", "")))
    for end in (*root.iterfind("joint/parent"), *root.iterfind("joint/child")):
        end.set("link", new_name(link_of(end)))
    if not is_hand:
        ET.SubElement(root, "link", name="tool_plate")
        joint = ET.SubElement(root, "joint", name="tool_plate_fixed", type="fixed")
        ET.SubElement(joint, "parent", link=new_name(arm.hand_frame))
        ET.SubElement(joint, "child", link="tool_plate")
        ET.SubElement(joint, "origin", rpy=" ".join(repr(float(angle)) for angle in rpy_of(R_BE.T)))
