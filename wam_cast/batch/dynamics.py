"""Accelerations of arm, string and ball: Featherstone's articulated-body algorithm for their chain, for all casts at once.

The chain has a revolute joint for each of the arm's, and a universal one for each link of the string and for the ball. Everything
is in the world's axes, each body's about the origin of the joint that it hangs on: so what is handed from body to body needs no
rotation. With alpha the angular acceleration of a body and a that of its joint's origin, of which gravity is a part, the moment and
the force that move it and all that hangs on it are

    n = I alpha + H a + p_n,    f = H^T alpha + M a + p_f.

R. Featherstone, Rigid Body Dynamics Algorithms, 2008, Section 7.3, has it in spatial vectors. Loops over bodies are scans, since a
compiler that unrolls them takes minutes.
"""

from __future__ import annotations

from typing import Any, NamedTuple

import jax
import jax.numpy as jnp

from wam_cast.arm.arm_chain import FRICTION_SPEED
from wam_cast.batch.compilation import computed_once
from wam_cast.batch.numbers import ArmNumbers, CastNumbers, StringNumbers
from wam_cast.batch.vectors import Element, Matrix, Symmetric, Vector

N_ARM = 7


class Body(NamedTuple):
    """How a body moves, and what moves it."""

    offset: Vector
    """From the origin of the joint before to its own."""
    swing: Vector
    """Velocity of its own less that of the one before."""
    axes: tuple[Vector, ...]
    """Of its joint: one, or two."""
    bias: Vector
    """Its angular acceleration when its joint's speeds stay."""
    centripetal: Vector
    """The same of the joint's origin."""
    omega: Vector
    moment: Vector
    """Mass times the way from the origin to its centre."""
    inertia: Symmetric
    """About its origin."""


class Reduced(NamedTuple):
    """What the acceleration of a joint is by those of the body before: q'' = free - J alpha - G a, for each of its axes."""

    free: tuple[Element, ...]
    J: tuple[Vector, ...]
    G: tuple[Vector, ...]


class Articulated(NamedTuple):
    """Inertia and bias of a body with all that hangs on it."""

    I: Symmetric  # noqa: E741 - as it is written
    H: Matrix
    M: Symmetric
    p_n: Vector
    p_f: Vector

    @classmethod
    def nothing(cls, zero: Element) -> Articulated:
        """Return that of no body."""
        v, s = Vector(zero, zero, zero), Symmetric(zero, zero, zero, zero, zero, zero)
        return cls(s, Matrix(v, v, v), s, v, v)

    def with_body(self, body: Body, mass: Element) -> Articulated:
        """Return that with `body` itself."""
        h, zero, M = body.moment, jnp.zeros_like(body.moment.x), self.M
        cross = Matrix(Vector(zero, h.z, -h.y), Vector(-h.z, zero, h.x), Vector(h.y, -h.x, zero))
        return Articulated(
            self.I + body.inertia,
            self.H + cross,
            M._replace(xx=M.xx + mass, yy=M.yy + mass, zz=M.zz + mass),
            self.p_n + body.omega.cross(body.inertia @ body.omega),
            self.p_f + body.omega.cross(body.omega.cross(h)),
        )

    def seen_from_before(self, offset: Vector) -> Articulated:
        """Return that about a point `offset` before: I - H L + L (H + L M)^T and H + L M, with L its cross product."""
        H = Matrix(*(column + offset.cross(of_M) for column, of_M in zip(self.H, self.M.matrix, strict=True)))
        turned = self.H.crossed(offset)
        x, y, z = (a + offset.cross(row) for a, row in zip(turned, H.transposed, strict=True))
        inertia = self.I + Symmetric(x.x, y.x, z.x, y.y, z.y, z.z)
        return Articulated(inertia, H, self.M, self.p_n + offset.cross(self.p_f), self.p_f)

    def through_joint(self, body: Body, torque: Any, rotor_inertia: Element) -> tuple[Articulated, Reduced]:
        """Return that on the other side of `body`'s joint, about the origin of the joint before, and what the joint does."""
        axes = body.axes
        of_I = [self.I @ axis for axis in axes]
        of_H = [self.H.transposed_times(axis) for axis in axes]
        p_n = self.p_n + self.I @ body.bias + self.H.times(body.centripetal)
        p_f = self.p_f + self.H.transposed_times(body.bias) + self.M @ body.centripetal
        wanted = [torque[k] - axis.dot(p_n) for k, axis in enumerate(axes)]
        inverse = _inverse([[a.dot(b) for b in of_I] for a in axes], rotor_inertia)
        J, G = (tuple(_combined(inverse, of)) for of in (of_I, of_H))
        J, G, wanted = computed_once((J, G, wanted))
        I, H, M = self.I, self.H, self.M  # noqa: E741
        for k in range(len(axes)):
            I, H, M = I.minus_outer(J[k], of_I[k]), H.minus_outer(J[k], of_H[k]), M.minus_outer(G[k], of_H[k])  # noqa: E741
            p_n, p_f = p_n + J[k] * wanted[k], p_f + G[k] * wanted[k]
        free = tuple(sum(e * w for e, w in zip(row, wanted, strict=True)) for row in inverse)
        return Articulated(I, H, M, p_n, p_f).seen_from_before(body.offset), Reduced(free, J, G)


