"""A URDF file's elements, whatever robot it is of: read, cleared of what is not used, and checked."""

from __future__ import annotations

import os
from collections import Counter
from pathlib import Path
from typing import TypeAlias
from xml.etree import ElementTree as ET

import numpy as np

from wam_cast.errors import InputError
from wam_cast.text_file import read_bytes
from wam_cast.types import Array

Element: TypeAlias = ET.Element

LARGEST_URDF = 10_000_000
"""Bytes."""

MOST_PARTS = 10_000
"""More links, joints and other parts than any robot has."""

MOST_NESTED = 20
"""A URDF's elements are 5 deep."""

DRAKE = "{https://drake.mit.edu}"
ET.register_namespace("drake", "https://drake.mit.edu")  # Drake's parser goes by the prefix
MESH_FORMATS = (".obj", ".gltf", ".vtk")
"""That Drake draws."""

SHAPES = {
    "box": ("size",),
    "sphere": ("radius",),
    "cylinder": ("radius", "length"),
    "capsule": ("radius", "length"),
    "mesh": (),
}
"""What can be drawn, and which numbers each shape needs."""

MOMENTS = ("ixx", "ixy", "ixz", "iyy", "iyz", "izz")
NUMBERS = {"xyz": 3, "rpy": 3, "rgba": 4, "scale": 3, "size": 3} | dict.fromkeys(
    ("value", *MOMENTS, "lower", "upper", "effort", "velocity", "damping", "friction", "radius", "length"), 1
)
"""Attributes that hold numbers, and how many."""

PARTS = {
    "link": ("inertial", "visual"),
    "joint": ("parent", "child", "origin", "axis", "limit", "dynamics"),
    "transmission": ("joint", "actuator"),
    "material": ("color", "texture"),
}
"""What is used of a URDF. Collision is not: the arm collides with nothing. Mimics, loops and notes of other programs are not."""


def parse_urdf(path: Path) -> Element:
    """Return the `<robot>` of a file, of `PARTS` alone, with all its numbers valid. Raises `.InputError` if it is no URDF."""
    try:
        root = ET.fromstring(read_bytes(path, LARGEST_URDF))
    except OSError as error:
        raise InputError(f"{(error.strerror or str(error)).lower()}; name a URDF file that can be read") from None
    except (ET.ParseError, ValueError, LookupError) as error:
        raise InputError(f"is not XML ({error}); name a URDF file") from None
    if root.tag != "robot":
        raise InputError(f"has a <{root.tag}> where a URDF has its <robot>; name a URDF file")
    if len(root) > MOST_PARTS:
        raise InputError(f"has {len(root)} parts, {MOST_PARTS} at most can be read; name the URDF of one arm")
    level = list(root)
    for _ in range(MOST_NESTED):
        level = [element for one in level for element in one]
    if level:
        raise InputError(f"has elements within elements, more than {MOST_NESTED} deep; name a URDF file")
    if any("xacro" in element.tag for element in root.iter()):
        raise InputError("is a xacro file; name what it makes: xacro FILE > arm.urdf")
    for element in root.iter():  # files name Drake's namespace by one address or another
        namespace, _, name = element.tag.rpartition("}")
        if "drake.mit.edu" in namespace:
            element.tag = f"{DRAKE}{name}"
    _keep_what_counts(root)
    return root


def _keep_what_counts(root: Element) -> None:
    """Remove what is not read, and check that all numbers are numbers."""
    root[:] = [part for part in root if part.tag in PARTS]
    for part in root:
        part[:] = [element for element in part if element.tag in PARTS[part.tag]]
    for part in root:
        for element in part.iter():
            for attribute in NUMBERS.keys() & element.attrib.keys():
                if _count_numbers(element.attrib[attribute]) != NUMBERS[attribute]:
                    raise InputError(
                        f"{part.tag} {part.get('name')!r} has <{element.tag.removeprefix(DRAKE)} {attribute}="
                        f'"{element.attrib[attribute]}"/>; give {NUMBERS[attribute]} finite number(s)'
                    )


def _count_numbers(text: str) -> int:
    """Return how many finite numbers a text holds, -1 if it holds anything else."""
    try:
        values = [float(word) for word in text.split()]
    except ValueError:
        return -1
    return len(values) if np.all(np.isfinite(values)) else -1


def numbers(element: Element | None, attribute: str, default: str = "0 0 0") -> Array:
    """Return the numbers in an element's attribute, or the default's if there is none."""
    text = default if element is None else element.get(attribute, default)
    return np.array([float(number) for number in text.split()])


def number(element: Element | None, attribute: str) -> float:
    """Return the number in an element's attribute, nan if there is none."""
    return float(numbers(element, attribute, "nan")[0])


def link_of(end: Element | None) -> str:
    """Return the link that a `<parent>` or `<child>` names, or an empty text."""
    return "" if end is None else end.get("link", "")


