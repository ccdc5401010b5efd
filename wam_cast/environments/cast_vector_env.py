"""CastVectorEnv: `wam_cast/Cast-v0` many times over, by the batched engine, with a hit told from the landing."""

from __future__ import annotations

from typing import Any, ClassVar

import numpy as np
import pandas as pd
from gymnasium.vector import AutoresetMode, VectorEnv
from gymnasium.vector.utils import batch_space
from numpy.typing import ArrayLike, NDArray

from wam_cast.batch.arguments import Precision
from wam_cast.batch.engine import simulate_batch
from wam_cast.cast import Cast
from wam_cast.casting_plane import from_casting_plane
from wam_cast.environments.cast_task import N_NOISE_SEEDS, RADII, CastTask, reward
from wam_cast.errors import InputError, checked_integer, quoted
from wam_cast.scenario import Scenario
from wam_cast.types import Array, checks_types


class CastVectorEnv(VectorEnv[Array, Array, Array]):
    """Cups are seen, a cast is made for each, and every episode ends: `.CastEnv` without the contact of ball and cup.

    The batched engine simulates up to the landing alone. A cast is a hit, `is_success`, if the ball's centre comes down through the
    cup's opening: through the rim plane no farther from the cup's axis than its inner radius (30 mm in the reference scenario), in
    a slack string, and the arm meets no limit. What the rim makes of a ball that touches it is not seen: `.CastEnv` has the
    physical verdict, which in a nearly inelastic cup is almost always the same.

    Observations, actions and rewards are those of `.CastEnv`, shapes (n, 2), (n, 4) and (n,). Since every step ends all episodes,
    the next ones begin in the same step (`AutoresetMode.SAME_STEP`): `step` returns the next cups, and in `info` `final_obs` has
    the cups that were cast at, `final_info` arrays of `is_success`, `status`, `miss` [m], `landing` (n, 2) [m] and `cast` (n, 4).

    Parameters
    ----------
    num_envs
        How many casts a step is; 64 or more make the most of a processor, thousands of a GPU.
    scenario, radii
        As of `.CastEnv`.
    precision
        Of the engine, `float64` or `float32`, which takes half the time.

    Raises
    ------
    InputError
        If an argument is not as described.
    """

    metadata: ClassVar[dict[str, Any]] = {"autoreset_mode": AutoresetMode.SAME_STEP, "render_modes": []}

    @checks_types
    def __init__(
        self,
        num_envs: int = 1,
        scenario: Scenario | None = None,
        *,
        radii: tuple[float, float] = RADII,
        precision: Precision = "float64",
        render_mode: str | None = None,
    ) -> None:
        if render_mode is not None:
            raise InputError(
                f"render_mode = {quoted(render_mode)}: the vector environment shows nothing; make one alone"
            )
        self.num_envs = checked_integer("num_envs", num_envs, 1)
        self._task, self._precision = CastTask(scenario or Scenario(), radii), precision
        self.single_observation_space, self.single_action_space = self._task.cup_space, self._task.cast_space
        self.observation_space = batch_space(self.single_observation_space, self.num_envs)
        self.action_space = batch_space(self.single_action_space, self.num_envs)
        self._cups = np.zeros((0, 2))

    def reset(self, *, seed: int | None = None, options: dict[str, Any] | None = None) -> tuple[Array, dict[str, Any]]:
        """Stand a cup for each on the floor, drawn or all as `options={"cup": (x, y)}` says [m]."""
        super().reset(seed=seed)
        cup = self._task.cup_of(options)
        self._cups = self._drawn_cups() if cup is None else np.tile(cup, (self.num_envs, 1))
        return self._cups.copy(), {}

    def _drawn_cups(self) -> Array:
        return np.array([self._task.draw_cup(self.np_random) for _ in range(self.num_envs)])

    def step(self, actions: ArrayLike) -> tuple[Array, Array, NDArray[np.bool_], NDArray[np.bool_], dict[str, Any]]:
        """Make a cast for each cup, and stand the next cups on the floor."""
        if not len(self._cups):
            raise InputError("step: there are no cups yet; call reset() first")
        casts = self._casts(actions)
        seeds = self.np_random.integers(N_NOISE_SEEDS, size=self.num_envs)
        frame = simulate_batch(self._task.scenario, casts, seeds, self._precision)
        final = self._judged(casts, frame)
        counted = np.where(final["status"] == "landed", final["miss"], np.nan)
        worth = np.array([reward(*of) for of in zip(final["is_success"], counted, strict=True)])
        everywhere = np.ones(self.num_envs, dtype=bool)
        infos = {
            "final_obs": self._cups,
            "_final_obs": everywhere,
            "final_info": final,
            "_final_info": everywhere.copy(),
        }
        self._cups = self._drawn_cups()
        return self._cups.copy(), worth, everywhere.copy(), np.zeros(self.num_envs, dtype=bool), infos

    def _casts(self, actions: ArrayLike) -> list[Cast]:
        rows = np.asarray(actions, dtype=float)
        if rows.shape != (self.num_envs, 4):
            raise InputError(f"actions: of shape {rows.shape}, must be {(self.num_envs, 4)}")
        return [self._task.cast(row) for row in rows]

    def _judged(self, casts: list[Cast], frame: pd.DataFrame) -> dict[str, Any]:
        """Return what is told of casts, arrays over them."""
        scenario = self._task.scenario
        landing = self._landings(casts, frame)
        miss = np.linalg.norm(landing - self._cups - scenario.cup.offset, axis=1)
        is_free = (frame["status"] == "landed").to_numpy() & frame["is_slack"].to_numpy()
        is_hit = is_free & (miss <= scenario.cup.inner_radius)
        return {
            "is_success": is_hit,
            "status": frame["status"].to_numpy(dtype=str),
            "miss": miss,
            "landing": landing,
            "cast": np.array([[*cast.to_array(), cast.bearing] for cast in casts]),
        }

    @staticmethod
    def _landings(casts: list[Cast], frame: pd.DataFrame) -> Array:
        """Return world (x, y) [m] of the landings, (n, 2)."""
        places = frame[["landing_along", "landing_across"]].to_numpy(dtype=float)
        return np.array([from_casting_plane(x, y, cast.bearing) for (x, y), cast in zip(places, casts, strict=True)])
