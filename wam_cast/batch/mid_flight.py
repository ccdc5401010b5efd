"""States in the middle of casts, for Drake to go on with: it knows what a ball does in a cup."""

from __future__ import annotations

import math
from collections.abc import Sequence
from functools import cache
from typing import Any

import numpy as np

from wam_cast.batch.compilation import compiled_by_jax
from wam_cast.batch.engine import Batch, double, filled_up, simulate_batch
from wam_cast.batch.flight import fly_to
from wam_cast.cast import Cast
from wam_cast.motion.in_flight import InFlight
from wam_cast.motion.polling import POLL_PERIODS
from wam_cast.motion.turn import turn_duration
from wam_cast.scenario import Scenario
from wam_cast.types import checks_types

HAND_OVER = 0.15
"""How long before the crossing of the rim plane a state is told [s]: the ball is far from any cup that it may meet then."""


@checks_types
def states_before_landing(
    scenario: Scenario, casts: Sequence[Cast], noise_seeds: Sequence[int], *, belief: Scenario | None = None
) -> list[InFlight | None]:
    """Return each cast, as `.simulate_batch` simulates it, at a poll of the ball `HAND_OVER` or a little more before it lands.

    None of casts of which there is no such state: they do not land, meet a limit of the arm or diverge.
    """
    found = simulate_batch(scenario, casts, noise_seeds, belief=belief)
    period, samples = scenario.controller.period, {}
    for i, cast in enumerate(casts):
        crossing = found["crossing_time"][i] + turn_duration(scenario, cast.bearing)
        sample = POLL_PERIODS * math.floor((crossing - HAND_OVER) / (POLL_PERIODS * period)) if crossing > 0 else 0
        if found["status"][i] == "landed" and sample > 0:
            samples[i] = sample
    states: list[InFlight | None] = [None] * len(casts)
    if samples:
        batch = Batch.of([scenario] * len(casts), list(casts), list(noise_seeds), "float64", belief)
        for which, chunk in batch.chunks(list(samples)):
            wanted = np.array([samples[i] for i in filled_up(which, chunk.size)])
            with double("float64"):
                q, v, waiting, torque = map(np.asarray, _compiled()(*chunk.arguments, wanted))
            for column, i in enumerate(which):
                at = (values[..., column] for values in (q, v, waiting, torque))
                states[i] = InFlight(samples[i] * period, *at)
    return states


@cache
def _compiled() -> Any:
    return compiled_by_jax(fly_to)
