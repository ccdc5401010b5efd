"""The noise of a cast: what is drawn from a noise seed, each source from a random stream of its own.

A noisy cast is a pure function of scenario, cast, cup and noise seed, and what one source draws depends on no other. The encoders
draw nothing, see `wam_cast.robot.encoders`.
"""

from __future__ import annotations

import math
from enum import IntEnum
from functools import lru_cache

import numpy as np

from wam_cast.cast import Cast
from wam_cast.scenario import Noise, Scenario
from wam_cast.types import Array

LOWEST_OF_COMMAND = 0.1
"""To which fraction of its command noise may lower a distance or a speed."""

N_JOINTS = 7
"""Of the arm."""

CHUNK = 512
"""Samples whose torque noise is drawn at once."""


class Source(IntEnum):
    """What noise is drawn for; the numbers name the random streams and must stay."""

    MOVE = 0
    SWING = 1
    TORQUE = 2
    PIXELS = 3


def random_stream(noise_seed: int, source: Source, chunk: int = 0) -> np.random.Generator:
    """Return the generator of one chunk of a source's random numbers."""
    return np.random.default_rng(np.random.SeedSequence(noise_seed, spawn_key=(source, chunk)))


def executed_cast(noise: Noise, cast: Cast, noise_seed: int) -> Cast:
    """Return the cast that the arm executes when `cast` is commanded: a normal deviate off in distance, speed and wait."""
    deviates = random_stream(noise_seed, Source.MOVE).standard_normal(3)
    command = cast.to_array()
    executed = command + [noise.distance, noise.speed, noise.wait] * deviates
    return Cast.from_array(np.maximum(executed, [LOWEST_OF_COMMAND, LOWEST_OF_COMMAND, 0] * command), cast.bearing)


def swing_at_start(scenario: Scenario, noise_seed: int) -> tuple[Array, Array]:
    """Return by how much the hanging string is off [rad], and how fast it turns [rad/s], about the hook's two axes: each (2,).

    As a pendulum of the string's length does: angles and rates have independent normal deviates, of which the rates' are
    larger by the pendulum's frequency, so that every phase is as likely.
    """
    angles, phases = scenario.noise.swing * random_stream(noise_seed, Source.SWING).standard_normal((2, 2))
    return angles, math.sqrt(scenario.gravity / scenario.string.length) * phases


def torque_deviates(noise_seed: int, sample: int) -> Array:
    """Return the standard normal deviates of the joints' torques in one control period, shape (7,)."""
    chunk, row = divmod(sample, CHUNK)
    return np.asarray(_torque_chunk(noise_seed, chunk)[row])


def first_torque_deviates(noise_seed: int, n_chunks: int) -> Array:
    """Return those of the first control periods, shape (`n_chunks` * `.CHUNK`, 7)."""
    return np.concatenate([_torque_chunk(noise_seed, chunk) for chunk in range(n_chunks)])


@lru_cache(maxsize=16)
def _torque_chunk(noise_seed: int, chunk: int) -> Array:
    deviates = random_stream(noise_seed, Source.TORQUE, chunk).standard_normal((CHUNK, N_JOINTS))
    deviates.setflags(write=False)  # it is shared
    return deviates
