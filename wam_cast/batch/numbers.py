"""All numbers that casts depend on, as arrays over casts: what the batched engine takes of scenarios, casts and noise seeds.

Every array's last axis is over casts, of length 1 where all casts have the same. Frames and units are the scenario's.
"""

from __future__ import annotations

from collections.abc import Sequence
from functools import lru_cache
from typing import Any, NamedTuple

import numpy as np

from wam_cast.arm.arm_chain import arm_chain, encoder_resolution
from wam_cast.arm.arm_model import ArmModel, arm_model
from wam_cast.arm.posture import base_rotation, hand_rotation, starting_posture
from wam_cast.cast import Cast
from wam_cast.motion.noise_draws import executed_cast, swing_at_start
from wam_cast.motion.pendulum import Pendulum
from wam_cast.motion.string_chain import hook_angles, string_chain
from wam_cast.motion.turn import turn_duration
from wam_cast.scenario import Scenario

Numbers = Any
"""A numpy array, or one of JAX."""


class ArmNumbers(NamedTuple):
    """The mounted arm: see `.ArmChain`; R by columns, the inertia by its elements xx, xy, xz, yy, yz, zz."""

    base: Numbers
    """R_WB by columns, (3, 3, n)."""
    base_height: Numbers
    """[m], (n,)."""
    R: Numbers
    """(8, 3, 3, n)."""
    p: Numbers
    """(8, 3, n)."""
    mass: Numbers
    moment: Numbers
    inertia: Numbers
    """(7, 6, n)."""
    rotor_inertia: Numbers
    damping: Numbers
    friction: Numbers
    """Coulomb's, as much as acts, (7, n)."""


class StringNumbers(NamedTuple):
    """String and ball: see `.StringChain`; all (n_links + 1, n)."""

    length: Numbers
    mass: Numbers
    moment: Numbers
    inertia: Numbers
    axial_inertia: Numbers
    damping: Numbers
    stiffness: Numbers


class LawNumbers(NamedTuple):
    """Controller, encoders and motors."""

    kp: Numbers
    kd: Numbers
    posture_stiffness: Numbers
    posture_damping: Numbers
    posture: Numbers
    """[rad], (7, n)."""
    joint_1_turn: Numbers
    period: Numbers
    delay: Numbers
    """Periods, integers."""
    offset: Numbers
    resolution: Numbers
    """Of the encoders [rad], (7, n); 0: exact."""
    torque_scale: Numbers
    torque_limits: Numbers
    """Of commanded torques [N m], (7, n)."""
    velocity_limits: Numbers
    knee: Numbers
    torque_deviation: Numbers
    """Of the noise [N m], (7, n)."""


class MotionNumbers(NamedTuple):
    """The reference: see `.CastMotion`. Times from the start of the turn, but for move, wait and drop."""

    bearing: Numbers
    turn_duration: Numbers
    start_radius: Numbers
    start_height: Numbers
    pendulum_length: Numbers
    gravity: Numbers
    distance: Numbers
    move_duration: Numbers
    wait: Numbers
    drop_distance: Numbers
    drop_duration: Numbers
    hold_duration: Numbers


class TargetNumbers(NamedTuple):
    """What is measured."""

    rim_height: Numbers
    ball_radius: Numbers
    string_length: Numbers
    lower: Numbers
    upper: Numbers


class CastNumbers(NamedTuple):
    """All numbers of casts."""

    arm: ArmNumbers
    believed: ArmNumbers
    string: StringNumbers
    law: LawNumbers
    motion: MotionNumbers
    target: TargetNumbers
    gravity: Numbers
    q: Numbers
    """At the start, (n_v, n)."""
    v: Numbers


def _arm_numbers(scenario: Scenario, tilt: tuple[float, float]) -> ArmNumbers:
    chain, arm = arm_chain(scenario.arm), scenario.arm
    return ArmNumbers(
        base=base_rotation(arm, tilt).T,
        base_height=np.float64(arm.mount_height),
        R=chain.R.transpose(0, 2, 1),
        p=chain.p,
        mass=chain.mass,
        moment=chain.moment,
        inertia=chain.inertia[:, (0, 0, 0, 1, 1, 2), (0, 1, 2, 1, 2, 2)],
        rotor_inertia=chain.rotor_inertia,
        damping=chain.damping,
        friction=chain.coulomb_friction,
    )


