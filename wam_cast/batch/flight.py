"""The contact-free phase of all casts at once: until every ball has come down, then the arms alone to the drop's end.

What is measured on the way, and at which samples, is what `wam_cast.simulation.contact_free` and `.judge` measure of one cast.
Each cast has a time of its own: an arm that goes on alone does so from where the ball came down, while other balls still fly. Casts
that have ended stay as they are. All of it is one loop, since each copy of the law or of the dynamics takes seconds to compile.
"""

from __future__ import annotations

from typing import Any, NamedTuple

import jax
import jax.numpy as jnp

from wam_cast.batch.dynamics import N_ARM, accelerations, ball_motion
from wam_cast.batch.law import commanded, given, measured, reference, torque_limits, utilization
from wam_cast.batch.numbers import CastNumbers, MotionNumbers
from wam_cast.batch.vectors import Vector
from wam_cast.motion.polling import (
    CONTACT_POLL_PERIODS,
    MAX_BALL_SPEED,
    MAX_STATE,
    POLL_PERIODS,
    SLACK_MARGIN,
    TRACKING_SAMPLES,
)


class Sample(NamedTuple):
    """Ball and hand at a sample."""

    time: Any
    p_WL: Vector
    v_WL: Vector
    p_WE: Vector


class Peaks(NamedTuple):
    """The most that was asked of motors and joints, and whether a joint left its range, (n,)."""

    torque: Any
    velocity: Any
    is_outside: Any


class Flight(NamedTuple):
    """The state of all casts; arrays over casts."""

    sample: Any
    """Its number: control periods since the start."""
    q: Any
    v: Any
    line: Any
    """Commanded torques on their way to the motors, the newest first, (delay, 7, n)."""
    held: Any
    """Commanded torque that was held up to this sample, (7, n)."""
    is_active: Any
    is_alone: Any
    """The arm goes on alone."""
    has_diverged: Any
    previous: Sample
    before: Sample
    """The last sample above the rim plane before the crossing, and the one after it."""
    after: Sample
    has_crossed: Any
    down_sample: Any
    """When the ball was first polled at the rim plane or below; -1 if it was not."""
    down: Any
    """q, v of the arm and line there."""
    slack: Any
    tracking_error: Any
    peaks: Peaks
    """Up to there, and of the arm alone."""
    beyond: Peaks
    """Of the arm with the ball from there on."""


def fly(numbers: CastNumbers, deviates: Any, line: Any, n_steps: Any) -> Flight:
    """Return how the casts' contact-free phases end.

    `deviates`: of the torque noise, (n_samples, 7, n), or None. `line`: zeros, (delay, 7, n), where `delay` is the longest of the
    casts', and 1 or more. `n_steps`: integration steps in a period.
    """
    flight: Flight = jax.lax.while_loop(
        lambda flight: jnp.any(flight.is_active),
        lambda flight: _period(numbers, deviates, n_steps, flight),
        _start(numbers, line),
    )
    return flight


def fly_to(numbers: CastNumbers, deviates: Any, line: Any, n_steps: Any, samples: Any) -> tuple[Any, Any, Any, Any]:
    """Return q, v, the delay line, and the torque that acted up to there, of the casts at a sample of each, `samples` (n,).

    Nothing is measured on the way. The other arguments are those of `fly`.
    """

    def period(state: tuple[Flight, Any]) -> Any:
        flight, _ = state
        torque, later, *_ = _torque(numbers, deviates, flight)
        q, v = _integrate(numbers, flight.q, flight.v, torque, flight.is_alone, n_steps)
        ahead = flight._replace(sample=flight.sample + 1, q=q, v=v, line=later)
        return _chosen(flight.sample < samples, (ahead, torque), state)

    start = _start(numbers, line), jnp.zeros_like(numbers.q[:N_ARM])
    flight, torque = jax.lax.while_loop(lambda state: jnp.any(state[0].sample < samples), period, start)
    return flight.q, flight.v, flight.line, torque


def _start(numbers: CastNumbers, line: Any) -> Flight:
    zero = jnp.zeros_like(numbers.motion.distance)
    no, first = jnp.zeros(zero.shape, bool), jnp.zeros(zero.shape, int)
    nothing = Vector(zero, zero, zero)
    here = Sample(zero, nothing, nothing, nothing)
    q, v = numbers.q, numbers.v
    return Flight(
        sample=first,
        q=q,
        v=v,
        line=line,
        held=line[0],
        is_active=~no,
        is_alone=no,
        has_diverged=no,
        # Below any plane: nothing has crossed it at the first sample.
        previous=here._replace(p_WL=nothing._replace(z=zero - jnp.inf)),
        before=here,
        after=here,
        has_crossed=no,
        down_sample=first - 1,
        down=(q[:N_ARM], v[:N_ARM], line),
        slack=zero + jnp.inf,
        tracking_error=zero,
        peaks=Peaks(zero, zero, no),
        beyond=Peaks(zero, zero, no),
    )


