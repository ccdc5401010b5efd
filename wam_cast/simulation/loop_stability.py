"""Whether the closed loop of arm and controller is stable at the control period, with its delay: from its linearization."""

from __future__ import annotations

import math
from collections.abc import Callable
from functools import lru_cache

import numpy as np
from pydrake.multibody.plant import MultibodyPlant
from scipy.linalg import expm

from wam_cast.arm.arm_model import arm_model
from wam_cast.arm.posture import starting_posture
from wam_cast.errors import InputError
from wam_cast.robot.controller import MeasuredArm
from wam_cast.robot.plant import N_ARM, joint_damping, make_arm_plant
from wam_cast.scenario import Controller, Scenario
from wam_cast.types import Array

MAX_GROWTH = 5.0
"""Rate of growth [1/s] up to which a loop passes for stable: a joint that no gain holds drifts, which a cast does not notice."""

GAIN_MARGIN = 0.8
"""Share of the largest stable gains that is proposed."""

LEAST_FACTOR, N_BISECTIONS = 0.01, 8
"""Of all gains that is worth proposing, and steps of the search for the largest."""

LARGER_GAINS, SHORTER_PERIODS = (2.0, 4.0, 8.0), (2, 4, 8)
"""What is tried besides: factors of all gains where lower ones do not help, and divisors of the control period."""

N_WAYPOINTS, N_NEWTON_STEPS = 8, 4
"""On the way to a posture."""

CORNER_TOLERANCE = 0.01
"""Of the hand's place in a posture [m]."""

TORQUE_STEP = 1e-6
"""Of the joints [rad] to find how gravity's torque changes."""


def check_loop(robot: Scenario, belief: Scenario) -> None:
    """Raise `.InputError` if the loop of `.CastController` is unstable where a cast takes the hand."""
    rate = loop_growth(robot, belief)
    if rate <= MAX_GROWTH:
        return
    gains = robot.controller
    helps = _remedies(robot, belief)
    raise InputError(
        f"controller.kp = {gains.kp:g}, kd = {gains.kd:g}, and those of the posture, are unstable at controller.period = "
        f"{gains.period:g} s with controller.delay = {gains.delay}: errors double every {1e3 * math.log(2) / rate:.3g} ms; "
        + (" or ".join(helps) if helps else "neither other gains nor a shorter period or delay helps: look at `arm`")
    )


def loop_growth(robot: Scenario, belief: Scenario) -> float:
    """Return the largest rate of growth [1/s] of small errors, over the corners of the region where a cast takes the hand.

    Negative: all errors die out. Coulomb friction, which would hold small ones, does not count, nor saturation of large ones.
    """
    return _loop_growth(robot, belief, arm_model(robot.arm).urdf, arm_model(belief.arm).urdf)


@lru_cache(maxsize=32)
def _loop_growth(robot: Scenario, belief: Scenario, *_urdfs: str) -> float:
    plant, believed = make_arm_plant(robot), MeasuredArm(make_arm_plant(belief))
    return max(_growth(robot, plant, believed, q) for q in _corner_postures(belief, believed))


def _growth(robot: Scenario, plant: MultibodyPlant, believed: MeasuredArm, q: Array) -> float:
    """Return the rate of growth [1/s] of the sampled loop at a posture.

    Errors x = (dq, dv) follow x' = A x + B u with u held for a period, and u = F x of `delay` periods ago; so the state of the
    whole is x and the torques on their way, and grows by the spectral radius of its transition matrix in a period.
    """
    period, delay = robot.controller.period, robot.controller.delay
    A, B = _arm_dynamics(plant, q)
    F = np.array(robot.arm.torque_scale)[:, np.newaxis] * _feedback(robot, believed, q)
    n_x, n_u = B.shape
    held = expm(period * np.block([[A, B], [np.zeros((n_u, n_x + n_u))]]))[:n_x]
    A_d, B_d = held[:, :n_x], held[:, n_x:]
    if delay == 0:
        transition = A_d + B_d @ F
    else:
        waiting = delay * n_u
        transition = np.zeros((n_x + waiting, n_x + waiting))
        transition[:n_x, :n_x] = A_d
        transition[:n_x, -n_u:] = B_d
        transition[n_x : n_x + n_u, :n_x] = F
        transition[n_x + n_u :, n_x:-n_u] = np.eye(waiting - n_u)
    return float(np.log(np.abs(np.linalg.eigvals(transition)).max()) / period)


def _arm_dynamics(plant: MultibodyPlant, q: Array) -> tuple[Array, Array]:
    """Return A, (14, 14), and B, (14, 7), of small motions of the arm about rest at `q` under the torque that holds it."""
    context = plant.CreateDefaultContext()
    plant.SetPositions(context, q)
    M_inverse = np.linalg.inv(plant.CalcMassMatrix(context))
    zero, one = np.zeros((N_ARM, N_ARM)), np.eye(N_ARM)
    A = np.block([[zero, one], [M_inverse @ _gravity_gradient(plant, q), -M_inverse @ np.diag(joint_damping(plant))]])
    return A, np.vstack([zero, M_inverse])


