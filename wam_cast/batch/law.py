"""Once a control period, for all casts at once: the reference, what the encoders read, the law, and what the motors give."""

from __future__ import annotations

from typing import Any, NamedTuple

import jax.numpy as jnp

from wam_cast.arm.arm_chain import DIFFERENTIALS
from wam_cast.batch.dynamics import arm_bodies, summed
from wam_cast.batch.numbers import ArmNumbers, CastNumbers, LawNumbers, MotionNumbers
from wam_cast.batch.vectors import Matrix, Vector
from wam_cast.motion.pendulum import Pendulum
from wam_cast.motion.spline import nonic_step, quintic_step
from wam_cast.motion.turn import swung_hand


class Reference(NamedTuple):
    """What the hand is to do, and the bearing of the plane that the arm is in, at a time [s]: see `.CastMotion`."""

    p_WE: Vector
    v_WE: Vector
    bearing: Any
    rate: Any


def reference(motion: MotionNumbers, t: Any) -> Reference:
    """Return the reference up to the end of the hold at times `t` [s], (n,)."""
    m, since = motion, t - motion.turn_duration
    value, rate = quintic_step(_share(since, m.move_duration))
    radius, outward = m.start_radius + m.distance * value, m.distance / m.move_duration * rate
    value, rate = quintic_step(_share(since - m.move_duration - m.wait, m.drop_duration))
    height, upward = m.start_height - m.drop_distance * value, -m.drop_distance / m.drop_duration * rate
    c, s = jnp.cos(m.bearing), jnp.sin(m.bearing)
    p_WE, v_WE = Vector(radius * c, radius * s, height), Vector(outward * c, outward * s, upward)
    is_turning = t < m.turn_duration
    duration = jnp.where(m.turn_duration > 0, m.turn_duration, 1.0)
    step = nonic_step(_share(t, duration))
    angle = m.bearing * step[0]
    rates = [m.bearing / duration**order * step[order] for order in (1, 2, 3)]
    pendulum = Pendulum(m.pendulum_length, m.gravity)
    p, v = swung_hand((angle, *rates), m.start_radius, m.start_height - m.pendulum_length, pendulum, xp=jnp)
    p_WE, v_WE = (
        Vector(*(jnp.where(is_turning, a, b) for a, b in zip(turned, straight, strict=True)))
        for turned, straight in ((p, p_WE), (v, v_WE))
    )
    bearing, rate = jnp.where(is_turning, angle, m.bearing), jnp.where(is_turning, rates[0], 0.0)
    return Reference(p_WE, v_WE, bearing, rate)


def _share(since: Any, duration: Any) -> Any:
    return jnp.clip(since / duration, 0.0, 1.0)


def measured(law: LawNumbers, q: Any, v: Any) -> tuple[Any, Any]:
    """Return joint angles [rad] and speeds [rad/s] as the encoders say them, (7, n) each."""
    q = q + law.offset
    unit = jnp.where(law.resolution > 0, law.resolution, 1.0)

    def counted(values: Any, unit: Any) -> Any:
        return jnp.where(law.resolution > 0, jnp.rint(values / unit) * unit, values)

    return counted(q, unit), counted(v, unit / law.period)


def commanded(numbers: CastNumbers, q: Any, v: Any, wanted: Reference) -> Any:
    """Return the law's torque [N m], (7, n), at measured angles and speeds, (7, n) each: see `.CastController`."""
    law, arm = numbers.law, numbers.believed
    origins, axes, hand, holding = _believed_arm(arm, numbers.motion.gravity, q)
    to_hand = Vector(*(h - o for h, o in zip(hand, origins, strict=True)))
    J = axes.cross(to_hand)
    v_WE = Vector(*((row * v).sum(0) for row in J))
    p_WE = hand._replace(z=hand.z + arm.base_height)
    u_x = (wanted.p_WE - p_WE) * law.kp + (wanted.v_WE - v_WE) * law.kd
    posture = law.posture_stiffness * (law.posture - q) - law.posture_damping * v
    turn = law.posture_stiffness[0] * wanted.bearing + law.posture_damping[0] * wanted.rate
    posture = posture.at[0].add(law.joint_1_turn * turn)
    square = Matrix(*(Vector(*((a * b).sum(0) for b in J)) for a in J))
    force_of_posture = _solved(square, Vector(*((row * posture).sum(0) for row in J)))
    force = u_x - force_of_posture
    return J.x * force.x + J.y * force.y + J.z * force.z + posture + holding


def _believed_arm(arm: ArmNumbers, gravity: Any, q: Any) -> tuple[Vector, Vector, Vector, Any]:
    """Return where the joints are, their axes, where the hand is, and the torque that carries the arm's own weight [N m].

    Places [m] are from the base, in the world's axes; of the joints (7, n).
    """
    _, _, hook, bodies = arm_bodies(arm, q, jnp.zeros_like(q))
    origins = Vector(*(jnp.cumsum(values, axis=0) for values in bodies.offset))
    hand = summed(bodies.offset) + hook
    # Mass, and mass times place, of all that each joint carries.
    mass = jnp.broadcast_to(arm.mass, q.shape)
    carried = Vector(*(_carried(o * mass + m) for o, m in zip(origins, bodies.moment, strict=True)))
    lever = Vector(*(c - o * _carried(mass) for c, o in zip(carried, origins, strict=True)))
    (axis,) = bodies.axes
    # The axis' share of lever x (0, 0, g).
    return origins, axis, hand, (axis.x * lever.y - axis.y * lever.x) * gravity


def _carried(values: Any) -> Any:
    """Return for each joint the sum over the links from it to the last, of values (7, n)."""
    return jnp.cumsum(values[::-1], axis=0)[::-1]


def _solved(square: Matrix, right: Vector) -> Vector:
    """Return the solution of a symmetric system by Cramer's rule."""
    a, b, c = square
    first, second, third = b.cross(c), c.cross(a), a.cross(b)
    scale = 1.0 / a.dot(first)
    return Vector(first.dot(right) * scale, second.dot(right) * scale, third.dot(right) * scale)


def utilization(values: Any, limits: Any) -> Any:
    """Return the motors' utilization by torques or velocities, (7, n): see `wam_cast.robot.motors.motor_utilization`."""
    own = jnp.abs(values) / limits
    for a, b in DIFFERENTIALS:
        both = own[a] + own[b]
        own = own.at[a].set(both).at[b].set(both)
    return own


def torque_limits(law: LawNumbers, v: Any, torque: Any) -> Any:
    """Return what the motors give at most [N m], (7, n), of torques with these signs at joint speeds `v`, (7, n)."""
    left = (1.0 - utilization(v, law.velocity_limits)) / jnp.where(law.knee < 1, 1.0 - law.knee, 1.0)
    falls = (law.knee < 1) & (torque * v > 0)
    return law.torque_limits * jnp.where(falls, jnp.clip(left, 1e-6, 1.0), 1.0)


def given(law: LawNumbers, wanted: Any, v: Any) -> tuple[Any, Any]:
    """Return the torque that acts [N m] when `wanted` is commanded, (7, n) each, and the utilization that was asked for."""
    asked = utilization(wanted, torque_limits(law, v, wanted))
    return law.torque_scale * wanted / jnp.maximum(asked, 1.0), asked
