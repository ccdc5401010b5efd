"""The contact-free phase of all casts at once: until every ball has come down, then the arms alone to the drop's end.

What is measured on the way, and at which samples, is what `wam_cast.simulation.contact_free` and `.judge` measure of one cast.
Casts that have ended stay as they are while the others go on.
"""

from __future__ import annotations

from typing import Any, NamedTuple

import jax
import jax.numpy as jnp

from wam_cast.batch.dynamics import N_ARM, accelerations, ball_motion
from wam_cast.batch.law import commanded, given, measured, reference, torque_limits, utilization
from wam_cast.batch.numbers import CastNumbers
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
    """The state of all casts at a sample; arrays over casts but for `sample`, its number."""

    sample: Any
    q: Any
    v: Any
    line: Any
    """Commanded torques on their way to the motors, the newest first, (delay, 7, n)."""
    held: Any
    """Commanded torque that was held up to this sample, (7, n)."""
    is_active: Any
    has_diverged: Any
    previous: Sample
    before: Sample
    """The last sample above the rim plane before the crossing, and the one after it."""
    after: Sample
    has_crossed: Any
    down_sample: Any
    """When the ball was first polled at the rim plane or below; -1 if it was not."""
    down: Any
    """q, v of the arm, line and held there."""
    slack: Any
    tracking_error: Any
    peaks: Peaks
    """Up to there."""
    beyond: Peaks
    """From there on."""


class Settings(NamedTuple):
    """What is the same for all casts of a batch, and what a compiled function is for."""

    delay: int
    has_turns: bool
    has_torque_noise: bool


def fly(numbers: CastNumbers, deviates: Any, n_steps: Any, settings: Settings) -> Flight:
    """Return how the casts' contact-free phases end.

    `deviates`: of the torque noise, (n_samples, 7, n), or of no length without noise. `n_steps`: integration steps in a period.
    """
    start = _start(numbers, deviates, settings)
    flight = jax.lax.while_loop(
        lambda flight: jnp.any(flight.is_active),
        lambda flight: _period(numbers, deviates, n_steps, settings, flight),
        start,
    )
    return _finish_drop(numbers, deviates, n_steps, settings, flight)


def fly_to(
    numbers: CastNumbers, deviates: Any, n_steps: Any, settings: Settings, samples: Any
) -> tuple[Any, Any, Any, Any]:
    """Return q, v, the delay line, and the torque that acted up to there, of the casts at a sample of each, `samples` (n,)."""
    start = _start(numbers, deviates, settings)

    def period(state: Any) -> Any:
        sample, q, v, line, torque = state
        here = jnp.full_like(samples, sample)
        given_torque, later, *_ = _torque(numbers, deviates, settings, q, v, line, here, here * numbers.law.period)
        ahead = (*_integrate(numbers, q, v, given_torque, n_steps), later, given_torque)
        return sample + 1, *_chosen(sample < samples, ahead, (q, v, line, torque))

    begun = (0, start.q, start.v, start.line, jnp.zeros_like(start.q[:N_ARM]))
    _, q, v, line, torque = jax.lax.while_loop(lambda state: jnp.any(state[0] < samples), period, begun)
    return q, v, line, torque


def _start(numbers: CastNumbers, deviates: Any, settings: Settings) -> Flight:
    like = numbers.motion.distance
    n = like.shape[-1]
    q, v = (jnp.broadcast_to(values, (len(values), n)) for values in (numbers.q, numbers.v))
    zero, no = jnp.zeros_like(like), jnp.zeros(n, bool)
    first = _command(numbers, settings, q, v, zero)
    line = jnp.broadcast_to(first, (settings.delay, *first.shape))
    held = first if not settings.has_torque_noise else first + _noise(numbers, deviates, jnp.zeros(n, int))
    here = Sample(zero, *ball_motion(numbers, q, v))
    return Flight(
        sample=0,
        q=q,
        v=v,
        line=line,
        held=held,
        is_active=~no,
        has_diverged=no,
        previous=here,
        before=here,
        after=here,
        has_crossed=no,
        down_sample=jnp.full(n, -1),
        down=(q[:N_ARM], v[:N_ARM], line, held),
        slack=zero + jnp.inf,
        tracking_error=zero,
        peaks=Peaks(zero, zero, no),
        beyond=Peaks(zero, zero, no),
    )


