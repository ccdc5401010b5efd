"""The arm in the casting plane: three bars, moved by the controller's law. Where the hand of many casts goes, without Drake or JAX.

With joints 3, 5 and 7 at zero the casting plane is one of symmetry, and joints 2, 4 and 6 move three rigid bodies in it. With phi_i
the angle by which body i has turned, d_i the bar to the next joint, and c_i the body's moment with all masses beyond at the bar's
end, the kinetic energy is the sum over i, j of phi_i' phi_j' A_ij / 2, where A_ij = d_i . c_j for i before j, and A_ii is constant.
String and ball, which weigh little, do not pull on the hand.
"""

from __future__ import annotations

import math
from collections import deque
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from wam_cast.adaptation.closed_form.hand_path import PlannedPath, SampledPath
from wam_cast.arm.arm_chain import FRICTION_SPEED, arm_chain
from wam_cast.arm.posture import base_rotation, frames, starting_posture
from wam_cast.scenario import Scenario
from wam_cast.types import Array

MOVING = (1, 3, 5)
"""Joints that move in the casting plane, from 0."""

LONGEST_STEP = 0.002
"""Of the integration [s]."""

SETTLED = 0.2
"""So long after the end of the drop [s] the hand is taken to rest."""


@dataclass(frozen=True, eq=False)
class ArmMotion:
    """What the arm does in casts.

    Attributes
    ----------
    path
        Of the hands.
    peak_torque_utilization, peak_velocity_utilization
        The largest over the joints up to the end of the drop, relative to their limits, (n,).
    is_within_range
        Whether no joint left its range, (n,).
    """

    path: SampledPath
    peak_torque_utilization: Array
    peak_velocity_utilization: Array
    is_within_range: NDArray[np.bool_]


class PlanarArm:
    """The arm of a scenario in the casting plane, at the angles `phi` [rad] by which its three bodies have turned from the start.

    Arrays are over bodies, or joints, and casts: (3, n). Angles count from outward to up.
    """

    def __init__(self, scenario: Scenario) -> None:
        chain, moving = arm_chain(scenario.arm), list(MOVING)
        R_WB = base_rotation(scenario.arm)
        posture = starting_posture(scenario)
        rotations, origins = frames(chain, posture)
        rotations, origins = [R_WB @ R for R in rotations], [R_WB @ p for p in origins]
        joints = [_in_plane(origins[k]) for k in (*MOVING, 7)]
        self._shoulder = joints[0] + [0.0, scenario.arm.mount_height]
        self._bar = np.diff(joints, axis=0)
        # A joint whose axis points along the world's -y turns from outward to up.
        sign = np.array([-np.sign(rotations[k][1, 2]) for k in MOVING])
        self._turns = np.tril(np.ones((3, 3))) * sign  # phi = turns @ (q - posture)
        mass, moment, inertia = np.zeros(3), np.zeros((3, 2)), np.zeros(3)
        for i in range(MOVING[0], 7):
            body = (i - 1) // 2
            own, offset = _in_plane(rotations[i] @ chain.moment[i]), _in_plane(origins[i]) - joints[body]
            mass[body] += chain.mass[i]
            moment[body] += own + chain.mass[i] * offset
            about_origin = (rotations[i] @ chain.inertia[i] @ rotations[i].T)[1, 1]
            inertia[body] += about_origin + 2 * own @ offset + chain.mass[i] * offset @ offset
        beyond = np.r_[np.cumsum(mass[::-1])[::-1][1:], 0.0]
        self._carried = moment + beyond[:, np.newaxis] * self._bar
        back = np.linalg.inv(self._turns)
        own_inertia = np.diag(inertia + beyond * (self._bar**2).sum(axis=1))
        self._constant_inertia = own_inertia + back.T @ np.diag(chain.rotor_inertia[moving]) @ back
        self._back, self._gravity = back, scenario.gravity
        self._damping, self._friction = chain.damping[moving, None], chain.coulomb_friction[moving, None]
        self._torque_scale = np.array(scenario.arm.torque_scale)[moving, None]
        self._torque_limits = chain.torque_limits[moving, None] / self._torque_scale
        self._velocity_limits = chain.velocity_limits[moving, None]
        self._range = tuple((limits - posture)[moving, None] for limits in (chain.lower, chain.upper))
        controller = scenario.controller
        self._kp, self._kd = controller.kp, controller.kd
        self._stiffness = np.array(controller.posture_stiffness)[moving, None]
        self._posture_damping = np.array(controller.posture_damping)[moving, None]

    def hand(self, phi: Array, rate: Array) -> tuple[Array, Array]:
        """Return place [m] and velocity [m/s] of the hand, (2, n) each."""
        bar = _turned(self._bar, phi)
        return self._shoulder[:, np.newaxis] + bar.sum(axis=1), (_ahead(bar) * rate).sum(axis=1)

    def gravity_torque(self, phi: Array) -> Array:
        """Return the joints' torques that carry the arm's own weight [N m], (3, n)."""
        return np.asarray(self._gravity * self._turns.T @ _turned(self._carried, phi)[0])

    def command(self, phi: Array, rate: Array, wanted: tuple[Array, Array]) -> Array:
        """Return the law's joint torques [N m], (3, n), for a wanted place and velocity of the hand: see `.CastController`."""
        lever = _ahead(_turned(self._bar, phi))
        place, velocity = self.hand(phi, rate)
        force = self._kp * (wanted[0] - place) + self._kd * (wanted[1] - velocity)
        q, v = self._back @ phi, self._back @ rate  # from the posture
        posture = -self._stiffness * q - self._posture_damping * v
        J = np.einsum("cin,ij->cjn", lever, self._turns)
        a, b, d = (J[0] * J[0]).sum(axis=0), (J[0] * J[1]).sum(axis=0), (J[1] * J[1]).sum(axis=0)
        x, z = (J * posture).sum(axis=1)
        force -= np.stack([d * x - b * z, a * z - b * x]) / (a * d - b * b)
        return np.asarray(J[0] * force[0] + J[1] * force[1] + posture + self.gravity_torque(phi))

    def acceleration(self, phi: Array, rate: Array, command: Array) -> Array:
        """Return the bodies' angular accelerations [rad/s^2], (3, n), under commanded joint torques [N m], (3, n)."""
        bar, carried, v = _turned(self._bar, phi), _turned(self._carried, phi), self._back @ rate
        friction = self._damping * v + self._friction * np.clip(v / FRICTION_SPEED, -1.0, 1.0)
        moment = self._back.T @ (self._torque_scale * command - self.gravity_torque(phi) - friction)
        inertia = np.tile(self._constant_inertia, (phi.shape[1], 1, 1))
        for i, j in ((0, 1), (0, 2), (1, 2)):
            product = bar[0, i] * carried[0, j] + bar[1, i] * carried[1, j]
            cross = bar[1, i] * carried[0, j] - bar[0, i] * carried[1, j]
            inertia[:, i, j] += product
            inertia[:, j, i] += product
            moment[i] -= cross * rate[j] ** 2
            moment[j] += cross * rate[i] ** 2
        return np.asarray(np.linalg.solve(inertia, moment.T[..., np.newaxis])[..., 0].T)

    def utilization(self, rate: Array, command: Array) -> tuple[Array, Array]:
        """Return the largest over the joints of torque and velocity, relative to their limits, (n,) each."""
        torque, velocity = np.abs(command) / self._torque_limits, np.abs(self._back @ rate) / self._velocity_limits
        return torque.max(axis=0), velocity.max(axis=0)

    def is_within_range(self, phi: Array) -> NDArray[np.bool_]:
        """Return whether all joints are within their ranges, (n,)."""
        q = self._back @ phi
        return np.asarray(((q >= self._range[0]) & (q <= self._range[1])).all(axis=0))


