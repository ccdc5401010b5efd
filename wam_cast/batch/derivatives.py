"""Derivatives of landings by what casts and scenarios say: exact through the flight, by JAX's forward mode."""

from __future__ import annotations

import re
from collections.abc import Callable, Sequence
from dataclasses import replace
from functools import cache
from typing import Any

import jax
import numpy as np
import pandas as pd
from numpy.typing import ArrayLike
from pydantic import BaseModel

from wam_cast.batch.arguments import checked_casts, checked_seeds
from wam_cast.batch.compilation import compiled_by_jax
from wam_cast.batch.engine import Batch, Chunk, double, filled_up, tell
from wam_cast.batch.landing import Landing
from wam_cast.batch.numbers import CastNumbers, numbers, stacked
from wam_cast.cast import Cast
from wam_cast.errors import InputError, quoted
from wam_cast.scenario import Scenario
from wam_cast.types import checks_types

QUANTITIES = ("landing_along", "landing_across", "crossing_time", "entry_speed", "entry_angle")

RELATIVE_STEP = 1e-5
"""Of a parameter, over which its effect on a flight's numbers is taken: they are smooth, and almost linear."""

SMALL = 1e-3
"""Parameters that are smaller count as this."""

NAME = re.compile(r"([a-z_]+)(?:\.([a-z_]+))?(?:\[([0-9]+)\])?")
"""A number's name: its part of the scenario, its own, and a joint."""

OF_NO_FLIGHT = ("simulation", "bounds", "noise", "cameras")
"""Parts of a scenario whose numbers a flight does not follow smoothly, or not at all."""

OF_THE_CAST = ("distance", "speed", "wait", "bearing")


@checks_types
def batch_derivatives(
    scenario: Scenario,
    casts: ArrayLike,
    parameters: Sequence[str],
    noise_seeds: Sequence[int] | None = None,
    *,
    belief: Scenario | None = None,
) -> dict[str, pd.DataFrame]:
    """Return the derivatives of landings, entry and crossing time by numbers of the cast and of the scenario.

    Parameters
    ----------
    scenario, casts, noise_seeds, belief
        As of `.simulate_batch`; one scenario. Where there is no belief, the controller is told of a changed scenario too.
    parameters
        `"distance"`, `"speed"`, `"wait"`, `"bearing"`, or a number of the scenario by its name: `"string.length"`, `"gravity"`,
        `"controller.kp"`; of what is by joint one, from 1 on, or all at once: `"arm.mass_scale[4]"`, `"arm.coulomb_friction"`.
        What a turn takes is rounded to control periods, and taken as constant.

    Returns
    -------
    dict of str to pandas.DataFrame
        For each parameter the derivatives of `landing_along`, `landing_across` [m], `crossing_time` [s], `entry_speed` [m/s] and
        `entry_angle` [rad], a row a cast; nan where the ball does not come down.

    Raises
    ------
    InputError
        As of `simulate_batch`, and if a parameter is none.
    """
    made = checked_casts(casts)
    seeds = checked_seeds(noise_seeds, len(made))
    ways = {name: _direction(scenario, name) for name in parameters}
    # Each cast once for each parameter: few casts with many parameters fill chunks as many casts do.
    each = [(way, cast, seed) for way in ways.values() for cast, seed in zip(made, seeds, strict=True)]
    found = np.full((len(each), len(QUANTITIES)), np.nan)
    if each:
        batch = Batch.of([scenario] * len(each), made * len(ways), seeds * len(ways), "float64", belief)
        for which, chunk in batch.chunks():
            tangents = stacked([_tangent(*each[i], belief) for i in filled_up(which, chunk.size)])
            found[which] = _derivative(chunk, tangents)[: len(which)]
    by_name = zip(ways, found.reshape(len(ways), len(made), len(QUANTITIES)), strict=True)
    return {name: pd.DataFrame(values, columns=QUANTITIES) for name, values in by_name}


Change = Callable[[Cast, float], tuple[Scenario, Cast]]


def _direction(scenario: Scenario, name: str) -> tuple[Change, float]:
    """Return what gives scenario and cast with a parameter changed by so much, and by how much to change it."""
    if name in OF_THE_CAST:
        return lambda cast, by: (scenario, replace(cast, **{name: getattr(cast, name) + by})), RELATIVE_STEP
    found = NAME.fullmatch(name)
    part, field, joint = found.groups("") if found else ("", "", "")
    holder = getattr(scenario, part, None) if field else scenario
    key = field or part
    value = getattr(holder, key) if isinstance(holder, BaseModel) and key in type(holder).model_fields else None
    values = np.array(value if isinstance(value, tuple) else [value])
    joints = {"", *(str(i) for i in range(1, len(values) + 1) if isinstance(value, tuple))}
    if values.dtype.kind != "f" or joint not in joints or part in OF_NO_FLIGHT:
        raise InputError(
            f"parameter {quoted(name)}: name {', '.join(OF_THE_CAST)}, or a number of the scenario outside of "
            f"{', '.join(OF_NO_FLIGHT)}, such as string.length or arm.mass_scale[4]"
        )
    moves = np.array([joint in ("", str(i)) for i in range(1, len(values) + 1)])

    def changed(cast: Cast, by: float) -> tuple[Scenario, Cast]:
        moved = tuple((values + by * moves).tolist())
        update: dict[str, Any] = {key: moved if isinstance(value, tuple) else moved[0]}
        if field and isinstance(holder, BaseModel):
            update = {part: holder.model_copy(update=update)}
        return scenario.model_copy(update=update), cast

    return changed, RELATIVE_STEP * max(float(np.abs(values).max()), SMALL)


def _tangent(way: tuple[Change, float], cast: Cast, seed: int, belief: Scenario | None) -> CastNumbers:
    """Return the derivative of a cast's numbers along a parameter, by central differences."""
    change, size = way
    above, below = (numbers(*change(cast, by), seed, belief) for by in (size, -size))
    tangent: CastNumbers = jax.tree.map(
        lambda a, b: (a - b) / (2 * size) if a.dtype.kind == "f" else np.zeros(a.shape, jax.dtypes.float0), above, below
    )
    # Rounded to control periods.
    return tangent._replace(motion=tangent.motion._replace(turn_duration=0 * above.motion.turn_duration))


def _derivative(chunk: Chunk, tangent: CastNumbers) -> Any:
    """Return the derivatives of `QUANTITIES`, (n, 5); nan of casts that do not land."""
    with double("float64"):
        numbers, *others = chunk.arguments
        derivatives, has_landed = _compiled()(numbers, tangent, *others)
        return np.where(has_landed, np.array(derivatives[: len(QUANTITIES)]), np.nan).T


@cache
def _compiled() -> Any:
    def derivative(numbers: CastNumbers, tangent: CastNumbers, *others: Any) -> tuple[Landing, Any]:
        def landing_of(numbers: CastNumbers) -> tuple[Landing, Any]:
            told = tell(numbers, *others)
            return told.landing, told.has_landed

        _, derivatives, has_landed = jax.jvp(landing_of, (numbers,), (tangent,), has_aux=True)
        return derivatives, has_landed

    return compiled_by_jax(derivative)
