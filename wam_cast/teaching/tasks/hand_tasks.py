"""The hand: kinematics of a planar arm that hangs, and what torques do at its hand.

Kinematics are compared with products of rotation matrices and with their derivatives, torques with the power that they give.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from wam_cast.teaching.answer import Answer, agree
from wam_cast.types import Array

EXACT = 1e-8
"""Tolerance of what has a closed form."""


def hand_position(answer: Answer, rng: np.random.Generator) -> None:
    """Judge the hand's position (2,) for joint angles and lengths (n,)."""
    for n in (2, 3, 4):
        q, lengths = rng.uniform(0.2, 0.9, n), rng.uniform(0.2, 0.6, n)
        hanging = answer(np.zeros(n), lengths, shape=(2,))
        mistakes: dict[str, ArrayLike] = {
            "x and z are in the wrong order": [-lengths.sum(), 0.0],
            "with all angles zero the arm must hang, below the origin": [0.0, lengths.sum()],
            "with all angles zero the arm must hang down, not stretch out": [lengths.sum(), 0.0],
        }
        agree(hanging, [0.0, -lengths.sum()], EXACT, "with all angles zero the arm does not hang straight", mistakes)
        x, z = _hand(q, lengths)
        alone = [lengths @ np.sin(q), -lengths @ np.cos(q)]
        mistakes = {
            "x and z are in the wrong order": [z, x],
            "a positive angle must swing the hand toward +x": [-x, z],
            "a joint turns all that hangs below it, not its own link alone": alone,
        }
        agree(answer(q, lengths, shape=(2,)), [x, z], EXACT, "the hand is not there", mistakes)


def hand_jacobian(answer: Answer, rng: np.random.Generator) -> None:
    """Judge the Jacobian (2, n) of the hand's position."""
    for n in (3, 4):
        q, lengths = rng.uniform(0.2, 0.9, n), rng.uniform(0.2, 0.6, n)
        expected = np.column_stack([np.imag(_hand(q + 1e-30j * one, lengths)) / 1e-30 for one in np.eye(n)])
        angles = np.cumsum(q)
        own = lengths * [np.cos(angles), np.sin(angles)]
        mistakes = {
            "the rows of x and z are in the wrong order": expected[::-1],
            "the sign is wrong": -expected,
            "a joint moves all links below it, not its own alone": own,
            "a joint moves the links below it, not those above": np.cumsum(own, axis=1),
            "the columns are in the wrong order": expected[:, ::-1],
        }
        words = "it is not the derivative of the hand's position"
        agree(answer(q, lengths, shape=(2, n)), expected, EXACT, words, mistakes)


def joint_torques(answer: Answer, rng: np.random.Generator) -> None:
    """Judge torques (n,) for a force (m,) at the hand, by virtual work."""
    for m, n in ((2, 3), (3, 7)):
        J, force, v = rng.normal(size=(m, n)), rng.normal(size=m), rng.normal(size=(n, n))
        torque = answer(J, force, shape=(n,))
        mistakes = {
            "the sign is wrong: the motors exert the force, they do not resist it": -force @ (J @ v),
            "an inverse of J maps velocities; forces go by virtual work": np.linalg.pinv(J) @ force @ v,
        }
        words = "at some joint velocities the torques' power is not the force's"
        agree(torque @ v, force @ (J @ v), EXACT, words, mistakes)


def null_space_torque(answer: Answer, rng: np.random.Generator) -> None:
    """Judge the part (n,) of a torque that exerts no force at the hand, and that what is left out is a hand force's."""
    for m, n in ((2, 4), (3, 7)):
        J, torque = rng.normal(size=(m, n)), rng.normal(size=n)
        found = answer(J, torque, shape=(n,))
        mistakes = {"that is the part that pushes the hand; the other one is wanted": J @ torque}
        agree(J @ found, np.zeros(m), EXACT, "J times the result is not zero, so it still pushes the hand", mistakes)
        force, *_ = np.linalg.lstsq(J.T, torque - found, rcond=None)
        agree(torque - found, J.T @ force, EXACT, "more was taken away than what a force at the hand explains")


def hand_law(answer: Answer, rng: np.random.Generator) -> None:
    """Judge torques (n,) of a spring and a damper at the hand."""
    J, position, velocity = rng.normal(size=(3, 7)), rng.normal(size=3), rng.normal(size=3)
    kp, kd, zero = 90.0, 7.0, np.zeros(3)

    def torque(kp: float, kd: float) -> Any:
        return kp * position @ J + kd * velocity @ J

    allowed = EXACT
    words = "with no velocity error the spring alone should push"
    agree(answer(J, position, zero, kp, kd, shape=(7,)), kp * position @ J, allowed, words)
    mistakes = {
        "the damper has the wrong sign": torque(kp, -kd),
        "stiffness and damping are exchanged": torque(kd, kp),
        "the damper is missing": torque(kp, 0.0),
    }
    words = "the torques are not those of a spring and a damper at the hand"
    agree(answer(J, position, velocity, kp, kd, shape=(7,)), torque(kp, kd), allowed, words, mistakes)


TASKS = (hand_position, hand_jacobian, joint_torques, null_space_torque, hand_law)


def _hand(q: Array, lengths: Array) -> Array:
    """Return x and z of the hand by turning the arm joint by joint, the last one first; complex angles too."""
    point = np.zeros(2, dtype=q.dtype)
    for angle, length in zip(q[::-1], lengths[::-1], strict=True):
        c, s = np.cos(angle), np.sin(angle)
        point = np.array([[c, -s], [s, c]]) @ (point + np.array([0.0, -length]))
    return point