def move_arm(scenario: Scenario, casts: Array) -> ArmMotion:
    """Return what the arm does in casts `[distance, speed, wait]`, (n, 3), as far as its motors are not saturated.

    The law is evaluated once a control period and acts, after the controller's delay, until the next; in between the arm is
    integrated by the midpoint rule.
    """
    arm, planned, n = PlanarArm(scenario), PlannedPath(scenario, casts), len(casts)
    period, rows = scenario.controller.period, np.arange(n)
    n_steps = math.ceil(period / LONGEST_STEP - 1e-9)
    h = period / n_steps
    phi, rate = np.zeros((3, n)), np.zeros((3, n))
    peaks, is_within = np.zeros((2, n)), np.ones(n, dtype=bool)
    places, velocities = [], []
    line: deque[Array] = deque(maxlen=scenario.controller.delay + 1)  # commands on their way, the oldest first
    for k in range(math.ceil((planned.drop_end.max() + SETTLED) / period) + 1):
        t = np.full(n, k * period)
        place, velocity = arm.hand(phi, rate)
        places.append(place)
        velocities.append(velocity)
        line.append(arm.command(phi, rate, planned(t, rows)[:2]))
        command = line[0]
        counts = t <= planned.drop_end
        peaks = np.where(counts, np.maximum(peaks, arm.utilization(rate, command)), peaks)
        is_within &= arm.is_within_range(phi) | ~counts
        for _ in range(n_steps):
            middle = rate + h / 2 * arm.acceleration(phi, rate, command)
            change = h * arm.acceleration(phi + h / 2 * rate, middle, command)
            phi, rate = phi + h * middle, rate + change
    return ArmMotion(SampledPath(period, np.array(places), np.array(velocities)), peaks[0], peaks[1], is_within)


def _in_plane(vector: Array) -> Array:
    return np.asarray(vector[[0, 2]])


def _turned(vectors: Array, phi: Array) -> Array:
    """Return vectors of bodies, (3, 2), turned by angles (3, n): (2, 3, n)."""
    c, s = np.cos(phi), np.sin(phi)
    x, z = vectors[:, :1], vectors[:, 1:]
    return np.stack([x * c - z * s, x * s + z * c])


def _ahead(vectors: Array) -> Array:
    """Return vectors, (2, ...), turned by a right angle."""
    return np.stack([-vectors[1], vectors[0]])