def _period(numbers: CastNumbers, deviates: Any, n_steps: Any, settings: Settings, flight: Flight) -> Flight:
    """Return the casts a control period later, each looked at where it is before."""
    flight = _look(numbers, settings, flight)
    law, state = numbers.law, flight
    samples = jnp.full_like(state.down_sample, state.sample)
    time = samples * law.period
    torque, line, command, used = _torque(numbers, deviates, settings, state.q, state.v, state.line, samples, time)
    q, v = _integrate(numbers, state.q, state.v, torque, n_steps)
    is_bounded = jnp.all(jnp.abs(jnp.concatenate([q, v])) < MAX_STATE, axis=0)  # False of nan
    active = state.is_active & is_bounded
    is_down = state.down_sample >= 0

    def kept(new: Any, old: Any) -> Any:
        return jnp.where(active, new, old)

    def more(peaks: Peaks, counts: Any) -> Peaks:
        return peaks._replace(torque=jnp.where(counts, jnp.maximum(peaks.torque, used), peaks.torque))

    return state._replace(
        sample=state.sample + 1,
        q=kept(q, state.q),
        v=kept(v, state.v),
        line=kept(line, state.line),
        held=kept(command, state.held),
        is_active=active,
        has_diverged=state.has_diverged | (state.is_active & ~is_bounded),
        peaks=more(state.peaks, active & ~is_down),
        beyond=more(state.beyond, active & is_down),
    )


def _look(numbers: CastNumbers, settings: Settings, flight: Flight) -> Flight:
    """Return the casts with what is measured at their sample, those that end there no longer active."""
    target, motion, law, active = numbers.target, numbers.motion, numbers.law, flight.is_active
    time = jnp.full_like(flight.down_sample, flight.sample) * law.period
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
    hold_end = motion.turn_duration + motion.move_duration + motion.wait + motion.drop_duration + motion.hold_duration
    ends = is_poll & ((is_down & is_below) | ~(time < hold_end))

    # Slack, from the first sample after the crossing on while part of the ball is above the plane.
    counts = active & has_crossed & (p_WL.z > rim - target.ball_radius)
    slack = jnp.where(counts, jnp.minimum(flight.slack, target.string_length - length), flight.slack)

    off = p_WE - reference(motion, time, has_turns=settings.has_turns).p_WE
    tracked = active & (flight.sample % TRACKING_SAMPLES == 0)
    error = jnp.where(tracked, jnp.maximum(flight.tracking_error, jnp.sqrt(off.dot(off))), flight.tracking_error)

    arm, speed = (values[:N_ARM] for values in (flight.q, flight.v))
    # What was held up to here, at the speed here, counts once more where the arm goes on alone.
    held = jnp.max(utilization(flight.held, torque_limits(law, speed, flight.held)), axis=0)
    is_before = active & ~(is_down & ~comes_down)
    peaks = _looked(numbers, flight.peaks, arm, speed, is_before)
    peaks = peaks._replace(torque=jnp.where(comes_down, jnp.maximum(peaks.torque, held), peaks.torque))
    here_is_last = (flight.q[:N_ARM], flight.v[:N_ARM], flight.line, flight.held)
    return flight._replace(
        is_active=active & ~ends & ~diverges,
        has_diverged=flight.has_diverged | diverges,
        previous=_chosen(active, here, flight.previous),
        before=before,
        after=after,
        has_crossed=has_crossed & ~is_above,
        down_sample=down_sample,
        down=_chosen(comes_down, here_is_last, flight.down),
        slack=jnp.where(is_above, jnp.inf, slack),
        tracking_error=error,
        peaks=peaks,
        beyond=_looked(numbers, flight.beyond, arm, speed, active & ~is_before),
    )


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


