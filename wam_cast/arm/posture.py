"""Where the mounted arm is: its base, its hand, and the posture that puts the hand at the start of a cast. No Drake."""

from __future__ import annotations

import math

import numpy as np

from wam_cast.arm.arm_chain import ArmChain, arm_chain
from wam_cast.arm.arm_model import arm_model
from wam_cast.arm.urdf_file import rotation
from wam_cast.errors import InputError
from wam_cast.scenario import Arm, Scenario
from wam_cast.types import Array


def base_rotation(arm: Arm, tilt: tuple[float, float] = (0.0, 0.0)) -> Array:
    """Return R_WB, (3, 3), of the mounted arm, turned by a small `tilt` about the world's x and y axes [rad] besides."""
    roll, pitch = {"ceiling": (np.pi, 0.0), "floor": (0.0, 0.0), "wall": (0.0, np.pi / 2)}[arm.mount]
    return np.asarray(rotation(np.array([*tilt, 0.0])) @ rotation(np.array([roll, pitch, 0.0])))


def hand_rotation(chain: ArmChain, q: Array) -> Array:
    """Return R_BE, (3, 3), at joint angles `q` [rad], (7,)."""
    return np.asarray(frames(chain, q)[0][-1])


def frame_origins(chain: ArmChain, q: Array) -> Array:
    """Return where the frames of the joints and the hand are in the base's frame [m], (8, 3), at joint angles `q` [rad], (7,)."""
    return np.array(frames(chain, q)[1])


def mass_matrix(chain: ArmChain, q: Array) -> Array:
    """Return the arm's joint-space inertia [kg m^2], (7, 7), with that of the motors, at joint angles `q` [rad], (7,)."""
    rotations, origins = frames(chain, q)
    M = np.diag(chain.rotor_inertia)
    for i, (R, p) in enumerate(zip(rotations[:-1], origins[:-1], strict=True)):
        axes = np.array([R_joint[:, 2] for R_joint in rotations[: i + 1]])
        arms = p - np.array(origins[: i + 1])
        J_v = np.cross(axes, arms)  # of the frame's origin, by joints
        h, inertia = R @ chain.moment[i], R @ chain.inertia[i] @ R.T
        coupling = J_v @ np.cross(axes, h).T
        M[: i + 1, : i + 1] += chain.mass[i] * J_v @ J_v.T + coupling + coupling.T + axes @ inertia @ axes.T
    return M


def frames(chain: ArmChain, q: Array) -> tuple[list[Array], list[Array]]:
    """Return, in the base's frame, the rotations (3, 3) and origins (3,) [m] of the frames of the joints and the hand."""
    R, p = np.eye(3), np.zeros(3)
    rotations, origins = [], []
    for R_joint, p_joint, angle in zip(chain.R, chain.p, [*q, 0.0], strict=True):
        R, p = R @ R_joint @ _about_z(angle), p + R @ p_joint
        rotations.append(R)
        origins.append(p)
    return rotations, origins


def _about_z(angle: float) -> Array:
    c, s = math.cos(angle), math.sin(angle)
    return np.array([[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]])


def starting_posture(scenario: Scenario, bearing: float = 0.0) -> Array:
    """Return the joint angles [rad], shape (7,), that put the hand at the start of a cast, elbow bent forward.

    With joints 3, 5 and 7 at zero the arm is a planar linkage of two bars, from the shoulder to the elbow's axis and from
    there to the hand, so the law of cosines solves it.

    Raises
    ------
    InputError
        If the hand cannot be there or a joint would exceed its limits.
    """
    motion, arm, chain = scenario.motion, arm_model(scenario.arm), arm_chain(scenario.arm)
    places = frame_origins(chain, np.array([0, 0, 0, 0, 0, scenario.arm.wrist_pitch, 0]))
    shoulder, elbow, hand = places[[1, 3, 7]][:, [0, 2]]
    upper, fore = elbow - shoulder, hand - elbow
    p_WE_start = np.array([motion.start_radius, 0.0, motion.start_height])
    p_BE_start = base_rotation(scenario.arm).T @ (p_WE_start - [0, 0, scenario.arm.mount_height])
    target = p_BE_start[[0, 2]] - shoulder
    upper_length, fore_length, distance = (float(np.linalg.norm(bar)) for bar in (upper, fore, target))
    cosine = (distance**2 - upper_length**2 - fore_length**2) / (2 * upper_length * fore_length)
    if not -1 <= cosine <= 1:
        raise InputError(
            f"motion.start_radius = {motion.start_radius:g} m, motion.start_height = {motion.start_height:g} m: the hand would be "
            f"{distance:.3f} m from the shoulder, which is {arm.shoulder_height:.3f} m high (arm.mount_height); the arm allows "
            f"{abs(upper_length - fore_length):.3f} to {upper_length + fore_length:.3f} m"
        )
    q4 = _pitch(upper) - _pitch(fore) + np.arccos(cosine)
    turned_fore = np.array([[np.cos(q4), np.sin(q4)], [-np.sin(q4), np.cos(q4)]]) @ fore
    q2 = _pitch(target) - _pitch(upper + turned_fore)
    q = np.array([arm.joint_1_turn * bearing, q2, 0.0, q4, 0.0, scenario.arm.wrist_pitch, 0.0])
    longest = 0.98 * (upper_length + float(np.linalg.norm(fore)))
    for height in (motion.start_height, motion.start_height - motion.drop_distance):
        far = motion.start_radius + scenario.bounds.distance[1] - arm.shoulder_radius
        needed = float(np.hypot(far, arm.shoulder_height - height))
        if needed > longest:
            raise InputError(
                f"bounds.distance = {list(scenario.bounds.distance)}: at its longest move the hand would be {needed:.3f} m from "
                f"the shoulder at a height of {height:g} m, the arm allows {longest:.3f} m; lower the second number, "
                "motion.start_radius or motion.drop_distance, or change arm.mount_height"
            )
    lowest, highest = arm.bearing_limits
    if not lowest <= bearing <= highest:
        raise InputError(
            f"cast.bearing = {bearing:.4g} rad: joint 1 of the {scenario.arm.mount}-mounted arm cannot turn there; choose one from "
            f"{lowest:.4g} to {highest:.4g} rad"
        )
    for i in np.flatnonzero((q < chain.lower) | (q > chain.upper)):
        raise InputError(
            f"starting posture: joint {i + 1} at {q[i]:.3f} rad is outside its limits {chain.lower[i]:g} to {chain.upper[i]:g}; "
            "change motion.start_radius, motion.start_height or arm.wrist_pitch"
        )
    return q


def _pitch(bar: Array) -> float:
    """Return the angle of (x, z) from z toward x, as a turn about y counts [rad]."""
    return math.atan2(bar[0], bar[1])
