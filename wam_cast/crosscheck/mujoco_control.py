"""The control law of docs/controller.md on MuJoCo's kinematics, and all between its encoders and its motors, sample by sample."""

from __future__ import annotations

import numpy as np

from wam_cast.arm.arm_chain import DIFFERENTIALS, arm_chain, encoder_resolution
from wam_cast.arm.arm_model import arm_model
from wam_cast.arm.posture import starting_posture
from wam_cast.crosscheck.mujoco_model import believed_arm_mjcf, compiled, import_mujoco
from wam_cast.motion.noise_draws import torque_deviates
from wam_cast.motion.stages import CastMotion
from wam_cast.robot.plant import N_ARM
from wam_cast.scenario import Scenario
from wam_cast.types import Array


class ArmLimits:
    """What the motors give at most, and how much of it is used: see docs/controller.md, written again for MuJoCo."""

    def __init__(self, scenario: Scenario) -> None:
        self.chain = arm_chain(scenario.arm)
        self._knee = scenario.arm.knee_speed

    def utilization(self, values: Array, limits: Array) -> Array:
        """Return the utilization of each joint's motors, (..., 7): the joints of a differential load the same two."""
        own = np.abs(values) / limits
        used = own.copy()
        for a, b in DIFFERENTIALS:
            used[..., a] = used[..., b] = own[..., a] + own[..., b]
        return used

    def torque_at(self, v: Array, torque: Array) -> Array:
        """Return the limits [N m] at joint velocities `v` [rad/s] of torques with the signs of `torque`, (..., 7) each."""
        if self._knee == 1:
            return self.chain.torque_limits
        left = np.clip((1 - self.utilization(v, self.chain.velocity_limits)) / (1 - self._knee), 1e-6, 1)
        return np.asarray(np.where(torque * v > 0, left, 1.0) * self.chain.torque_limits)


class Law:
    """The law u = J^T (u_x - (J J^T)^-1 J u_n) + u_n + g(q), with the posture's torque u_n, by the controller's own arm.

    Attributes
    ----------
    scenario
        Of the robot as the controller knows it.
    posture
        Of the arm at the start of a cast [rad], (7,).
    """

    def __init__(self, scenario: Scenario) -> None:
        self._mujoco = import_mujoco()
        self.scenario = scenario
        self._model = compiled(believed_arm_mjcf(scenario))
        self._data = self._mujoco.MjData(self._model)
        self._hand = self._model.body("tool_plate").id
        self._turn = arm_model(scenario.arm).joint_1_turn
        self.posture = starting_posture(scenario)

    def torque(self, motion: CastMotion, time: float, q: Array, v: Array) -> Array:
        """Return what is wanted of the motors [N m], (7,), at a `time` [s] of the motion, of an arm measured at `q` and `v`."""
        gains = self.scenario.controller
        p_WE, J, gravity = self.kinematics(q)
        p_WE_desired, v_WE_desired = motion.evaluate(time)
        u_x = gains.kp * (p_WE_desired - p_WE) + gains.kd * (v_WE_desired - J @ v)
        q_desired, v_desired = self.posture.copy(), np.zeros(N_ARM)
        bearing, rate = motion.bearing(time)
        q_desired[0], v_desired[0] = self._turn * bearing, self._turn * rate
        u_n = gains.posture_stiffness * (q_desired - q) + gains.posture_damping * (v_desired - v)
        # Least squares: of a straight arm J J^T has no inverse.
        return np.asarray(J.T @ (u_x - np.linalg.lstsq(J.T, u_n, rcond=None)[0]) + u_n + gravity)

    def kinematics(self, q: Array) -> tuple[Array, Array, Array]:
        """Return p_WE [m], (3,), Jv_WE, (3, 7), and the torque that carries the arm [N m], (7,)."""
        mj, model, data = self._mujoco, self._model, self._data
        data.qpos[:] = q  # the velocities stay zero
        for function in (mj.mj_kinematics, mj.mj_comPos, mj.mj_comVel):
            function(model, data)
        gravity, J = np.empty(N_ARM), np.empty((3, N_ARM))
        mj.mj_rne(model, data, 0, gravity)
        mj.mj_jacBody(model, data, J, None, self._hand)
        return data.xpos[self._hand].copy(), J, gravity


class Control:
    """What stands between the arm's state and its motors' torque in one cast, asked once a control period.

    Parameters
    ----------
    law, limits
        Of the controller, and of the arm.
    motion, noise_seed
        Of the cast.
    """

    def __init__(self, law: Law, limits: ArmLimits, motion: CastMotion, noise_seed: int) -> None:
        self._law, self._limits, self.motion, self._noise_seed = law, limits, motion, noise_seed
        self._scenario = law.scenario
        self._count = encoder_resolution(limits.chain, self._scenario.noise.encoder_counts)
        self._wanted: dict[int, Array] = {}

    def torque(self, sample: int, q: Array, v: Array) -> Array:
        """Return what the motors give [N m], (7,), from this sample on, with the arm at `q` [rad], `v` [rad/s].

        Samples count from 0, and are asked for in order; what was asked for last holds.
        """
        scenario, limits = self._scenario, self._limits
        time = sample * scenario.controller.period
        self._wanted[sample] = self._law.torque(self.motion, time, *self._measured(q, v))
        # Before the start it has wanted the first one ever since.
        commanded = self._wanted[max(sample - scenario.controller.delay, 0)]
        scale = np.array(scenario.arm.torque_scale)
        if scenario.noise.torque > 0:
            deviation = scenario.noise.torque * limits.chain.torque_limits / scale
            commanded = commanded + deviation * torque_deviates(self._noise_seed, sample)
        used = limits.utilization(commanded, limits.torque_at(v, commanded) / scale)
        return np.asarray(scale * commanded / np.maximum(used, 1.0))

    def _measured(self, q: Array, v: Array) -> tuple[Array, Array]:
        """Return what the encoders say of the arm: off, and in integer counts if they count."""
        q = q + self._scenario.arm.encoder_offset
        if not np.any(self._count):
            return q, v
        rate = self._count / self._scenario.controller.period
        return np.rint(q / self._count) * self._count, np.rint(v / rate) * rate