def _command(numbers: CastNumbers, settings: Settings, q: Any, v: Any, time: Any) -> Any:
    wanted = reference(numbers.motion, time, has_turns=settings.has_turns)
    return commanded(numbers, *measured(numbers.law, q[:N_ARM], v[:N_ARM]), wanted)


def _noise(numbers: CastNumbers, deviates: Any, samples: Any) -> Any:
    """Return the noise of the commanded torques [N m], (7, n), at each cast's sample."""
    drawn = jnp.take_along_axis(deviates, jnp.clip(samples, 0, len(deviates) - 1)[None, None], axis=0)[0]
    return numbers.law.torque_deviation * drawn


def _torque(
    numbers: CastNumbers, deviates: Any, settings: Settings, q: Any, v: Any, line: Any, samples: Any, time: Any
) -> tuple[Any, Any, Any, Any]:
    """Return the torque from a sample on, the delay line after it, what the motors are asked for, and how much they are used."""
    command, law = _command(numbers, settings, q, v, time), numbers.law
    if settings.delay:
        delay = jnp.broadcast_to(law.delay, command.shape[-1:])
        late = jnp.take_along_axis(line, jnp.maximum(delay - 1, 0)[None, None], axis=0)[0]
        line = jnp.concatenate([command[None], line[:-1]])
        command = jnp.where(delay > 0, late, command)
    if settings.has_torque_noise:
        command = command + _noise(numbers, deviates, samples)
    torque, asked = given(law, command, v[:N_ARM])
    return torque, line, command, jnp.max(asked, axis=0)


def _integrate(numbers: CastNumbers, q: Any, v: Any, torque: Any, n_steps: Any) -> tuple[Any, Any]:
    """Return q and v a control period later, by Runge and Kutta's third order: Drake's `runge_kutta3` in equal steps."""
    h = numbers.law.period / n_steps

    def stage(state: Any, k: Any) -> tuple[Any, None]:
        q, v, q_0, v_0, q_sum, v_sum, v_first, a_first = state
        a = accelerations(numbers, q, v, torque)
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


def _finish_drop(numbers: CastNumbers, deviates: Any, n_steps: Any, settings: Settings, flight: Flight) -> Flight:
    """Return the flights with the arm's peaks from where the ball came down to the end of the drop, of the arm alone."""
    motion, law = numbers.motion, numbers.law
    drop_end = motion.turn_duration + motion.move_duration + motion.wait + motion.drop_duration
    is_early = (flight.down_sample >= 0) & ~flight.has_diverged & (flight.down_sample * law.period < drop_end)

    def goes_on(samples: Any) -> Any:
        return is_early & ((samples + 1) * law.period <= drop_end)

    def period(state: Any) -> Any:
        samples, q, v, line, peaks = state
        torque, later, _, used = _torque(numbers, deviates, settings, q, v, line, samples, samples * law.period)
        counts = goes_on(samples)
        q_next, v_next = _integrate(numbers, q, v, torque, n_steps)
        peaks = peaks._replace(torque=jnp.where(counts, jnp.maximum(peaks.torque, used), peaks.torque))
        peaks = _looked(numbers, peaks, q_next, v_next, counts)
        q, v, line = _chosen(counts, (q_next, v_next, later), (q, v, line))
        return jnp.where(counts, samples + 1, samples), q, v, line, peaks

    q, v, line, _ = flight.down
    start = (flight.down_sample, q, v, line, flight.peaks)
    *_, peaks = jax.lax.while_loop(lambda state: jnp.any(goes_on(state[0])), period, start)
    return flight._replace(peaks=peaks)