def _period(numbers: CastNumbers, deviates: Any, n_steps: Any, flight: Flight) -> Flight:
    """Return the casts a control period later, each looked at where it is before."""
    state = _alone(numbers, _look(numbers, flight))
    torque, line, command, used = _torque(numbers, deviates, state)
    q, v = _integrate(numbers, state.q, state.v, torque, state.is_alone, n_steps)
    is_bounded = jnp.all(jnp.abs(jnp.concatenate([q, v])) < MAX_STATE, axis=0)  # False of nan
    is_bounded = is_bounded | state.is_alone
    active = state.is_active & is_bounded
    is_beyond = (state.down_sample >= 0) & ~state.is_alone

    def kept(new: Any, old: Any) -> Any:
        return jnp.where(active, new, old)

    def more(peaks: Peaks, counts: Any) -> Peaks:
        return peaks._replace(torque=jnp.where(counts, jnp.maximum(peaks.torque, used), peaks.torque))

    return state._replace(
        sample=kept(state.sample + 1, state.sample),
        q=kept(q, state.q),
        v=kept(v, state.v),
        line=kept(line, state.line),
        held=kept(command, state.held),
        is_active=active,
        has_diverged=state.has_diverged | (state.is_active & ~is_bounded),
        peaks=more(state.peaks, active & ~is_beyond),
        beyond=more(state.beyond, active & is_beyond),
    )


def _look(numbers: CastNumbers, flight: Flight) -> Flight:
    """Return the casts with what is measured at their sample, those whose ball's flight ends there no longer active."""
    target, motion, law, active = numbers.target, numbers.motion, numbers.law, flight.is_active & ~flight.is_alone
    time = flight.sample * law.period
    p_WL, v_WL, p_WE = ball_motion(numbers, flight.q, flight.v)
    here, rim = Sample(time, p_WL, v_WL, p_WE), target.rim_height

    # The crossing: the first pair of samples about the plane since the ball was last polled above it.
    falls = (flight.previous.p_WL.z > rim) & (p_WL.z <= rim) & active
    crosses = falls & ~flight.has_crossed
    before = _chosen(crosses, flight.previous, flight.before)
    after = _chosen(crosses, here, flight.after)
    has_crossed = flight.has_crossed | crosses

    # Polls.
    is_down = flight.down_sample >= 0
    since_down = flight.sample - flight.down_sample
    is_poll = jnp.where(is_down, since_down % CONTACT_POLL_PERIODS == 0, flight.sample % POLL_PERIODS == 0)
    is_poll = is_poll & active & (flight.sample > 0)
    is_fast = ~(v_WL.dot(v_WL) < MAX_BALL_SPEED**2)
    diverges = is_poll & is_fast
    comes_down = is_poll & ~is_down & (p_WL.z <= rim) & ~is_fast
    is_above = is_poll & ~is_down & ~comes_down
    down_sample = jnp.where(comes_down, flight.sample, flight.down_sample)
    is_down = down_sample >= 0
    string = p_WL - p_WE
    length = jnp.sqrt(string.dot(string))
    is_below = (length >= (1 - SLACK_MARGIN) * target.string_length) | (p_WL.z <= rim - target.ball_radius)
    ends = is_poll & ((is_down & is_below) | ~(time < _drop_end(motion) + motion.hold_duration))

    # Slack, from the first sample after the crossing on while part of the ball is above the plane.
    counts = active & has_crossed & (p_WL.z > rim - target.ball_radius)
    slack = jnp.where(counts, jnp.minimum(flight.slack, target.string_length - length), flight.slack)

    off = p_WE - reference(motion, time).p_WE
    tracked = active & (flight.sample % TRACKING_SAMPLES == 0)
    error = jnp.where(tracked, jnp.maximum(flight.tracking_error, jnp.sqrt(off.dot(off))), flight.tracking_error)

    arm, speed = (values[:N_ARM] for values in (flight.q, flight.v))
    # What was held up to here, at the speed here, counts once more where the arm goes on alone.
    held = jnp.max(utilization(flight.held, torque_limits(law, speed, flight.held)), axis=0)
    is_beyond = active & is_down & ~comes_down
    peaks = _looked(numbers, flight.peaks, arm, speed, flight.is_active & ~is_beyond)
    peaks = peaks._replace(torque=jnp.where(comes_down, jnp.maximum(peaks.torque, held), peaks.torque))
    return flight._replace(
        is_active=flight.is_active & ~ends & ~diverges,
        has_diverged=flight.has_diverged | diverges,
        previous=_chosen(active, here, flight.previous),
        before=before,
        after=after,
        has_crossed=has_crossed & ~is_above,
        down_sample=down_sample,
        down=_chosen(comes_down, (arm, speed, flight.line), flight.down),
        slack=jnp.where(is_above, jnp.inf, slack),
        tracking_error=error,
        peaks=peaks,
        beyond=_looked(numbers, flight.beyond, arm, speed, is_beyond),
    )