def numbers(scenario: Scenario, cast: Cast, noise_seed: int = 0, belief: Scenario | None = None) -> CastNumbers:
    """Return the numbers of one cast, without the last axis."""
    fixed = scenario_numbers(scenario, belief or scenario)
    if cast.bearing:
        starting_posture(belief or scenario, cast.bearing)  # raises if joint 1 cannot turn there
    executed = executed_cast(scenario.noise, cast, noise_seed) if scenario.noise.is_on else cast
    motion = fixed.motion._replace(
        bearing=np.float64(cast.bearing),
        turn_duration=np.float64(turn_duration(scenario, cast.bearing)),
        distance=np.float64(executed.distance),
        move_duration=np.float64(executed.move_duration),
        wait=np.float64(executed.wait),
    )
    q, v = fixed.q, fixed.v
    if scenario.noise.swing > 0:
        angles, rates = swing_at_start(scenario, noise_seed)
        q, v = q.copy(), v.copy()
        q[7:9] += angles
        v[7:9] += rates
    return fixed._replace(motion=motion, q=q, v=v)


def scenario_numbers(scenario: Scenario, belief: Scenario) -> CastNumbers:
    """Return what is the same in all casts of a scenario: the same object each time, unless a URDF has changed."""
    return _scenario_numbers(scenario, belief, arm_model(scenario.arm), arm_model(belief.arm))


@lru_cache(maxsize=64)
def _scenario_numbers(scenario: Scenario, belief: Scenario, *_models: ArmModel) -> CastNumbers:
    arm, controller, motion = scenario.arm, scenario.controller, belief.motion
    chain, believed_arm = arm_chain(arm), _arm_numbers(belief, (0.0, 0.0))
    scale, posture = np.array(arm.torque_scale), starting_posture(belief)
    limits = chain.torque_limits / scale
    pendulum = Pendulum.like(belief)
    q_arm = posture - np.array(arm.encoder_offset)
    R_WE = base_rotation(arm, arm.base_tilt) @ hand_rotation(chain, q_arm)
    n_joints = 2 * (scenario.string.n_links + 1)
    # The hook's frame is the hand's, turned about z by a right angle.
    R_WHook = R_WE[:, (1, 0, 2)] * [1.0, -1.0, 1.0]
    nothing = np.float64(0)
    return CastNumbers(
        arm=_arm_numbers(scenario, arm.base_tilt),
        believed=believed_arm,
        string=StringNumbers(*string_chain(scenario.string, scenario.ball)),
        law=LawNumbers(
            kp=np.float64(controller.kp),
            kd=np.float64(controller.kd),
            posture_stiffness=np.array(controller.posture_stiffness),
            posture_damping=np.array(controller.posture_damping),
            posture=posture,
            joint_1_turn=np.float64(arm_model(belief.arm).joint_1_turn),
            period=np.float64(controller.period),
            delay=np.int32(controller.delay),
            offset=np.array(arm.encoder_offset),
            resolution=encoder_resolution(chain, scenario.noise.encoder_counts),
            torque_scale=scale,
            torque_limits=limits,
            velocity_limits=chain.velocity_limits,
            knee=np.float64(arm.knee_speed),
            torque_deviation=scenario.noise.torque * limits,
        ),
        motion=MotionNumbers(
            bearing=nothing,
            turn_duration=nothing,
            start_radius=np.float64(motion.start_radius),
            start_height=np.float64(motion.start_height),
            pendulum_length=np.float64(pendulum.length),
            gravity=np.float64(pendulum.gravity),
            distance=nothing,
            move_duration=nothing,
            wait=nothing,
            drop_distance=np.float64(motion.drop_distance),
            drop_duration=np.float64(motion.drop_duration),
            hold_duration=np.float64(motion.hold_duration),
        ),
        target=TargetNumbers(
            rim_height=np.float64(scenario.cup.rim_height),
            ball_radius=np.float64(scenario.ball.radius),
            string_length=np.float64(scenario.string.length),
            lower=chain.lower,
            upper=chain.upper,
        ),
        gravity=np.float64(scenario.gravity),
        q=np.r_[q_arm, hook_angles(R_WHook), np.zeros(n_joints - 2)],
        v=np.zeros(7 + n_joints),
    )


def stacked(casts: Sequence[CastNumbers]) -> CastNumbers:
    """Return the numbers of several casts, their last axis over casts."""
    numbers: CastNumbers = _map(lambda *values: np.stack(values, axis=-1), *casts)
    return numbers


def _map(function: Any, *trees: Any) -> Any:
    if isinstance(trees[0], tuple):
        return type(trees[0])(*(_map(function, *parts) for parts in zip(*trees, strict=True)))
    return function(*trees)
