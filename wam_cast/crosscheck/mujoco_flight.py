"""Casts in MuJoCo: from the start until the ball has crossed the rim plane, in fixed steps of the fourth order, without contact."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np

from wam_cast.cast import Cast
from wam_cast.crosscheck.mujoco_control import ArmLimits, Control, Law
from wam_cast.crosscheck.mujoco_model import compiled, import_mujoco, robot_mjcf
from wam_cast.errors import InputError
from wam_cast.motion.noise_draws import executed_cast, swing_at_start
from wam_cast.motion.polling import CONTACT_POLL_PERIODS, MAX_BALL_SPEED, MAX_STATE, POLL_PERIODS, SLACK_MARGIN
from wam_cast.motion.stages import CastMotion, Stage
from wam_cast.robot.plant import HOOK, N_ARM
from wam_cast.scenario import Scenario
from wam_cast.types import Array, Position

STABLE_STEP = 1.2
"""Product of fastest rate and step that is kept: the method allows 2.8, and a pulled string is stiffer than a hanging one."""

MOST_STEPS = 1000
"""In a control period."""


@dataclass(frozen=True, eq=False)
class Samples:
    """A simulation's samples, one a control period.

    Attributes
    ----------
    has_diverged
        Whether it ended because its numbers ran away.
    times
        From the start of the turn [s], (n,).
    q, v
        Angles [rad] and their rates [rad/s], (n, n_v) each; the arm's are the first seven.
    torques
        Of the motors [N m], (n, 7): what was held up to each time.
    p_WL, v_WL, p_WE
        Of ball and hand [m], [m/s], (n, 3) each; of the arm alone, the ball's are nan.
    """

    has_diverged: bool
    times: Array
    q: Array
    v: Array
    torques: Array
    p_WL: Array
    v_WL: Array
    p_WE: Array


class Flight(NamedTuple):
    """A cast's contact-free phase, and what follows from where its ball was first seen below the rim plane."""

    motion: CastMotion
    samples: Samples
    n_down: int | None
    """The number of that sample, none if the ball never came down."""
    rest_of_drop: Samples | None
    """Of the arm alone, from there to the end of the drop, if that comes later."""


class Robot:
    """MuJoCo's robot, or its arm alone, and its state.

    Parameters
    ----------
    scenario, step
        What is simulated, and in which steps [s].
    has_ball, cup
        Whether there are string and ball, and where a cup stands, world (x, y) [m], that acts by MuJoCo's own contact.
    """

    def __init__(self, scenario: Scenario, step: float, *, has_ball: bool = True, cup: Position | None = None) -> None:
        self.mujoco = import_mujoco()
        self.model = compiled(robot_mjcf(scenario, step, has_ball=has_ball, cup=cup))
        # Numbers that run away are to be seen, not to start anew from zero.
        self.model.opt.disableflags |= int(self.mujoco.mjtDisableBit.mjDSBL_AUTORESET)
        self.data = self.mujoco.MjData(self.model)
        self.hand = self.model.body("tool_plate").id
        self.ball = self.model.body("ball").id if has_ball else None
        self._motion = np.zeros(6)

    def set_state(self, q: Array, v: Array) -> None:
        """Put the robot there, and find where its bodies are."""
        self.data.qpos[:], self.data.qvel[:] = q, v
        self.find_places()

    def find_places(self) -> None:
        """Find where the bodies are, and how fast: after a step MuJoCo's are those before it."""
        for function in (self.mujoco.mj_kinematics, self.mujoco.mj_comPos, self.mujoco.mj_comVel):
            function(self.model, self.data)

    @property
    def places(self) -> tuple[Array, Array, Array]:
        """p_WL [m], v_WL [m/s] and p_WE [m], (3,) each."""
        p_WE = self.data.xpos[self.hand].copy()
        if self.ball is None:
            return np.full(3, np.nan), np.full(3, np.nan), p_WE
        kind = self.mujoco.mjtObj.mjOBJ_XBODY
        self.mujoco.mj_objectVelocity(self.model, self.data, kind, self.ball, self._motion, 0)
        return self.data.xpos[self.ball].copy(), self._motion[3:].copy(), p_WE

    @property
    def ball_spin(self) -> Array:
        """The ball's angular velocity [rad/s], (3,), where `places` was asked for."""
        return self._motion[:3].copy()

    @property
    def has_diverged(self) -> bool:
        """Whether its numbers run away."""
        state = np.concatenate([self.data.qpos, self.data.qvel])
        # Of the arm alone, the ball's speed is nan.
        return not np.all(np.abs(state) < MAX_STATE) or bool(np.linalg.norm(self.places[1]) > MAX_BALL_SPEED)

    def fastest_rate(self, q: Array) -> float:
        """Return the largest absolute eigenvalue [1/s] of small motions about rest at `q` [rad], without any torque."""
        n, small = self.model.nv, 1e-6
        columns = []
        for change in small * np.vstack([np.zeros(2 * n), np.eye(2 * n)]):
            self.data.qpos[:], self.data.qvel[:] = q + change[:n], change[n:]
            self.mujoco.mj_forward(self.model, self.data)
            columns.append(self.data.qacc.copy())
        slopes = (np.array(columns[1:]) - columns[0]).T / small
        modes = np.linalg.eigvals(np.vstack([np.eye(n, 2 * n, n), slopes]))
        return float(np.abs(modes).max())

    def hanging(self, q_arm: Array) -> Array:
        """Return all angles [rad], the arm's at `q_arm`, the string hanging straight down."""
        q = np.zeros(self.model.nq)
        q[:N_ARM] = q_arm
        if self.ball is not None:
            self.set_state(q, np.zeros(self.model.nv))
            down = -self.data.xmat[self.model.body("string_link0").id].reshape(3, 3)[2]
            # Turned about x by a, then about y by b, the z axis is (sin b, -sin a cos b, cos a cos b).
            q[HOOK] = math.atan2(-down[1], down[2]), math.asin(np.clip(down[0], -1, 1))
        return q


