"""The arm's model: what a scenario makes of a URDF, and what of it is needed without Drake."""

from __future__ import annotations

import os
from dataclasses import dataclass
from functools import cache, lru_cache
from pathlib import Path
from xml.etree import ElementTree as ET

import numpy as np

from wam_cast.arm.arm_urdf import ArmUrdf, read_urdf
from wam_cast.arm.urdf_file import DRAKE, MOMENTS, Element, number
from wam_cast.scenario_parts import Arm
from wam_cast.types import Array

WALL_BEARING = 0.02
"""How far from the line ahead of it [rad] a wall-mounted arm casts: it cannot turn about the vertical, but the hand goes aside."""


@dataclass(frozen=True, eq=False)
class ArmModel:
    """An arm as it is simulated.

    Attributes
    ----------
    urdf
        Its URDF under the names of the shipped arm, scaled as the scenario says, every mesh with its absolute path.
    physical_urdf
        The model file's URDF without what is only for the eye, in canonical form: what landings depend on.
    coulomb_friction
        Of the joints [N m], shape (7,), as the model file says, which Drake's parser does not read.
    bearing_limits
        The smallest and the largest bearing [rad] to which the mounted arm turns.
    joint_1_turn
        By what joint 1 turns for a bearing of one radian [rad].
    shoulder_height
        At which the axes of joints 1 to 3 meet, above the floor [m].
    shoulder_radius
        Distance of that point from the world's z axis [m].
    stretched_length
        From there to the hand of the stretched arm [m].
    """

    urdf: str
    physical_urdf: str
    coulomb_friction: Array
    bearing_limits: tuple[float, float]
    joint_1_turn: float
    shoulder_height: float
    shoulder_radius: float
    stretched_length: float


@cache
def models_directory() -> Path:
    """Return the folder of the robot's models: inside the package once installed, beside it in a checkout."""
    installed = Path(__file__).parents[1] / "models"
    return installed if installed.is_dir() else installed.parents[1] / "models"


def arm_model(arm: Arm) -> ArmModel:
    """Return the model of a scenario's arm. Raises `.InputError` if its URDF cannot be used."""
    path = models_directory() / "wam7.urdf" if arm.urdf is None else Path(arm.urdf)
    changed = path.stat().st_mtime_ns if os.path.isfile(path) else None  # noqa: PTH113 -- of any name
    return _arm_model(path, changed, arm)


@lru_cache(maxsize=32)
def _arm_model(path: Path, _changed: int | None, arm: Arm) -> ArmModel:
    urdf = read_urdf(path, arm)
    physical = _physical(urdf.root)
    friction = np.array([number(joint.find("dynamics"), "friction") for joint in urdf.joints])
    friction.setflags(write=False)  # it is shared
    limit = urdf.joints[0].find("limit")
    turn = {"ceiling": -1.0, "floor": 1.0, "wall": 0.0}[arm.mount]
    stops = sorted(turn * number(limit, key) for key in ("lower", "upper")) if turn else (-WALL_BEARING, WALL_BEARING)
    depth, hand = urdf.places[1, 2], urdf.places[-1]
    radius, height = {"ceiling": (0.0, -depth), "floor": (0.0, depth), "wall": (depth, 0.0)}[arm.mount]
    _scale(urdf, arm)
    return ArmModel(
        urdf=ET.tostring(urdf.root, encoding="unicode"),
        physical_urdf=physical,
        coulomb_friction=friction,
        bearing_limits=(float(stops[0]), float(stops[1])),
        joint_1_turn=turn,
        shoulder_height=float(arm.mount_height + height),
        shoulder_radius=float(radius),
        stretched_length=float(np.linalg.norm(hand - urdf.places[1])),
    )


def _physical(root: Element) -> str:
    """Return the canonical form of a URDF without what is only for the eye."""
    bare = ET.fromstring(ET.tostring(root))
    for link in bare.iter("link"):
        for visual in link.findall("visual"):
            link.remove(visual)
    for material in bare.findall("material"):
        bare.remove(material)
    return ET.canonicalize(ET.tostring(bare, encoding="unicode"), strip_text=True)


def _scale(urdf: ArmUrdf, arm: Arm) -> None:
    """Scale what the scenario says of friction, masses, inertias, rotors and torques."""
    for i, joint in enumerate(urdf.joints):
        _multiply(_part(joint, "dynamics"), ("damping",), arm.viscous_friction_scale[i])
        _multiply(_part(joint, "limit"), ("effort",), arm.torque_scale[i])
        inertial = _part(urdf.root, f"link[@name='link{i + 1}']/inertial")
        _multiply(_part(inertial, "mass"), ("value",), arm.mass_scale[i])
        _multiply(_part(inertial, "inertia"), MOMENTS, arm.mass_scale[i] * arm.inertia_scale[i])
        motor = _part(urdf.root, f"transmission/joint[@name='{joint.get('name')}']/../actuator/{DRAKE}rotor_inertia")
        _multiply(motor, ("value",), arm.rotor_inertia_scale[i])


def _part(owner: Element, path: str) -> Element:
    """Return an element that `read_urdf` has seen to."""
    found = owner.find(path)
    assert found is not None
    return found


def _multiply(element: Element, attributes: tuple[str, ...], factor: float) -> None:
    if factor != 1:
        for attribute in attributes:
            element.set(attribute, repr(factor * float(element.attrib[attribute])))
