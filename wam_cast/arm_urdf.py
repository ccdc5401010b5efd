"""Reading an arm's URDF: any arm of seven revolute joints that are arranged as the WAM's, under the names of the shipped one.

Frames are parallel to the base's at zero, where the joints turn about z, y, z, y, z, y, z; the axes of the first three meet in the
shoulder, and everything else lies in the plane y = 0.
"""

from __future__ import annotations

from pathlib import Path
from typing import NamedTuple, TypeAlias
from xml.etree import ElementTree as ET

import numpy as np

from wam_cast.errors import InputError
from wam_cast.scenario_parts import Arm
from wam_cast.types import Array

Element: TypeAlias = ET.Element

DRAKE = "{https://drake.mit.edu}"
ET.register_namespace("drake", "https://drake.mit.edu")  # Drake's parser goes by the prefix
AXES = "zyzyzyz"
"""About which the joints turn at zero."""

MAX_MISALIGNMENT = 1e-3
"""By which an axis [rad] or its position [m] may be off."""

MESH_FORMATS = (".obj", ".gltf", ".vtk")
"""That Drake draws."""


class ArmUrdf(NamedTuple):
    """A URDF that was read."""

    root: Element
    """Its `<robot>`, base, hand and links under the names of the shipped one."""
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
    root = _parse(path)
    links = {link.get("name", ""): link for link in root.findall("link")}
    for what, name in (("base_frame", arm.base_frame), ("hand_frame", arm.hand_frame)):
        if name not in links:
            raise InputError(
                f"arm.{what}: {path} has no link {name!r}; choose one of {', '.join(links) or 'none: it has no links'}"
            )
    parents = {_end(path, joint, "child"): joint for joint in root.findall("joint")}
    chain = _chain(path, parents, arm)
    moving = [joint for joint in chain if joint.get("type") != "fixed"]
    _check_joints(path, moving, arm)
    _keep_below(root, arm.base_frame, parents)
    _check_nothing_else_moves(path, root, moving)
    for joint in moving:
        _check_numbers(path, root, joint, links[_end(path, joint, "child")])
    places = _checked_places(path, chain)
    _resolve_meshes(path, root)
    _rename(root, arm, moving)
    return ArmUrdf(root, moving, places)


def _numbers(element: Element | None, attribute: str, default: str = "0 0 0") -> Array:
    """Return the numbers in an element's attribute, or the default's if there is none."""
    text = default if element is None else element.get(attribute, default)
    return np.array([float(number) for number in text.split()])


def _parse(path: Path) -> Element:
    try:
        root = ET.fromstring(path.read_bytes())
    except OSError as error:
        raise InputError(f"arm.urdf: {path}: {(error.strerror or str(error)).lower()}; name a URDF file") from None
    except ET.ParseError as error:
        raise InputError(f"arm.urdf: {path} is not XML ({error}); name a URDF file, a xacro's result") from None
    if root.tag != "robot":
        raise InputError(f"arm.urdf: {path} has a <{root.tag}> where a URDF has its <robot>; name a URDF file")
    for element in root.iter():  # files name Drake's namespace by one address or another
        namespace, _, name = element.tag.rpartition("}")
        if "drake.mit.edu" in namespace:
            element.tag = f"{DRAKE}{name}"
    return root


def _end(path: Path, joint: Element, which: str) -> str:
    end = joint.find(which)
    name = None if end is None else end.get("link")
    if name is None:
        raise InputError(
            f"arm.urdf: {path}: joint {joint.get('name')!r} names no {which} link; add <{which} link=.../>"
        )
    return name


def _chain(path: Path, parents: dict[str, Element], arm: Arm) -> list[Element]:
    """Return the joints from the base to the hand."""
    chain: list[Element] = []
    link = arm.hand_frame
    while link != arm.base_frame:
        if link not in parents or parents[link] in chain:
            raise InputError(
                f"arm.hand_frame: in {path} no joints lead from {arm.base_frame!r} to {arm.hand_frame!r}; choose another "
                "arm.base_frame or arm.hand_frame"
            )
        chain.insert(0, parents[link])
        link = _end(path, parents[link], "parent")
    return chain


def _check_joints(path: Path, moving: list[Element], arm: Arm) -> None:
    names = [joint.get("name", "") for joint in moving]
    types = {joint.get("type", "") for joint in moving}
    if len(names) != 7 or types != {"revolute"}:
        what = ", ".join(f"{joint.get('name')} ({joint.get('type')})" for joint in moving) or "none"
        raise InputError(
            f"arm.urdf: {path} has {len(names)} moving joints between {arm.base_frame!r} and {arm.hand_frame!r}: {what}; "
            "a WAM has 7 revolute ones"
        )
    if arm.joints is not None and names != list(arm.joints):
        raise InputError(
            f"arm.joints = {', '.join(arm.joints)}: {path} has, from base to hand, {', '.join(names)}; name these or none"
        )


