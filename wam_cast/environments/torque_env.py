"""CastTorqueEnv, `wam_cast/CastTorque-v0`: the arm moved by its motors, a control period a step, and the ball judged by contact."""

from __future__ import annotations

from typing import Any, Literal

import numpy as np
from gymnasium import Env
from gymnasium.error import ResetNeeded
from gymnasium.spaces import Box
from numpy.typing import ArrayLike, NDArray

from wam_cast.cast import default_cast
from wam_cast.environments.action_loop import ActionLoop, torque_itself, torque_of_force
from wam_cast.environments.cast_task import N_NOISE_SEEDS, RADII, CastTask, checked_action
from wam_cast.environments.stage_view import FRAME_RATE, RENDER_MODES, StageView, checked_render_mode
from wam_cast.errors import InputError, quoted
from wam_cast.motion.polling import CONTACT_POLL_PERIODS
from wam_cast.robot.motors import motor_utilization
from wam_cast.robot.plant import N_ARM
from wam_cast.scenario import Scenario
from wam_cast.simulation.contact import BallWatch
from wam_cast.simulation.station_loop import DivergedError
from wam_cast.types import Array, checks_types

Action = Literal["torque", "force"]

LAWS = {"torque": torque_itself, "force": torque_of_force}

FORCE = 200.0
"""The largest force of the hand along an axis [N]; what the motors cannot give of it they cut off."""

WORTH = {"": 0.0, "missed": 0.0, "caught": 1.0}
BREACH = -1.0
"""What is added to a step's reward by why it ends the episode; `BREACH` for a limit met or a simulation that diverged."""

ROOM = 3.0
"""Observed positions of the ball are within this of the origin along each axis [m]."""

FASTEST = 20.0
"""Observed velocities of the ball are within this along each axis [m/s]."""

BEYOND = 1.5
"""Observed joint angles and velocities are within so many times the limits."""


METADATA: dict[str, Any] = {"render_modes": list(RENDER_MODES), "render_fps": 500}