def _gravity_gradient(plant: MultibodyPlant, q: Array) -> Array:
    """Return the derivative of gravity's generalized force by the joint angles [N m/rad], (7, 7)."""
    context = plant.CreateDefaultContext()

    def force(q: Array) -> Array:
        plant.SetPositions(context, q)
        return np.asarray(plant.CalcGravityGeneralizedForces(context))

    steps = TORQUE_STEP * np.eye(N_ARM)
    return np.column_stack([(force(q + step) - force(q - step)) / (2 * TORQUE_STEP) for step in steps])


def _feedback(robot: Scenario, believed: MeasuredArm, q: Array) -> Array:
    """Return F, (7, 14): the linearization of the law of `.CastController` at rest at `q`, where the hand is as it is to be."""
    gains = robot.controller
    believed.measure(np.concatenate([q, np.zeros(N_ARM)]))
    J = believed.Jv_WE
    N = np.eye(N_ARM) - np.linalg.pinv(J) @ J
    on_angles = gains.kp * J.T @ J + N @ np.diag(gains.posture_stiffness) + _gravity_gradient(believed.plant, q)
    on_speeds = gains.kd * J.T @ J + N @ np.diag(gains.posture_damping)
    return -np.hstack([on_angles, on_speeds])


def _corner_postures(belief: Scenario, believed: MeasuredArm) -> list[Array]:
    """Return the arm's postures with the hand near and far, high and low: there its posture's springs are least bent."""
    motion = belief.motion
    q_start = starting_posture(belief)
    weight = np.maximum(belief.controller.posture_stiffness, 1e-3)
    near, far = motion.start_radius, motion.start_radius + belief.bounds.distance[1]
    high, low = motion.start_height, motion.start_height - motion.drop_distance
    start, postures = np.array([near, 0.0, high]), [q_start]
    for corner in ([near, 0.0, low], [far, 0.0, high], [far, 0.0, low]):
        q = q_start
        # Newton's method, along the way: at once it would not find to an arm that is almost straight.
        for target in np.repeat(np.linspace(start, corner, N_WAYPOINTS), N_NEWTON_STEPS, axis=0):
            believed.measure(np.concatenate([q, np.zeros(N_ARM)]))
            J = believed.Jv_WE
            J_weighted = J / weight  # J W^-1
            error = target - believed.p_WE
            q = q + J_weighted.T @ np.linalg.lstsq(J_weighted @ J.T, error)[0]
        if np.linalg.norm(error) < CORNER_TOLERANCE:  # else the arm does not get there
            postures.append(q)
    return postures


def _remedies(robot: Scenario, belief: Scenario) -> list[str]:
    """Return which changes of the controller make the loop stable, each tried, as a reader is told to make them."""
    gains = robot.controller

    def is_stable(changed: Controller) -> bool:
        return loop_growth(robot.model_copy(update={"controller": changed}), belief) <= MAX_GROWTH

    def changed_to(**values: float) -> bool:
        return is_stable(gains.model_copy(update=values))

    found = []
    if factor := _stable_factor(lambda factor: is_stable(_scaled(gains, factor))):
        found.append(f"multiply all gains by {factor:.2g} or less")
    elif factor := next((one for one in LARGER_GAINS if is_stable(_scaled(gains, one))), 0.0):
        found.append(f"multiply all gains by {factor:g}")
    if period := next((gains.period / n for n in SHORTER_PERIODS if changed_to(period=gains.period / n)), 0.0):
        found.append(f"choose controller.period = {period:g} s or less")
    if (delay := next((n for n in range(gains.delay - 1, -1, -1) if changed_to(delay=n)), -1)) >= 0:
        found.append(f"choose controller.delay = {delay}{' or less' if delay else ''}")
    return found


def _stable_factor(is_stable: Callable[[float], bool]) -> float:
    """Return by which factor all gains would be lowered to be stable, with a margin; 0 if none is found."""
    low, high = 0.0, 1.0
    for _ in range(N_BISECTIONS):
        middle = (low + high) / 2
        if is_stable(middle):
            low = middle
        else:
            high = middle
    return GAIN_MARGIN * low if low > LEAST_FACTOR else 0.0


def _scaled(gains: Controller, factor: float) -> Controller:
    return gains.model_copy(
        update={
            "kp": factor * gains.kp,
            "kd": factor * gains.kd,
            "posture_stiffness": tuple(factor * one for one in gains.posture_stiffness),
            "posture_damping": tuple(factor * one for one in gains.posture_damping),
        }
    )