def _keep_below(root: Element, base: str, parents: dict[str, Element]) -> None:
    """Remove the links that do not hang on the base, and the joints that lead to them."""
    kept, found = {base}, True
    while found:
        new = {child for child, joint in parents.items() if _link_of(joint.find("parent")) in kept} - kept
        kept, found = kept | new, bool(new)
    for link in root.findall("link"):
        if link.get("name") not in kept:
            root.remove(link)
    for joint in root.findall("joint"):
        if _link_of(joint.find("parent")) not in kept:
            root.remove(joint)
    joints = {joint.get("name") for joint in root.findall("joint")}
    for transmission in root.findall("transmission"):
        if not {joint.get("name") for joint in transmission.findall("joint")} <= joints:
            root.remove(transmission)


def _check_nothing_else_moves(path: Path, root: Element, moving: list[Element]) -> None:
    others = [
        joint.get("name", "") for joint in root.findall("joint") if joint.get("type") != "fixed" and joint not in moving
    ]
    if others:
        raise InputError(f'arm.urdf: {path}: beside the arm\'s joints {", ".join(others)} move; make them type="fixed"')


def _check_numbers(path: Path, root: Element, joint: Element, link: Element) -> None:
    """Check that a joint has all that a simulation needs, and the link that it carries."""
    name = joint.get("name", "")
    try:
        _check_limits(joint)
        _check_actuator(root, name)
        _check_inertia(link)
    except InputError as error:
        raise InputError(f"arm.urdf: {path}: {error}") from None
    except (TypeError, ValueError) as error:
        raise InputError(
            f"arm.urdf: {path}: joint {name!r} or its link {link.get('name')!r}: {error}; correct it"
        ) from None


def _attribute(element: Element | None, attribute: str) -> float:
    """Return a number, nan if there is none."""
    return float("nan" if element is None else element.get(attribute, "nan"))


def _check_limits(joint: Element) -> None:
    name, limit, dynamics = joint.get("name"), joint.find("limit"), joint.find("dynamics")
    lower, upper, effort, velocity = (_attribute(limit, key) for key in ("lower", "upper", "effort", "velocity"))
    if not (lower < upper and effort > 0 and velocity > 0):
        raise InputError(
            f"joint {name!r} has limits that cannot be used: lower {lower:g}, upper {upper:g}, effort {effort:g}, velocity "
            f"{velocity:g}; give it <limit lower= upper= effort= velocity=/> in rad, N m and rad/s"
        )
    for key in ("damping", "friction"):
        if not _attribute(dynamics, key) >= 0:
            raise InputError(
                f"joint {name!r} has no {key}; give it <dynamics damping= friction=/> in N m s/rad and N m, 0 if it has none"
            )


def _check_actuator(root: Element, name: str) -> None:
    actuator = next(
        (
            one.find("actuator")
            for one in root.findall("transmission")
            if one.find(f"joint[@name='{name}']") is not None
        ),
        None,
    )
    for key in ("rotor_inertia", "gear_ratio"):
        value = _attribute(None if actuator is None else actuator.find(f"{DRAKE}{key}"), "value")
        if not (value >= 0 and (key != "gear_ratio" or value > 0)):
            raise InputError(
                f"joint {name!r} has no {key} of its motor; give it a <transmission> whose <actuator> has "
                "<drake:rotor_inertia value=/> in kg m^2 and <drake:gear_ratio value=/>"
            )


def _check_inertia(link: Element) -> None:
    name, inertial = link.get("name"), link.find("inertial")
    if inertial is None:
        raise InputError(f"link {name!r} has no <inertial>; give it its mass, centre of mass and inertia")
    mass, inertia = _attribute(inertial.find("mass"), "value"), inertial.find("inertia")
    xx, xy, xz, yy, yz, zz = (_attribute(inertia, key) for key in ("ixx", "ixy", "ixz", "iyy", "iyz", "izz"))
    I_BBcm = np.array([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]])
    if not (mass > 0 and np.all(np.isfinite(I_BBcm))):
        raise InputError(
            f"link {name!r} has no mass and inertia that can be used; give it <mass value=/> and all six of <inertia/>"
        )
    least, middle, largest = np.linalg.eigvalsh(I_BBcm)
    if not (least > 0 and largest <= (least + middle) * (1 + 1e-6)):
        raise InputError(
            f"link {name!r} has an inertia that no body has: principal moments {least:.3g}, {middle:.3g}, {largest:.3g} kg m^2 "
            "must be positive, and none above the sum of the others; correct it (about the centre of mass)"
        )


