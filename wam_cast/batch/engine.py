"""simulate_batch: casts in, a row of a dataset for each out, in chunks, on whichever device JAX has."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from contextlib import AbstractContextManager
from dataclasses import dataclass
from functools import cache
from itertools import groupby
from typing import Any, NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
import pandas as pd
from numpy.typing import ArrayLike, NDArray

from wam_cast.arm.arm_chain import FRICTION_SPEED, arm_chain
from wam_cast.arm.posture import mass_matrix, starting_posture
from wam_cast.batch.arguments import Precision, checked_casts, checked_precision, checked_scenarios, checked_seeds
from wam_cast.batch.compilation import compiled_by_jax
from wam_cast.batch.dynamics import N_ARM
from wam_cast.batch.flight import Flight, fly
from wam_cast.batch.landing import Landing, landing
from wam_cast.batch.numbers import CastNumbers, numbers, stacked
from wam_cast.cast import PARAMETERS, Cast
from wam_cast.errors import InputError
from wam_cast.motion.noise_draws import CHUNK, first_torque_deviates
from wam_cast.motion.pendulum import fastest_swing
from wam_cast.motion.polling import POLL_PERIODS, SLACK_MARGIN
from wam_cast.scenario import Scenario
from wam_cast.storage.cast_values import STATUSES
from wam_cast.storage.casts_part import SCHEMA
from wam_cast.types import Array, checks_types

CPU_CHUNK = 16
"""Casts that a processor simulates at once: fewer do not fill its vector registers, and of more the shorter ones wait longer."""

GPU_CHUNK = 8192
"""Casts that any other device simulates at once, at most: with torque noise one or two gigabytes."""

STABLE_STEP = 2.0
"""Product of the string's fastest rate and a step up to which the method is stable, with a margin for a string that is pulled."""

FINER = 8
"""By how many times shorter steps a cast that diverged is simulated again."""

MOST_STEPS = 200
"""In a control period, of a cast that is simulated at all."""


class Told(NamedTuple):
    """What is told of casts; arrays over casts."""

    landing: Landing
    has_landed: Any
    is_slack: Any
    has_diverged: Any
    slack: Any
    torque: Any
    velocity: Any
    meets_limit: Any
    tracking_error: Any


@dataclass(frozen=True)
class Chunk:
    """Casts that are simulated at once, and how."""

    numbers: CastNumbers
    deviates: Array | None
    delay: int
    n_steps: int
    precision: Precision

    @property
    def size(self) -> int:
        """How many there are."""
        return len(self.numbers.motion.distance)

    def run(self) -> Told:
        """Return what is told of them, as numpy arrays."""
        with double(self.precision):
            told = compiled()(*self.arguments)
            return Told(*jax.tree.map(np.asarray, told))

    @property
    def arguments(self) -> tuple[Any, Any, Any, int]:
        """What a compiled function is called with."""
        given = self.numbers, self.deviates, np.zeros((self.delay, N_ARM, self.size))
        return *jax.tree.map(lambda values: in_precision(values, self.precision), given), self.n_steps


def double(precision: Precision) -> AbstractContextManager[None]:
    """Return the context in which JAX computes with a precision; what the caller's own code has stays."""
    context: AbstractContextManager[None] = jax.enable_x64(precision == "float64")
    return context


def in_precision(values: Any, precision: Precision) -> Any:
    """Return numbers as they are computed with; integers stay."""
    return values.astype(precision) if values.dtype.kind == "f" else values


@cache
def compiled() -> Any:
    """Return the function that simulates casts, which JAX compiles when its arguments have new shapes."""
    return compiled_by_jax(tell)


def tell(numbers: CastNumbers, deviates: Any, line: Any, n_steps: Any) -> Told:
    """Return what is told of casts; arguments are those of `wam_cast.batch.flight.fly`."""
    flight = fly(numbers, deviates, line, n_steps)
    found = landing(numbers, flight)
    has_landed = (flight.down_sample >= 0) & flight.has_crossed & ~flight.has_diverged
    return Told(
        landing=found,
        has_landed=has_landed,
        is_slack=found.slack > SLACK_MARGIN * numbers.target.string_length,
        has_diverged=flight.has_diverged,
        slack=jnp.minimum(flight.slack, found.slack),
        torque=jnp.minimum(flight.peaks.torque, 1.0),
        velocity=flight.peaks.velocity,
        meets_limit=_meets_limit(flight),
        tracking_error=flight.tracking_error,
    )


def _meets_limit(flight: Flight) -> Any:
    tolerance = 1e-9 if flight.q.dtype == jnp.float64 else 1e-6
    peaks = jax.tree.map(jnp.maximum, flight.peaks, flight.beyond)
    return peaks.is_outside | (peaks.torque > 1 - tolerance) | (peaks.velocity > 1)