def _inverse(D: list[list[Element]], rotor_inertia: Element) -> list[list[Element]]:
    """Return the inverse of a joint's inertia, of one axis or two."""
    if len(D) == 1:
        return [[1.0 / (D[0][0] + rotor_inertia)]]
    (a, b), (_, d) = D
    scale = 1.0 / (a * d - b * b)
    return [[d * scale, -b * scale], [-b * scale, a * scale]]


def _combined(inverse: list[list[Element]], vectors: list[Vector]) -> list[Vector]:
    return [sum((v * e for e, v in zip(row[1:], vectors[1:], strict=True)), vectors[0] * row[0]) for row in inverse]


def vector(elements: Any) -> Vector:
    """Return the vector of an array (3, n)."""
    return Vector(elements[0], elements[1], elements[2])


def matrix(columns: Any) -> Matrix:
    """Return the matrix of an array of columns, (3, 3, n)."""
    return Matrix(*(vector(columns[k]) for k in range(3)))


def full(value: Any, like: Any) -> Any:
    """Return `value` for each cast of `like`, (..., n)."""
    return jnp.broadcast_to(value, like.shape[-1:])


def arm_bodies(arm: ArmNumbers, q: Any, v: Any) -> tuple[Matrix, Vector, Vector, Body]:
    """Return R_WE, angular velocity of the hand and its place on the last link, and the bodies; `q`, `v` (7, n)."""

    def outward(before: tuple[Matrix, Vector], link: Any) -> tuple[tuple[Matrix, Vector], Body]:
        R, omega = before
        p, R_joint, c, s, speed, moment, inertia = link
        offset = R.times(vector(p))
        swing = omega.cross(offset)
        at_zero = R.of(matrix(R_joint))
        R = Matrix(at_zero.x * c + at_zero.y * s, at_zero.y * c - at_zero.x * s, at_zero.z)
        axis = R.z
        turned = omega + axis * speed
        own = R.congruent(Symmetric(*(inertia[k] for k in range(6))))
        bias, centripetal = omega.cross(axis) * speed, omega.cross(swing)
        return (R, turned), Body(offset, swing, (axis,), bias, centripetal, turned, R.times(vector(moment)), own)

    zero = jnp.zeros_like(q[0])
    base = jax.tree.map(lambda value: full(value, q), matrix(arm.base))
    links = (arm.p[:-1], arm.R[:-1], jnp.cos(q), jnp.sin(q), v, arm.moment, arm.inertia)
    (R, omega), bodies = jax.lax.scan(outward, (base, Vector(zero, zero, zero)), links)
    return R.of(matrix(arm.R[-1])), omega, R.times(vector(arm.p[-1])), bodies


def string_bodies(string: StringNumbers, R_WE: Matrix, omega: Vector, hook: Vector, q: Any, v: Any) -> Body:
    """Return the bodies of string and ball; `hook` leads to the hand from the origin of the last link; q, v (n_bodies, 2, n)."""

    def outward(before: tuple[Matrix, Vector, Vector], link: Any) -> tuple[tuple[Matrix, Vector, Vector], Body]:
        R, omega, offset = before
        length, c, s, speed, moment, across, along = link
        swing = omega.cross(offset)
        first, second = R.x, R.y * c[0] + R.z * s[0]
        normal = R.z * c[0] - R.y * s[0]
        R = Matrix(first * c[1] - normal * s[1], second, first * s[1] + normal * c[1])
        middle = omega + first * speed[0]
        turned = middle + second * speed[1]
        bias = omega.cross(first) * speed[0] + middle.cross(second) * speed[1]
        own = Symmetric(across, 0.0, 0.0, across, 0.0, across).minus_outer(R.z * (across - along), R.z)
        body = Body(offset, swing, (first, second), bias, omega.cross(swing), turned, R.z * moment, own)
        return (R, turned, R.z * length), body

    # The hook's frame is the hand's, turned about z by a right angle.
    R_WHook = Matrix(R_WE.y, R_WE.x * -1.0, R_WE.z)
    links = (string.length, jnp.cos(q), jnp.sin(q), v, string.moment, string.inertia, string.axial_inertia)
    return jax.lax.scan(outward, (R_WHook, omega, hook), links)[1]