class MujocoSimulator:
    """Simulates casts of one scenario in MuJoCo.

    Parameters
    ----------
    scenario
        What is cast; the controller knows it as it is, but for what no controller knows.
    step
        Of the integration [s], at most; by default the scenario's longest. It is shorter where a stiff string asks for it, and a
        control period has an integer number of them.

    Raises
    ------
    InputError
        If MuJoCo is not installed or cannot simulate the scenario.
    """

    def __init__(self, scenario: Scenario, step: float | None = None) -> None:
        self.scenario, self.limits, self.law = scenario, ArmLimits(scenario), Law(scenario)
        period = scenario.controller.period
        self.robot, self._arm = (Robot(scenario, period, has_ball=has_ball) for has_ball in (True, False))
        # The robot goes to where its encoders read the posture.
        self._q_start = self.robot.hanging(self.law.posture - scenario.arm.encoder_offset)
        longest = min(step or scenario.simulation.max_step, STABLE_STEP / self.robot.fastest_rate(self._q_start))
        self.n_steps = math.ceil(period / longest - 1e-9)
        if self.n_steps > MOST_STEPS:
            raise InputError(
                f"string.n_links = {scenario.string.n_links}, string.bending_damping = {scenario.string.bending_damping:g} N m^2 s:"
                f" MuJoCo's steps would be {longest:.1g} s; compare engines with fewer links or less damping"
            )
        for robot in (self.robot, self._arm):
            robot.model.opt.timestep = period / self.n_steps

    def begin(self, cast: Cast, noise_seed: int, robot: Robot | None = None) -> Control:
        """Put the robot, or another one of the scenario, at the start of `cast`, and return what moves it."""
        scenario = self.scenario
        executed = executed_cast(scenario.noise, cast, noise_seed)
        motion = CastMotion(scenario, executed)
        q, v = self._q_start.copy(), np.zeros(self.robot.model.nv)
        if scenario.noise.swing > 0:
            angles, rates = swing_at_start(scenario, noise_seed)
            q[HOOK] += angles
            v[HOOK] += rates
        (robot or self.robot).set_state(q, v)
        return Control(self.law, self.limits, motion, noise_seed)

    def fly(self, cast: Cast, noise_seed: int = 0) -> Flight:
        """Simulate `cast` until its ball is below the rim plane, or hangs in a taut string, and the arm alone to the drop's end."""
        control, scenario = self.begin(cast, noise_seed), self.scenario
        ends, period = control.motion.stage_ends, scenario.controller.period
        low = scenario.cup.rim_height - scenario.ball.radius
        taut = (1 - SLACK_MARGIN) * scenario.string.length
        n_down, state = None, None

        def is_over(n: int, p_WL: Array, p_WE: Array) -> bool:
            nonlocal n_down, state
            if n_down is None and n > 0 and n % POLL_PERIODS == 0 and p_WL[2] <= scenario.cup.rim_height:
                n_down, state = n, (self.robot.data.qpos[:N_ARM].copy(), self.robot.data.qvel[:N_ARM].copy())
            if n_down is not None and (n - n_down) % CONTACT_POLL_PERIODS == 0:
                return bool(p_WL[2] <= low or np.linalg.norm(p_WL - p_WE) >= taut)
            return n_down is None and n % POLL_PERIODS == 0 and n * period >= ends[Stage.HOLD]

        samples = run(self.robot, control, period, self.n_steps, is_over)
        rest = None
        if n_down is not None and state is not None and n_down * period < ends[Stage.DROP]:
            self._arm.set_state(*state)
            last = math.floor(ends[Stage.DROP] / period + 1e-9)
            rest = run(self._arm, control, period, self.n_steps, lambda n, *_: n >= last, first=n_down)
        return Flight(control.motion, samples, n_down, rest)


def run(
    robot: Robot,
    control: Control,
    period: float,
    n_steps: int,
    is_over: Callable[[int, Array, Array], bool],
    *,
    first: int = 0,
    advance: Callable[[int], Any] | None = None,
) -> Samples:
    """Simulate from sample number `first` on until `is_over` of a sample's number, p_WL and p_WE, or the numbers run away.

    `advance` brings the robot from one sample to the next, by default in `n_steps` steps of MuJoCo's own.
    """
    data = robot.data
    rows: list[tuple[Array, ...]] = []
    n, has_diverged, torque = first, False, None
    with _quiet(robot.mujoco):
        while not has_diverged:
            q, v, places = data.qpos.copy(), data.qvel.copy(), robot.places
            wanted = control.torque(n, q[:N_ARM], v[:N_ARM])
            rows.append((np.array(n * period), q, v, wanted if torque is None else torque, *places))
            if is_over(n, places[0], places[2]):
                break
            torque = data.ctrl[:N_ARM] = wanted
            if advance is None:
                robot.mujoco.mj_step(robot.model, data, n_steps)
            else:
                advance(n)
            n += 1
            robot.find_places()
            has_diverged = robot.has_diverged
    return Samples(has_diverged, *(np.array(column) for column in zip(*rows, strict=True)))


@contextmanager
def _quiet(mujoco: Any) -> Iterator[None]:
    """Keep MuJoCo from writing of numbers that run away into a file where it is called."""
    before = mujoco.get_mju_user_warning()
    mujoco.set_mju_user_warning(lambda _text: None)
    try:
        yield
    finally:
        mujoco.set_mju_user_warning(before)
