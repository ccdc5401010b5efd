"""What is handed to the batched engine, checked."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, Literal, get_args

import numpy as np
from numpy.typing import ArrayLike

from wam_cast.cast import Cast
from wam_cast.errors import InputError, checked_integer, quoted
from wam_cast.scenario import Scenario

Precision = Literal["float64", "float32"]


def checked_precision(precision: str) -> None:
    """Raise `.InputError` unless it is one."""
    if precision not in get_args(Precision):
        raise InputError(f"precision = {quoted(precision)} must be float64 or float32")


def checked_casts(casts: ArrayLike | Sequence[Cast]) -> list[Cast]:
    """Return the casts of an array, or as they are. Raises `.InputError`."""
    if isinstance(casts, Sequence) and casts and all(isinstance(one, Cast) for one in casts):
        return list(casts)
    try:
        values = np.asarray(casts, dtype=float)
    except (TypeError, ValueError):
        raise InputError(
            f"casts = {quoted(casts)} must be Casts, or an array of shape (n, 3), or (n, 4) with a bearing for each"
        ) from None
    if values.size == 0:
        return []
    if values.ndim != 2 or values.shape[1] not in (3, 4):
        raise InputError(
            f"casts: an array of shape {values.shape}; give [distance, speed, wait] or with the bearing, (n, 3) or (n, 4)"
        )
    return [Cast(*(float(value) for value in row)) for row in values]


def checked_scenarios(scenario: Scenario | Sequence[Scenario], n: int) -> list[Scenario]:
    """Return a scenario for each of `n` casts. Raises `.InputError`."""
    scenarios = [scenario] * n if isinstance(scenario, Scenario) else list(scenario)
    if len(scenarios) != n:
        raise InputError(f"scenario: {len(scenarios)} scenarios for {n} casts; give one, or one for each cast")
    for one in scenarios:
        if not isinstance(one, Scenario):
            raise InputError(f"scenario = {quoted(one)} must be a Scenario")
    links = sorted({one.string.n_links for one in scenarios})
    if len(links) > 1:
        raise InputError(
            f"scenario: strings of {', '.join(map(str, links))} links; those of one batch must have the same string.n_links"
        )
    return scenarios


def checked_seeds(noise_seeds: Any, n: int) -> list[int]:
    """Return a noise seed for each of `n` casts. Raises `.InputError`."""
    try:
        seeds = [0] * n if noise_seeds is None else list(noise_seeds)
    except TypeError:
        raise InputError(f"noise_seeds = {quoted(noise_seeds)} must be integers from 0 on, one for each cast") from None
    if len(seeds) != n:
        raise InputError(f"noise_seeds: {len(seeds)} seeds for {n} casts; give one for each cast, or none at all")
    return [checked_integer("noise_seed", seed, 0) for seed in seeds]