def _inward(
    below: Articulated, bodies: Body, torque: Any, mass: Any, rotor_inertia: Any
) -> tuple[Articulated, Reduced]:
    """Return the inertia at the first body's joint, and what the joints do, of bodies on which `below` hangs."""

    def inward(below: Articulated, of_body: Any) -> tuple[Articulated, Reduced]:
        body, torque, mass, rotor_inertia = of_body
        return below.with_body(body, mass).through_joint(body, torque, rotor_inertia)

    return jax.lax.scan(inward, below, (bodies, torque, mass, rotor_inertia), reverse=True)


def _onward(before: tuple[Vector, Vector], bodies: Body, joints: Reduced) -> tuple[tuple[Vector, Vector], Any]:
    """Return the last body's accelerations, and those of the joints, (n_bodies, n_axes, n)."""

    def onward(before: tuple[Vector, Vector], of_body: tuple[Body, Reduced]) -> tuple[tuple[Vector, Vector], Any]:
        alpha, a = before
        body, joint = of_body
        a = a + alpha.cross(body.offset)
        qdd = [f - J.dot(alpha) - G.dot(a) for f, J, G in zip(joint.free, joint.J, joint.G, strict=True)]
        turned = sum((axis * value for axis, value in zip(body.axes, qdd, strict=True)), alpha + body.bias)
        return (turned, a + body.centripetal), jnp.stack(qdd)

    return jax.lax.scan(onward, before, (bodies, joints))


def accelerations(numbers: CastNumbers, q: Any, v: Any, torque: Any, is_alone: Any = False) -> Any:
    """Return v' of the chain [rad/s^2], (n_v, n), with positions and velocities (n_v, n) and the motors' `torque` [N m], (7, n).

    Where the arm `is_alone`, (n,), string and ball do not act on it.
    """
    arm, string, n = numbers.arm, numbers.string, q.shape[-1]
    v_arm = v[:N_ARM]
    friction = arm.friction * jnp.clip(v_arm / FRICTION_SPEED, -1.0, 1.0)
    R_WE, omega, hook, bodies = arm_bodies(arm, q[:N_ARM], v_arm)
    zero = jnp.zeros_like(q[0])
    q_string, v_string = (values[N_ARM:].reshape(-1, 2, n) for values in (q, v))
    string_torque = -string.damping[:, None] * v_string - string.stiffness[:, None] * q_string
    links = string_bodies(string, R_WE, omega, hook, q_string, v_string)
    below, link_joints = _inward(Articulated.nothing(zero), links, string_torque, string.mass, string.mass * 0)
    below = jax.tree.map(lambda value: jnp.where(is_alone, 0.0, value), below)
    torque = (torque - arm.damping * v_arm - friction)[:, None]
    _, arm_joints = _inward(below, bodies, torque, arm.mass, arm.rotor_inertia)
    still = Vector(zero, zero, zero), Vector(zero, zero, zero + numbers.gravity)
    hand, of_arm = _onward(still, bodies, arm_joints)
    _, of_string = _onward(hand, links, link_joints)
    return jnp.concatenate([of_arm.reshape(N_ARM, n), of_string.reshape(-1, n)])


def ball_motion(numbers: CastNumbers, q: Any, v: Any) -> tuple[Vector, Vector, Vector]:
    """Return p_WL [m], v_WL [m/s] and p_WE [m], with positions and velocities (n_v, n)."""
    arm, string, n = numbers.arm, numbers.string, q.shape[-1]
    R_WE, omega, hook, bodies = arm_bodies(arm, q[:N_ARM], v[:N_ARM])
    p_WE = summed(bodies.offset) + hook
    p_WE = p_WE._replace(z=p_WE.z + arm.base_height)
    q_string, v_string = (values[N_ARM:].reshape(-1, 2, n) for values in (q, v))
    links = string_bodies(string, R_WE, omega, hook, q_string, v_string)
    # The ball's centre is where another link would hang.
    z = jax.tree.map(lambda values: values[-1], links.moment) * (1.0 / string.mass[-1])
    omega_ball = jax.tree.map(lambda values: values[-1], links.omega)
    p_WL = summed(bodies.offset) + summed(links.offset) + z
    v_WL = summed(bodies.swing) + summed(links.swing) + omega_ball.cross(z)
    return p_WL._replace(z=p_WL.z + arm.base_height), v_WL, p_WE


def summed(vectors: Vector) -> Vector:
    """Return the sum over bodies of vectors whose elements are (n_bodies, n)."""
    total: Vector = jax.tree.map(lambda values: values.sum(0), vectors)
    return total