class CastTorqueEnv(Env[Array, Array]):
    """The motors are told what to give in each control period, and the ball is to come to rest in the cup.

    Observation, in this order: q [rad] (7) and v [rad/s] (7) of the arm as the encoders read them, world (x, y) [m] of the cup's
    axis, and, unless `observes_ball` is false, p_WL [m] (3) and v_WL [m/s] (3) of the ball. It is clipped to its space, which an
    arm within its limits never leaves.

    Action: joint torques, shape (7,), from -1 to 1 of the motors' peaks, with nothing added: zeros let the arm fall. With
    `action="force"` a force of the hand, shape (3,), world frame, from -1 to 1 of 200 N, while the arm's weight is carried and its
    posture kept as `.CastController` does. Either is held for a control period, 2 ms in the reference scenario, and passes the
    scenario's delay, noise and motors.

    Reward: by how many metres the ball came nearer to where it would rest in the cup; over an episode that adds up to its first
    distance less its last one. The last step adds 1 for a catch, and -1 if a limit is met or the simulation diverges.

    An episode terminates when the ball rests in the cup, carried by it (`is_success`); when it lies on the floor or on the cup's
    stand; when a joint leaves its range or its velocity limit; or when the simulation diverges. `info["reason"]` says which:
    `caught`, `missed`, such as `joint 4 speed`, `diverged`, and is empty until then. `gymnasium.make` truncates an episode after
    2,500 steps. `info` has `is_success`, `reason` and `time` [s].

    Parameters
    ----------
    scenario, radii
        As of `.CastEnv`; the initial swing and the noise of torques are drawn anew in each episode.
    action
        `torque` or `force`.
    observes_ball
        Whether the ball is observed.
    render_mode
        `rgb_array`: `render` returns a picture. `human`: a browser's page shows it, no faster than in real time.
    """

    metadata: dict[str, Any] = METADATA

    @checks_types
    def __init__(
        self,
        scenario: Scenario | None = None,
        *,
        radii: tuple[float, float] = RADII,
        action: Action = "torque",
        observes_ball: bool = True,
        render_mode: str | None = None,
    ) -> None:
        if action not in LAWS:
            raise InputError(f"action = {quoted(action)} must be torque or force")
        self.render_mode = checked_render_mode(render_mode)
        scenario = scenario or Scenario()
        self._task, self._observes_ball = CastTask(scenario, radii), observes_ball
        self._loop = loop = ActionLoop(scenario, LAWS[action])
        self._lower, self._upper = (
            limits[:N_ARM] for limits in (loop.plant.GetPositionLowerLimits(), loop.plant.GetPositionUpperLimits())
        )
        self._speed_limits = loop.plant.GetVelocityUpperLimits()[:N_ARM]
        self._most = loop.station.motors.limits if action == "torque" else np.full(3, FORCE)
        self.action_space = Box(-1.0, 1.0, self._most.shape, np.float64)
        self.observation_space = self._space()
        self.metadata = {**METADATA, "render_fps": round(1 / loop.period)}
        self._view = StageView(scenario, self.render_mode)
        self._steps_per_frame = max(round(1 / FRAME_RATE / loop.period), 1) if self.render_mode == "human" else 1
        self._watch: BallWatch | None = None

    def _space(self) -> Box:
        q, v = BEYOND * np.maximum(-self._lower, self._upper), BEYOND * self._speed_limits
        ball = [np.full(3, ROOM), np.full(3, FASTEST)] if self._observes_ball else []
        high = np.concatenate([q, v, self._task.cup_space.high, *ball])
        return Box(-high, high, dtype=np.float64)

    def reset(self, *, seed: int | None = None, options: dict[str, Any] | None = None) -> tuple[Array, dict[str, Any]]:
        """Put the arm at home with the ball hanging, and a cup on the floor, drawn or as `options={"cup": (x, y)}` says [m]."""
        super().reset(seed=seed)
        scenario = self._task.scenario
        self._cup = self._task.cup_of(options) or self._task.draw_cup(self.np_random)
        place = scenario.place_of_cup(self._cup)
        # The arm's own motion is of no consequence: it says where a cast begins.
        at_home = self._loop.station.executed_motion(default_cast(scenario))
        self._loop.begin(at_home, place, noise_seed=int(self.np_random.integers(N_NOISE_SEEDS)))
        self._watch, self._n_steps = BallWatch(self._loop, place), 0
        self._p_WRest = np.array([*place, scenario.cup.bottom_height + scenario.ball.radius])
        self._see()
        self._view.begin(self._cup)
        return self._observation.copy(), self._info("")

    def step(self, action: ArrayLike) -> tuple[Array, float, bool, bool, dict[str, Any]]:
        """Hold an action for a control period."""
        if self._watch is None:
            raise ResetNeeded("the episode is over, or has not begun: call reset() before step()")
        distance, told = self._distance, self._most * checked_action(action, self.action_space)
        self._n_steps += 1
        try:
            self._loop.step(told)
            if self._n_steps % CONTACT_POLL_PERIODS == 0:
                self._watch.poll()
            self._see()
            reason = self._reason(self._watch)
        except DivergedError:
            reason = "diverged"
        if reason:
            self._watch = None
        if self._n_steps % self._steps_per_frame == 0:
            self._view.put(self._loop.state_of_plant)
        worth = distance - self._distance + WORTH.get(reason, BREACH)
        return self._observation.copy(), worth, bool(reason), False, self._info(reason)

    def _see(self) -> None:
        """Note what is observed now, and how far the ball is from where it would rest."""
        p_WL, v_WL = self._loop.ball()
        seen = [self._loop.measured(), np.array(self._cup), *([p_WL, v_WL] if self._observes_ball else [])]
        self._observation = np.clip(np.concatenate(seen), self.observation_space.low, self.observation_space.high)
        self._distance = float(np.linalg.norm(p_WL - self._p_WRest))

    def _reason(self, watch: BallWatch) -> str:
        """Return why the episode ends now, or an empty text."""
        q, v = self._loop.arm()
        outside = (q < self._lower) | (q > self._upper)
        too_fast = motor_utilization(v, self._speed_limits) > 1
        for what, over in (("position", outside), ("speed", too_fast)):
            if over.any():
                return f"joint {int(np.argmax(over)) + 1} {what}"
        return "caught" if watch.is_caught else "missed" if watch.lies_outside else ""

    def _info(self, reason: str) -> dict[str, Any]:
        time = self._n_steps * self._loop.period
        return {"is_success": reason == "caught", "reason": reason, "time": time}

    def render(self) -> NDArray[np.uint8] | None:
        """Return a picture, shape (height, width, 3), in the mode `rgb_array`; in `human` the page shows what there is."""
        return self._view.render()

    def close(self) -> None:
        """Let go of what was shown."""
        self._view.close()