def named(root: Element, tag: str) -> dict[str, Element]:
    """Return the links or the joints by name."""
    elements = {element.get("name", ""): element for element in root.findall(tag)}
    for name, count in Counter(element.get("name", "") for element in root.findall(tag)).items():
        if count > 1 or not name:
            raise InputError(f"{count} {tag}s are named {name!r}; give each a name of its own")
    return elements


def parent_joints(root: Element) -> dict[str, Element]:
    """Return the joint that each link hangs on, by the link's name."""
    links, parents = named(root, "link"), dict[str, Element]()
    for name, joint in named(root, "joint").items():
        for end in ("parent", "child"):
            link = link_of(joint.find(end))
            if link not in links:
                raise InputError(
                    f"joint {name!r} has the {end} link {link!r}, which is not there; correct <{end} link=/>"
                )
        child = link_of(joint.find("child"))
        if child in parents:
            raise InputError(
                f"link {child!r} is the child of two joints, {parents[child].get('name')!r} and {name!r}; remove one"
            )
        parents[child] = joint
    return parents


def check_inertia(link: Element, *, must_be: bool) -> None:
    """Raise `.InputError` if a body cannot have the link's inertia, or it has none where it must."""
    name, inertial = link.get("name"), link.find("inertial")
    if inertial is None:
        if must_be:
            raise InputError(f"link {name!r} has no <inertial>; give it its mass, centre of mass and inertia")
        return
    mass, inertia = number(inertial.find("mass"), "value"), inertial.find("inertia")
    xx, xy, xz, yy, yz, zz = (number(inertia, key) for key in MOMENTS)
    I_BBcm = np.array([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]])
    if not must_be and mass == 0 and not np.any(I_BBcm):
        return
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


def rotation(rpy: Array) -> Array:
    """Return the rotation matrix of URDF's roll, pitch and yaw [rad]."""
    (cr, cp, cy), (sr, sp, sy) = np.cos(rpy), np.sin(rpy)
    Rx = np.array([[1, 0, 0], [0, cr, -sr], [0, sr, cr]])
    Ry = np.array([[cp, 0, sp], [0, 1, 0], [-sp, 0, cp]])
    Rz = np.array([[cy, -sy, 0], [sy, cy, 0], [0, 0, 1]])
    return np.asarray(Rz @ Ry @ Rx)


def rpy_of(R: Array) -> Array:
    """Return roll, pitch and yaw [rad] of a rotation matrix."""
    pitch = np.arctan2(-R[2, 0], np.hypot(R[0, 0], R[1, 0]))
    if np.hypot(R[0, 0], R[1, 0]) < 1e-6:  # roll and yaw turn about the same axis
        return np.array([0.0, pitch, np.arctan2(-R[0, 1], R[1, 1])])
    return np.array([np.arctan2(R[2, 1], R[2, 2]), pitch, np.arctan2(R[1, 0], R[0, 0])])


def check_shapes(root: Element) -> None:
    """Raise `.InputError` if a link is drawn with a shape that Drake cannot draw."""
    for link in root.findall("link"):
        for geometry in link.iterfind("visual/geometry"):
            shapes = [shape for shape in geometry if shape.tag in SHAPES]
            if len(shapes) != 1:
                raise InputError(
                    f"link {link.get('name')!r}: a <geometry> has {len(shapes)} shapes; give it one of {', '.join(SHAPES)}"
                )
            (shape,) = shapes
            for name in SHAPES[shape.tag]:
                if not all(float(size) > 0 for size in shape.get(name, "0").split()):
                    what = f"<{shape.tag} {name}={shape.get(name)!r}>"
                    raise InputError(f"link {link.get('name')!r}: {what} cannot be drawn; give positive numbers [m]")


def resolve_meshes(path: Path, root: Element) -> None:
    """Give the meshes their absolute place."""
    for link in root.findall("link"):
        for mesh in link.iterfind("visual/geometry/mesh"):
            name = mesh.get("filename", "")
            found = _mesh_file(path, name)
            is_there = os.path.isfile(found)  # noqa: PTH113 -- of any name
            if not is_there or found.suffix.lower() not in MESH_FORMATS:
                raise InputError(
                    f"link {link.get('name')!r} is drawn with the mesh {name!r}, which "
                    f"{'is of no format that can be drawn' if is_there else 'is not there'}; put a file "
                    f"({', '.join(MESH_FORMATS)}) at {found}, or remove the <visual>"
                )
            mesh.set("filename", f"file://{found.resolve()}")


def _mesh_file(path: Path, name: str) -> Path:
    """Return where a mesh should be: beside the URDF, or in a package that the URDF is in or that is beside it."""
    if not name.startswith("package://"):
        return path.parent / name.removeprefix("file://")
    package, _, rest = name.removeprefix("package://").partition("/")
    around = next((folder for folder in path.absolute().parents if folder.name == package), None)
    return path.parent / package / rest if around is None else around / rest