def _checked_places(path: Path, chain: list[Element]) -> Array:
    """Return where joints and hand are at zero, in the base's frame, shape (8, 3), if axes and places are arranged as the WAM's."""
    R, p, points = np.eye(3), np.zeros(3), []
    axes = iter(AXES)
    for joint in chain:
        origin = joint.find("origin")
        p = p + R @ _numbers(origin, "xyz")
        R = R @ _rotation(_numbers(origin, "rpy"))
        if joint.get("type") == "fixed":
            continue
        points.append(p)
        axis = R @ _numbers(joint.find("axis"), "xyz", "1 0 0")
        wanted = np.eye(3)["xyz".index(next(axes))]
        if not np.linalg.norm(axis / np.linalg.norm(axis) - wanted) < MAX_MISALIGNMENT:
            raise InputError(
                f"arm.urdf: {path}: at zero joint {joint.get('name')!r} turns about {_vector(axis)} of the base, a WAM's about "
                f"{_vector(wanted)}; correct its <origin rpy=> or <axis xyz=>"
            )
    places = np.array([*points, p])
    for what, offsets in (
        ("joints 1 to 3 must be on the z axis", places[:3, :2]),
        ("joints 4 to 7 and the hand must be in the plane y = 0", places[3:, 1]),
    ):
        if np.max(np.abs(offsets)) > MAX_MISALIGNMENT:
            off = np.max(np.abs(offsets))
            raise InputError(
                f"arm.urdf: {path}: at zero {what} of the base, they are off by {off:.3g} m; correct an <origin xyz=>"
            )
    return places


def _vector(values: Array) -> str:
    return f"({', '.join(f'{round(value, 3) + 0:g}' for value in values)})"


def _rotation(rpy: Array) -> Array:
    """Return the rotation matrix of URDF's roll, pitch and yaw [rad]."""
    (cr, cp, cy), (sr, sp, sy) = np.cos(rpy), np.sin(rpy)
    Rx = np.array([[1, 0, 0], [0, cr, -sr], [0, sr, cr]])
    Ry = np.array([[cp, 0, sp], [0, 1, 0], [-sp, 0, cp]])
    Rz = np.array([[cy, -sy, 0], [sy, cy, 0], [0, 0, 1]])
    return np.asarray(Rz @ Ry @ Rx)


def _resolve_meshes(path: Path, root: Element) -> None:
    """Make the meshes' names absolute addresses, which Drake 1.51 wants of a URDF that is no file.

    Collision geometry goes, since the arm collides with nothing.
    """
    for link in root.findall("link"):
        for collision in link.findall("collision"):
            link.remove(collision)
        for mesh in link.iterfind("visual/geometry/mesh"):
            name = mesh.get("filename", "")
            found = path.parent / name.removeprefix("file://").removeprefix("package://")
            if not found.is_file() or found.suffix.lower() not in MESH_FORMATS:
                raise InputError(
                    f"arm.urdf: {path}: link {link.get('name')!r} is drawn with the mesh {name!r}, which "
                    f"{'is of no format that can be drawn' if found.is_file() else 'is not there'}; put a file "
                    f"({', '.join(MESH_FORMATS)}) at {found}, or remove the <visual>"
                )
            mesh.set("filename", f"file://{found.resolve()}")  # as it is: Drake decodes no %20


def _rename(root: Element, arm: Arm, moving: list[Element]) -> None:
    """Give the robot, its base and its hand, and the links that the joints carry the names of the shipped arm's."""
    names = {_link_of(joint.find("child")): f"link{i}" for i, joint in enumerate(moving, 1)} | {arm.base_frame: "base"}
    if arm.hand_frame in names:  # the last link itself
        ET.SubElement(root, "link", name="tool_plate")
        joint = ET.SubElement(root, "joint", name="tool_plate_fixed", type="fixed")
        ET.SubElement(joint, "parent", link=arm.hand_frame)
        ET.SubElement(joint, "child", link="tool_plate")
    names.setdefault(arm.hand_frame, "tool_plate")
    names["tool_plate"] = "tool_plate"
    root.set("name", "wam7")
    for link in root.findall("link"):
        link.set("name", names.get(link.get("name", ""), f"fixed_{link.get('name')}"))
    for end in (*root.iterfind("joint/parent"), *root.iterfind("joint/child")):
        end.set("link", names.get(_link_of(end), f"fixed_{_link_of(end)}"))


def _link_of(end: Element | None) -> str:
    return "" if end is None else end.get("link", "")
