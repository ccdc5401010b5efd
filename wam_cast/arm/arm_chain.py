"""The arm as a chain of seven bodies, by its numbers: what its URDF says of joints, links and motors, without Drake."""

from __future__ import annotations

from functools import lru_cache
from typing import NamedTuple
from xml.etree import ElementTree as ET

import numpy as np

from wam_cast.arm.arm_model import ArmModel, arm_model
from wam_cast.arm.arm_urdf import JOINTS
from wam_cast.arm.urdf_file import DRAKE, MOMENTS, Element, link_of, number, numbers, rotation
from wam_cast.scenario_parts import Arm
from wam_cast.types import Array

DIFFERENTIALS = ((1, 2), (4, 5))
"""Pairs of joints (from 0) that share two motors through a cable differential: 2 with 3, and 5 with 6."""

FRICTION_SPEED = 0.1
"""Joint speed [rad/s] from which Coulomb friction has its full size; below, it grows in proportion."""


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
        Of the joints, as much as acts [N m], (7,).
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


def arm_chain(arm: Arm) -> ArmChain:
    """Return the chain of a scenario's arm, whose numbers are scaled as the scenario says.

    Raises `.InputError` if its URDF cannot be used.
    """
    return _arm_chain(arm_model(arm), arm)


@lru_cache(maxsize=32)
def _arm_chain(model: ArmModel, arm: Arm) -> ArmChain:
    root = ET.fromstring(model.urdf)
    above = {link_of(joint.find("child")): joint for joint in root.findall("joint")}
    joints = [above[f"link{i}"] for i in range(1, 8)]
    # What turns a link's own frame to that of the chain.
    turns = [_z_onto(numbers(joint.find("axis"), "xyz", "1 0 0")) for joint in joints]
    poses = [_joint_pose(joint, above) for joint in joints] + [_pose_on_carrier("tool_plate", above)[1:]]
    before, after = [np.eye(3), *turns], [*turns, np.eye(3)]
    mass, moment, inertia = _bodies(root, above, turns)
    motors = {key: _of_motors(root, key) for key in ("rotor_inertia", "gear_ratio")}
    limits = {key: _of_joints(joints, "limit", key) for key in ("effort", "velocity", "lower", "upper")}
    chain = ArmChain(
        R=np.array([b.T @ R @ a for b, (R, _), a in zip(before, poses, after, strict=True)]),
        p=np.array([b.T @ p for b, (_, p) in zip(before, poses, strict=True)]),
        mass=mass,
        moment=moment,
        inertia=inertia,
        rotor_inertia=motors["rotor_inertia"] * motors["gear_ratio"] ** 2,
        damping=_of_joints(joints, "dynamics", "damping"),
        coulomb_friction=np.array(arm.coulomb_friction) * model.coulomb_friction,
        gear_ratio=motors["gear_ratio"],
        torque_limits=limits["effort"],
        velocity_limits=limits["velocity"],
        lower=limits["lower"],
        upper=limits["upper"],
    )
    for values in chain:
        values.setflags(write=False)  # they are shared
    return chain


def encoder_resolution(chain: ArmChain, counts: int) -> Array:
    """Return what one of a motor's `counts` in a revolution is at its joint [rad], (7,); zeros if there are none."""
    return 2 * np.pi / (counts * chain.gear_ratio) if counts else np.zeros(len(chain.gear_ratio))


def _of_joints(joints: list[Element], part: str, key: str) -> Array:
    return np.array([number(joint.find(part), key) for joint in joints])


def _of_motors(root: Element, key: str) -> Array:
    paths = (f"transmission/joint[@name='{name}']/../actuator/{DRAKE}{key}" for name in JOINTS)
    return np.array([number(root.find(path), "value") for path in paths])


def _z_onto(axis: Array) -> Array:
    """Return a rotation that takes z onto `axis`, (3,)."""
    z = axis / np.linalg.norm(axis)
    x = np.cross([0.0, 1.0, 0.0] if abs(z[1]) < 0.9 else [0.0, 0.0, 1.0], z)
    x /= np.linalg.norm(x)
    return np.column_stack([x, np.cross(z, x), z])


def _pose_on_carrier(link: str, above: dict[str, Element]) -> tuple[str, Array, Array]:
    """Return the moving link, or the base, that `link` is or is fixed to, and its pose there, R (3, 3) and p (3,) [m]."""
    R, p = np.eye(3), np.zeros(3)
    while link != "base" and above[link].get("name") not in JOINTS:
        joint = above[link]
        R_joint = rotation(numbers(joint.find("origin"), "rpy"))
        R, p = R_joint @ R, numbers(joint.find("origin"), "xyz") + R_joint @ p
        link = link_of(joint.find("parent"))
    return link, R, p


def _joint_pose(joint: Element, above: dict[str, Element]) -> tuple[Array, Array]:
    """Return the pose of a joint that moves in the frame of the link, or base, before, at zero, R (3, 3) and p (3,) [m]."""
    _, R, p = _pose_on_carrier(link_of(joint.find("parent")), above)
    origin = joint.find("origin")
    return R @ rotation(numbers(origin, "rpy")), p + R @ numbers(origin, "xyz")


def _bodies(root: Element, above: dict[str, Element], turns: list[Array]) -> tuple[Array, Array, Array]:
    """Return mass, moment and inertia of the links with all that is fixed to them: see `ArmChain`."""
    mass, moment, inertia = np.zeros(7), np.zeros((7, 3)), np.zeros((7, 3, 3))
    for part in root.findall("link"):
        carrier, R, p = _pose_on_carrier(part.get("name", ""), above)
        inertial = part.find("inertial")
        if inertial is None or carrier == "base":
            continue
        i = int(carrier.removeprefix("link")) - 1
        m, origin = number(inertial.find("mass"), "value"), inertial.find("origin")
        xx, xy, xz, yy, yz, zz = (number(inertial.find("inertia"), key) for key in MOMENTS)
        R_own = turns[i].T @ R @ rotation(numbers(origin, "rpy"))
        c = turns[i].T @ (p + R @ numbers(origin, "xyz"))
        about_centre = R_own @ np.array([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]]) @ R_own.T
        mass[i] += m
        moment[i] += m * c
        inertia[i] += about_centre + m * (c @ c * np.eye(3) - np.outer(c, c))
    return mass, moment, inertia