def _alone(numbers: CastNumbers, flight: Flight) -> Flight:
    """Return the flights, of those that have ended after their ball came down the arm, from there to the end of the drop."""
    begins = ~flight.is_active & ~flight.is_alone & (flight.down_sample >= 0) & ~flight.has_diverged
    q, v, line = flight.down
    sample = jnp.where(begins, flight.down_sample, flight.sample)
    is_alone = flight.is_alone | begins
    goes_on = (sample + 1) * numbers.law.period <= _drop_end(numbers.motion)
    return flight._replace(
        sample=sample,
        q=flight.q.at[:N_ARM].set(jnp.where(begins, q, flight.q[:N_ARM])),
        v=flight.v.at[:N_ARM].set(jnp.where(begins, v, flight.v[:N_ARM])),
        line=jnp.where(begins, line, flight.line),
        is_active=jnp.where(is_alone, goes_on, flight.is_active),
        is_alone=is_alone,
    )


def _drop_end(motion: MotionNumbers) -> Any:
    return motion.turn_duration + motion.move_duration + motion.wait + motion.drop_duration


def _looked(numbers: CastNumbers, peaks: Peaks, q: Any, v: Any, counts: Any) -> Peaks:
    """Return the peaks with speeds and angles of the arm, (7, n) each, of the casts that count."""
    target = numbers.target
    speed = jnp.max(utilization(v, numbers.law.velocity_limits), axis=0)
    outside = jnp.any((q < target.lower) | (q > target.upper), axis=0)
    return peaks._replace(
        velocity=jnp.where(counts, jnp.maximum(peaks.velocity, speed), peaks.velocity),
        is_outside=peaks.is_outside | (counts & outside),
    )


def _chosen(which: Any, new: Any, old: Any) -> Any:
    return jax.tree.map(lambda a, b: jnp.where(which, a, b), new, old)


def _torque(numbers: CastNumbers, deviates: Any, flight: Flight) -> tuple[Any, Any, Any, Any]:
    """Return the torque from a sample on, the delay line after it, what the motors are asked for, and how much they are used."""
    law, sample, line = numbers.law, flight.sample, flight.line
    q, v = flight.q[:N_ARM], flight.v[:N_ARM]
    newest = commanded(numbers, *measured(law, q, v), reference(numbers.motion, sample * law.period))
    # Before the start the first command was held.
    line = jnp.where(sample == 0, newest, line)
    late = jnp.take_along_axis(line, jnp.broadcast_to(jnp.maximum(law.delay - 1, 0), sample.shape)[None, None], axis=0)[
        0
    ]
    command = jnp.where(law.delay > 0, late, newest)
    line = jnp.concatenate([newest[None], line[:-1]])
    if deviates is not None:
        drawn = jnp.take_along_axis(deviates, jnp.minimum(sample, len(deviates) - 1)[None, None], axis=0)[0]
        command = command + law.torque_deviation * drawn
    torque, asked = given(law, command, v)
    return torque, line, command, jnp.max(asked, axis=0)


def _integrate(numbers: CastNumbers, q: Any, v: Any, torque: Any, is_alone: Any, n_steps: Any) -> tuple[Any, Any]:
    """Return q and v a control period later, by Runge and Kutta's third order: Drake's `runge_kutta3` in equal steps."""
    h = numbers.law.period / n_steps

    def stage(state: Any, k: Any) -> tuple[Any, None]:
        q, v, q_0, v_0, q_sum, v_sum, v_first, a_first = state
        a = accelerations(numbers, q, v, torque, is_alone)
        # Weights 1/6, 2/3, 1/6; the next stage from x + h/2 k1, then from x - h k1 + 2 h k2.
        weight, own, first = (
            jnp.array([[1 / 6, 0.5, 0.0], [2 / 3, 2.0, -1.0], [1 / 6, 0.0, 0.0]], q.dtype)[k][:, None] * h
        )
        q_sum, v_sum = q_sum + weight * v, v_sum + weight * a
        v_first, a_first = (jnp.where(k == 0, new, old) for new, old in ((v, v_first), (a, a_first)))
        q_next = q_0 + own * v + first * v_first
        v_next = v_0 + own * a + first * a_first
        return (q_next, v_next, q_0, v_0, q_sum, v_sum, v_first, a_first), None

    def step(_: Any, state: Any) -> Any:
        q, v = state
        start = (q, v, q, v, q, v, v, v)
        return jax.lax.scan(stage, start, jnp.arange(3))[0][4:6]

    after: tuple[Any, Any] = jax.lax.fori_loop(0, n_steps, step, (q, v))
    return after
