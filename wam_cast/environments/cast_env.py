"""CastEnv, `wam_cast/Cast-v0`: one decision an episode, judged by Drake with contact."""

from __future__ import annotations

from functools import cached_property
from typing import Any, ClassVar

import numpy as np
from gymnasium import Env
from gymnasium.error import ResetNeeded
from numpy.typing import ArrayLike, NDArray

from wam_cast.cast import Cast
from wam_cast.environments.cast_task import N_NOISE_SEEDS, RADII, CastTask, reward
from wam_cast.environments.stage_view import RENDER_MODES, StageView, checked_render_mode
from wam_cast.scenario import Scenario
from wam_cast.simulation.recording import CastRecording
from wam_cast.simulation.simulator import CastSimulator
from wam_cast.types import Array, Position, checks_types


class CastEnv(Env[Array, Array]):
    """A cup is seen, one cast is made, and the episode ends.

    Observation: world (x, y) [m] of the cup's axis, shape (2,); the same before and after the cast.

    Action: distance, speed, wait and bearing, shape (4,), each from -1 to 1, onto all casts that the scenario's bounds allow and
    all bearings that joint 1 turns to. It is linear but for the speed, whose range ends where the move would be too short.
    `env.unwrapped.cast(action)` is the `.Cast` of an action, `env.unwrapped.action(cast)` the action of a cast.

    Reward, from -1 to 1: 1 if the ball is caught, less the distance [m] of its landing from the cup's axis, of at most 1; that
    distance counts as 1 if the ball does not land, a limit of the arm is met, or the simulation diverges.

    Every episode terminates after its step; none is truncated. `info` has `is_success` (caught: the ball rests in the cup,
    carried by it), `status` (a `.Status`), `miss` [m], `landing` (2,) [m] and `cast`, `[distance, speed, wait, bearing]` [m, m/s,
    s, rad].

    Parameters
    ----------
    scenario
        What is cast with; its noise is drawn anew in each episode from the environment's generator. By default the reference.
    radii
        The smallest and the largest distance of a cup from the base axis [m]. Distances and bearings, of all that joint 1 turns
        to, are evenly distributed; `reset(options={"cup": (x, y)})` puts the cup in one place.
    render_mode
        `rgb_array`: `render` returns a picture of the arm before the cast, of its end after it. `human`: `step` plays the cast in a
        browser's page in real time. By default neither.
    """

    metadata: ClassVar[dict[str, Any]] = {"render_modes": list(RENDER_MODES), "render_fps": 1}

    @checks_types
    def __init__(
        self, scenario: Scenario | None = None, *, radii: tuple[float, float] = RADII, render_mode: str | None = None
    ) -> None:
        self.render_mode = checked_render_mode(render_mode)
        self._task = CastTask(scenario or Scenario(), radii)
        self.observation_space, self.action_space = self._task.cup_space, self._task.cast_space
        self._cup: Position | None = None
        self._noise_seed, self._is_over = 0, True
        self._view = StageView(self._task.scenario, self.render_mode)

    def cast(self, action: ArrayLike) -> Cast:
        """Return the cast that an action, shape (4,), asks for. Raises `.InputError` if it is none."""
        return self._task.cast(action)

    def action(self, cast: Cast) -> Array:
        """Return the action, shape (4,), that asks for a cast; that of the nearest one if it is not allowed."""
        return self._task.action(cast)

    @cached_property
    def _simulator(self) -> CastSimulator:
        return CastSimulator(self._task.scenario)

    def reset(self, *, seed: int | None = None, options: dict[str, Any] | None = None) -> tuple[Array, dict[str, Any]]:
        """Stand a cup on the floor, drawn or as `options={"cup": (x, y)}` says [m], and let the ball hang."""
        super().reset(seed=seed)
        self._cup = self._task.cup_of(options) or self._task.draw_cup(self.np_random)
        self._noise_seed, self._is_over = int(self.np_random.integers(N_NOISE_SEEDS)), False
        self._view.begin(self._cup)
        return np.array(self._cup), {}

    def step(self, action: Array) -> tuple[Array, float, bool, bool, dict[str, Any]]:
        """Make a cast, and end the episode."""
        if self._cup is None or self._is_over:
            raise ResetNeeded("an episode of wam_cast/Cast-v0 is one step: call reset() before each step()")
        cast = self._task.cast(action)
        self._is_over = True
        if self.render_mode is None:
            outcome = self._simulator.simulate(cast, self._cup, noise_seed=self._noise_seed)
        else:
            recording = self._simulator.record(cast, self._cup, noise_seed=self._noise_seed, returns=False)
            outcome = recording.outcome
            self._show(recording)
        info = {
            "is_success": outcome.is_caught,
            "status": str(outcome.status),
            "miss": outcome.miss,
            "landing": outcome.landing.copy(),
            "cast": np.array([*cast.to_array(), cast.bearing]),
        }
        is_broken = bool(outcome.limits_hit)
        worth = reward(outcome.is_caught, np.nan if is_broken else outcome.miss)
        return np.array(self._cup), worth, True, False, info

    def _show(self, recording: CastRecording) -> None:
        """Play a cast, or keep its end."""
        if self.render_mode == "human":
            self._view.play(recording.times, recording.states)
        else:
            self._view.put(recording.states[-1])

    def render(self) -> NDArray[np.uint8] | None:
        """Return a picture, shape (height, width, 3), in the mode `rgb_array`; in `human` the page shows what there is."""
        return self._view.render()

    def close(self) -> None:
        """Let go of what was shown."""
        self._view.close()
