"""Where and how the balls come down: the crossing of the rim plane between two samples, as `wam_cast.simulation.judge` has it."""

from __future__ import annotations

from typing import Any, NamedTuple

import jax
import jax.numpy as jnp

from wam_cast.batch.flight import Flight, Sample
from wam_cast.batch.numbers import CastNumbers
from wam_cast.batch.vectors import Vector

N_NEWTON = 8
"""More than a cubic that is almost a line between two samples asks for."""


class Landing(NamedTuple):
    """Arrays over casts, of no meaning where the ball did not come down."""

    along: Any
    """In the casting plane [m]."""
    across: Any
    crossing_time: Any
    """From the start of the move [s]."""
    entry_speed: Any
    entry_angle: Any
    """From straight down [rad]."""
    slack: Any
    """At the crossing [m]."""


def landing(numbers: CastNumbers, flight: Flight) -> Landing:
    """Return the landings; between samples a ball follows the cubic that has their places and velocities."""
    before, after = flight.before, flight.after
    T = after.time - before.time
    T = jnp.where(T > 0, T, 1.0)
    rim = numbers.target.rim_height

    def newton(_: int, u: Any) -> Any:
        p_WL, v_WL = _between(before, after, T, u)
        return jnp.clip(u - (p_WL.z - rim) / jnp.where(v_WL.z < 0, v_WL.z * T, -1.0), 0.0, 1.0)

    u = jax.lax.fori_loop(0, N_NEWTON, newton, jnp.full_like(T, 0.5))
    p_WL, v_WL = _between(before, after, T, u)
    p_WE = before.p_WE + (after.p_WE - before.p_WE) * u
    string = p_WL - p_WE
    c, s = jnp.cos(numbers.motion.bearing), jnp.sin(numbers.motion.bearing)
    return Landing(
        along=c * p_WL.x + s * p_WL.y,
        across=c * p_WL.y - s * p_WL.x,
        crossing_time=before.time + u * T - numbers.motion.turn_duration,
        entry_speed=jnp.sqrt(v_WL.dot(v_WL)),
        entry_angle=jnp.arctan2(jnp.sqrt(v_WL.x**2 + v_WL.y**2), -v_WL.z),
        slack=numbers.target.string_length - jnp.sqrt(string.dot(string)),
    )


def _between(before: Sample, after: Sample, T: Any, u: Any) -> tuple[Vector, Vector]:
    """Return p_WL and v_WL at the share `u` of the way from one sample to the next, which is `T` [s] later."""
    left = 1.0 - u
    change = after.p_WL - before.p_WL
    p_WL = (
        before.p_WL * (left * left * (1.0 + 2.0 * u))
        + after.p_WL * (u * u * (3.0 - 2.0 * u))
        + before.v_WL * (u * left * left * T)
        - after.v_WL * (u * u * left * T)
    )
    v_WL = change * (6.0 * u * left / T) + before.v_WL * (left * (1.0 - 3.0 * u)) + after.v_WL * (u * (3.0 * u - 2.0))
    return p_WL, v_WL