@checks_types
def simulate_batch(
    scenario: Scenario | Sequence[Scenario],
    casts: ArrayLike | Sequence[Cast],
    noise_seeds: Sequence[int] | NDArray[np.integer[Any]] | None = None,
    precision: Precision = "float64",
    *,
    belief: Scenario | None = None,
) -> pd.DataFrame:
    """Simulate the contact-free phase of many casts at once: `simulate_cast` without a cup, by a second engine.

    It has the same physics and the same law, and integrates in equal steps: landings are those of Drake to about 1e-4 mm, in single
    precision to 1e-3 mm. What has a scenario's shape (string links, delays) is compiled anew, which takes some ten seconds.
    The loop of the controller is not checked: where `simulate_cast` refuses gains, casts here meet limits or diverge.

    Parameters
    ----------
    scenario
        What is cast with: one scenario, or one for each cast, all with as many links in the string.
    casts
        `[distance, speed, wait]` or `[distance, speed, wait, bearing]` [m, m/s, s, rad], shape (n, 3) or (n, 4), or a
        sequence of `.Cast`.
    noise_seeds
        Draw the noise of each cast, n integers from 0 on; the same seed gives the same cast as `simulate_cast`. By default all 0.
    precision
        `"float64"` or `"float32"`.
    belief
        The robot as its controller knows it, as for `simulate_cast`; by default each cast's own scenario.

    Returns
    -------
    pandas.DataFrame
        A row a cast, in order, with the columns of `.CastDataset.frame`.

    Raises
    ------
    InputError
        If an argument is not as described, a cast is none, or the arm cannot turn to a bearing.
    """
    checked_precision(precision)
    made = checked_casts(casts)
    scenarios = checked_scenarios(scenario, len(made))
    seeds = checked_seeds(noise_seeds, len(made))
    if not made:
        return _frame(made, None)
    return _frame(made, _simulated(Batch.of(scenarios, made, seeds, precision, belief)))


def fastest_friction(scenario: Scenario) -> float:
    """Return the largest rate [1/s] at which friction brakes the arm's joints at the start, where Coulomb's is steepest."""
    chain = arm_chain(scenario.arm)
    slope = chain.damping + chain.coulomb_friction / FRICTION_SPEED
    brakes = np.linalg.solve(mass_matrix(chain, starting_posture(scenario)), np.diag(slope))
    return float(np.abs(np.linalg.eigvals(brakes)).max())


def n_steps(scenario: Scenario) -> int:
    """Return in how many steps a control period is integrated. Raises `.InputError` if they are too many."""
    longest = scenario.simulation.max_step
    stable = STABLE_STEP / max(fastest_swing(scenario), fastest_friction(scenario))
    needed = math.ceil(scenario.controller.period / min(longest, stable) - 1e-9)
    if needed > MOST_STEPS:
        cause, remedy = "a string or joints so stiff or so damped", "fewer string.n_links or less damping"
        if longest < stable:
            cause, remedy = f"simulation.max_step = {longest:g} s", "a longer simulation.max_step"
        raise InputError(
            f"scenario: {cause}, with controller.period = {scenario.controller.period:g} s, make {needed} integration steps in a "
            f"period, {MOST_STEPS} are allowed; simulate it with Drake, which chooses its steps, or choose {remedy}"
        )
    return max(needed, 1)


