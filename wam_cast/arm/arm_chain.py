"""The arm as a chain of seven bodies, by its numbers: what its URDF says of joints, links and motors, without Drake."""

from __future__ import annotations

from functools import lru_cache
from typing import NamedTuple
from xml.etree import ElementTree as ET

import numpy as np

from wam_cast.arm.arm_model import arm_model
from wam_cast.arm.arm_urdf import JOINTS
from wam_cast.arm.urdf_file import DRAKE, MOMENTS, Element, link_of, number, numbers, rotation
from wam_cast.scenario_parts import Arm
from wam_cast.types import Array


class ArmChain(NamedTuple):
    """Frame i, from 1 to 7, is fixed to link i, at its joint, which turns it about its z axis; frame 0 is the base's.

    Attributes
    ----------
    R, p
        Pose of frame i in frame i - 1 at zero: (8, 3, 3) and (8, 3) [m]; the last one is the hand's, in frame 7.
    mass, moment, inertia
        Of the links, with all that is fixed to them: [kg], (7,); mass times the centre's place in frame i [kg m], (7, 3); about
        that frame's origin, in its axes [kg m^2], (7, 3, 3).
    rotor_inertia
        Of the motors, as the joints feel it [kg m^2], (7,).
    damping
        Viscous, of the joints [N m s], (7,).
    coulomb_friction
        Of the joints, of which `Arm.coulomb_friction` says how much acts [N m], (7,).
    gear_ratio
        Of the motors, (7,).
    torque_limits, velocity_limits, lower, upper
        Of the joints [N m], [rad/s], [rad], (7,) each.
    """

    R: Array
    p: Array
    mass: Array
    moment: Array
    inertia: Array
    rotor_inertia: Array
    damping: Array
    coulomb_friction: Array
    gear_ratio: Array
    torque_limits: Array
    velocity_limits: Array
    lower: Array
    upper: Array


@lru_cache(maxsize=32)
def arm_chain(arm: Arm) -> ArmChain:
    """Return the chain of a scenario's arm, whose numbers are scaled as the scenario says. Raises `.InputError` as `.arm_model`."""
    model = arm_model(arm)
    root = ET.fromstring(model.urdf)
    by_name = {joint.get("name"): joint for joint in root.findall("joint")}
    joints = [by_name[name] for name in JOINTS]
    above = {link_of(joint.find("child")): joint for joint in root.findall("joint")}
    frames = [_place(f"link{i + 1}", above) for i in range(7)]
    turned = [
        R @ _z_onto(numbers(joint.find("axis"), "xyz", "1 0 0"))
        for (_, R, _), joint in zip(frames, joints, strict=True)
    ]
    R_hand, p_hand = _pose_in("link7", "tool_plate", above)
    axis_7 = _z_onto(numbers(joints[6].find("axis"), "xyz", "1 0 0"))
    before = [np.eye(3), *(_z_onto(numbers(joint.find("axis"), "xyz", "1 0 0")) for joint in joints[:-1])]
    R = np.array([*(b.T @ t for b, t in zip(before, turned, strict=True)), axis_7.T @ R_hand])
    p = np.array([*(b.T @ p for b, (_, _, p) in zip(before, frames, strict=True)), axis_7.T @ p_hand])
    bodies = [
        _body(root, f"link{i + 1}", above, _z_onto(numbers(joint.find("axis"), "xyz", "1 0 0")))
        for i, joint in enumerate(joints)
    ]
    motors = [root.find(f"transmission/joint[@name='{name}']/../actuator") for name in JOINTS]
    gear = np.array([number(motor.find(f"{DRAKE}gear_ratio"), "value") for motor in motors])
    rotor = np.array([number(motor.find(f"{DRAKE}rotor_inertia"), "value") for motor in motors])
    limits = {
        key: np.array([number(joint.find("limit"), key) for joint in joints])
        for key in ("effort", "velocity", "lower", "upper")
    }
    chain = ArmChain(
        R=R,
        p=p,
        mass=np.array([mass for mass, _, _ in bodies]),
        moment=np.array([moment for _, moment, _ in bodies]),
        inertia=np.array([inertia for _, _, inertia in bodies]),
        rotor_inertia=rotor * gear**2,
        damping=np.array([number(joint.find("dynamics"), "damping") for joint in joints]),
        coulomb_friction=model.coulomb_friction,
        gear_ratio=gear,
        torque_limits=limits["effort"],
        velocity_limits=limits["velocity"],
        lower=limits["lower"],
        upper=limits["upper"],
    )
    for values in chain:
        values.setflags(write=False)  # they are shared
    return chain


def _z_onto(axis: Array) -> Array:
    """Return a rotation that takes z onto `axis`, (3,)."""
    z = axis / np.linalg.norm(axis)
    x = np.cross([0.0, 1.0, 0.0] if abs(z[1]) < 0.9 else [0.0, 0.0, 1.0], z)
    x /= np.linalg.norm(x)
    return np.column_stack([x, np.cross(z, x), z])


def _place(link: str, above: dict[str, Element]) -> tuple[str, Array, Array]:
    """Return the moving link (or the base) that `link` hangs on, and its joint's frame there, R (3, 3) and p (3,), at zero."""
    R, p = np.eye(3), np.zeros(3)
    while True:
        joint = above[link]
        R_joint = rotation(numbers(joint.find("origin"), "rpy"))
        R, p = R_joint @ R, numbers(joint.find("origin"), "xyz") + R_joint @ p
        link = link_of(joint.find("parent"))
        if link == "base" or above[link].get("name") in JOINTS:
            return link, R, p


def _pose_in(link: str, fixed: str, above: dict[str, Element]) -> tuple[Array, Array]:
    """Return the pose of a link that is fixed to `link` in its frame, R (3, 3) and p (3,)."""
    R, p = np.eye(3), np.zeros(3)
    while fixed != link:
        joint = above[fixed]
        R_joint = rotation(numbers(joint.find("origin"), "rpy"))
        R, p = R_joint @ R, numbers(joint.find("origin"), "xyz") + R_joint @ p
        fixed = link_of(joint.find("parent"))
    return R, p


def _body(root: Element, link: str, above: dict[str, Element], R_frame: Array) -> tuple[float, Array, Array]:
    """Return mass, moment (3,) and inertia (3, 3) of a link and all that is fixed to it, in its frame turned by `R_frame`."""
    mass, moment, inertia = 0.0, np.zeros(3), np.zeros((3, 3))
    for part in root.findall("link"):
        name, inertial = part.get("name", ""), part.find("inertial")
        if inertial is None or _carrier(name, above) != link:
            continue
        R, p = _pose_in(link, name, above)
        R_i = R @ rotation(numbers(inertial.find("origin"), "rpy"))
        c = p + R @ numbers(inertial.find("origin"), "xyz")
        xx, xy, xz, yy, yz, zz = (number(inertial.find("inertia"), key) for key in MOMENTS)
        m = number(inertial.find("mass"), "value")
        I_own = R_i @ np.array([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]]) @ R_i.T
        mass, moment = mass + m, moment + m * c
        inertia = inertia + I_own + m * (c @ c * np.eye(3) - np.outer(c, c))
    return mass, R_frame.T @ moment, R_frame.T @ inertia @ R_frame


def _carrier(link: str, above: dict[str, Element]) -> str:
    """Return the moving link that `link` is or is fixed to, or the base."""
    while link != "base" and above[link].get("name") not in JOINTS:
        link = link_of(above[link].find("parent"))
    return link