@dataclass(frozen=True)
class Batch:
    """Casts that are simulated by one compiled function.

    Attributes
    ----------
    rows
        Their numbers.
    seeds, steps
        The noise seed of each, and in how many steps its control period is integrated.
    delay
        The longest of the casts', in control periods, and 1 or more.
    has_torque_noise
        Whether any has.
    """

    rows: list[CastNumbers]
    seeds: list[int]
    steps: list[int]
    delay: int
    has_torque_noise: bool
    precision: Precision

    @classmethod
    def of(
        cls,
        scenarios: list[Scenario],
        casts: list[Cast],
        seeds: list[int],
        precision: Precision,
        belief: Scenario | None,
    ) -> Batch:
        """Return the batch of casts, each of a scenario."""
        rows = [numbers(s, c, k, belief) for s, c, k in zip(scenarios, casts, seeds, strict=True)]
        steps = {scenario: n_steps(scenario) for scenario in set(scenarios)}
        return cls(
            rows,
            seeds,
            [steps[scenario] for scenario in scenarios],
            delay=max(1, *(scenario.controller.delay for scenario in scenarios)),
            has_torque_noise=any(scenario.noise.torque > 0 for scenario in scenarios),
            precision=precision,
        )

    def chunks(self, which: list[int] | None = None, *, finer: int = 1) -> Iterator[tuple[list[int], Chunk]]:
        """Yield those of the casts in chunks that take about as long, and which they are; the last ones fill a chunk up.

        Casts of one chunk are integrated in as many steps: what becomes of one does not depend on the others.
        """
        size = chunk_size(len(self.rows))
        wanted = range(len(self.rows)) if which is None else which
        order = sorted(wanted, key=lambda i: (self.steps[i], _n_samples(self.rows[i])))
        for steps, same in groupby(order, key=lambda i: self.steps[i]):
            group = list(same)
            for of_chunk in (group[first : first + size] for first in range(0, len(group), size)):
                yield of_chunk, self.chunk(filled_up(of_chunk, size), finer * steps)

    def chunk(self, which: list[int], n_steps: int) -> Chunk:
        """Return those of the casts, to be integrated in `n_steps` a control period."""
        rows = [self.rows[i] for i in which]
        deviates = None
        if self.has_torque_noise:
            # As much room for all chunks, and for other casts that last about as long: for another one is compiled anew.
            n_drawn = math.ceil((max(map(_n_samples, self.rows)) + POLL_PERIODS) / CHUNK)
            room = CHUNK << (n_drawn - 1).bit_length()
            deviates = np.zeros((room, N_ARM, len(which)))
            for k, i in enumerate(which):
                deviates[: n_drawn * CHUNK, :, k] = first_torque_deviates(self.seeds[i], n_drawn)
        return Chunk(stacked(rows), deviates, self.delay, n_steps, self.precision)


def filled_up(which: list[int], size: int) -> list[int]:
    """Return which casts fill a chunk: these, and the last one as often as there is room."""
    return which + which[-1:] * (size - len(which))


def chunk_size(n_casts: int) -> int:
    """Return how many casts are simulated at once where there are so many in all: what is smaller is filled up."""
    on_device = device_chunk()
    return min(on_device, max(CPU_CHUNK, 1 << (n_casts - 1).bit_length())) if on_device else CPU_CHUNK


def device_chunk() -> int | None:
    """Return how many casts at most JAX's device simulates at once if it is no processor; else None."""
    return None if jax.default_backend() == "cpu" else GPU_CHUNK


def _simulated(batch: Batch) -> Told:
    """Return what is told of the casts, in order; those that diverge are simulated once more, in finer steps."""
    parts = [(which, chunk.run()) for which, chunk in batch.chunks()]
    told = _in_order(parts)
    diverged = np.flatnonzero(told.has_diverged).tolist()
    parts += [(which, chunk.run()) for which, chunk in batch.chunks(diverged, finer=FINER)]
    return _in_order(parts) if diverged else told


def _in_order(parts: list[tuple[list[int], Told]]) -> Told:
    """Return what is told of all casts, of chunks of some each; a later one counts for a cast that is in several."""
    n = max(max(which) for which, _ in parts) + 1

    def gathered(*chunks: Array) -> Array:
        values = np.empty(n, chunks[0].dtype)
        for (which, _), found in zip(parts, chunks, strict=True):
            values[which] = found[: len(which)]
        return values

    told: Told = jax.tree.map(gathered, *(found for _, found in parts))
    return told


def _n_samples(row: CastNumbers) -> int:
    """Return how many control periods a cast may last."""
    m = row.motion
    duration = m.turn_duration + m.move_duration + m.wait + m.drop_duration + m.hold_duration
    return int(duration / row.law.period) + 1


def _frame(casts: list[Cast], told: Told | None) -> pd.DataFrame:
    """Return a dataset's columns."""
    commands = np.array([cast.to_array() for cast in casts]).reshape(-1, 3)
    columns: dict[str, Any] = {"cast": np.arange(len(casts))} | dict(zip(PARAMETERS, commands.T, strict=True))
    if told is not None:
        has_landed = told.has_landed
        landings = told.landing._asdict() | {"slack": told.slack}
        columns |= {
            f"landing_{name}" if name in ("along", "across") else name: np.where(has_landed, of, np.nan)
            for name, of in landings.items()
        }
        which = np.select([told.has_diverged, told.meets_limit, ~has_landed], [3, 2, 1], 0)
        columns |= {
            "status": np.array(STATUSES)[which],
            "is_slack": has_landed & told.is_slack,
            "peak_torque_utilization": told.torque,
            "peak_velocity_utilization": told.velocity,
            "peak_tracking_error": told.tracking_error,
        }
    types = {field.name: field.type.to_pandas_dtype() for field in SCHEMA}
    return pd.DataFrame(columns, columns=SCHEMA.names).astype(
        {name: of for name, of in types.items() if name != "status"}
    )
