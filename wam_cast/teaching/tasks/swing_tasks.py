"""The pendulum below a moving hand: its flat output, and a turn whose end finds the ball at rest.

Answers are put back into the pendulum's equation, differentiated, or followed by a simulated ball.
"""

from __future__ import annotations

import numpy as np
from numpy.polynomial import Polynomial

from wam_cast.teaching.answer import Answer, agree, require
from wam_cast.types import Array

EXACT = 1e-8
"""Tolerance of what has a closed form."""

LEAST_SWING = 1e-4
"""By which a ball may swing after a turn [m]."""

N_STEPS = 160
"""Of the simulation of a turn."""

N_ZERO = 4
"""Derivatives of the step that must be zero at its ends."""

CONSEQUENCES = (
    "the ball's velocity jumps",
    "the hand jumps",
    "the hand's velocity jumps",
    "the hand's acceleration jumps",
)
"""Of a derivative of the ball's path that is not zero where it begins or ends."""


def ball_acceleration(answer: Answer, rng: np.random.Generator) -> None:
    """Judge the acceleration of a ball that hangs below a hand, for small angles."""
    for _ in range(3):
        hand, ball, length, gravity = rng.uniform([0.4, 0.1, 0.3, 2.0], [0.6, 0.3, 0.9, 12.0])
        expected = _acceleration(hand, ball, length, gravity)
        mistakes = {
            "it drives the ball away from below the hand": -expected,
            "a longer string must swing more slowly": expected * length,
            "it does not depend on gravity as it should": expected / gravity,
        }
        found = answer(hand, ball, length, gravity)
        agree(found, expected, EXACT, "it is not the acceleration that a taut string gives", mistakes)


def hand_for_ball(answer: Answer, rng: np.random.Generator) -> None:
    """Judge where the hand must be for a ball to have an acceleration, by the pendulum's equation."""
    for _ in range(3):
        length, gravity = rng.uniform([0.3, 2.0], [0.9, 12.0])
        ball, acceleration = rng.normal(size=2), rng.normal(size=2)
        hand = answer(ball, acceleration, length, gravity, shape=(2,))
        mistakes = {
            "the hand is on the wrong side: a ball accelerates toward the hand": -acceleration,
            "length and gravity are exchanged": acceleration * (gravity / length) ** 2,
        }
        words = "below that hand the ball would have another acceleration"
        agree(_acceleration(hand, ball, length, gravity), acceleration, EXACT, words, mistakes)


def step_coefficients(answer: Answer, _rng: np.random.Generator) -> None:
    """Judge the coefficients of a polynomial from 0 to 1 with four zero derivatives at both ends."""
    coefficients = answer(shape=None)
    require(
        coefficients.ndim == 1, f"the result must be a list of coefficients, and has the shape {coefficients.shape}"
    )
    if not _is_step(coefficients) and _is_step(coefficients[::-1]):
        require(False, "the coefficients are in the wrong order: the lowest power comes first")
    step = Polynomial(coefficients)
    for end, value in ((0, 0.0), (1, 1.0)):
        agree(np.asarray(step(end)), value, 1e-6, f"at s = {end} the step must be {value:g}")
        for order in range(1, N_ZERO + 1):
            words = f"at s = {end} the derivative number {order} is not zero, so {CONSEQUENCES[order - 1]}"
            agree(np.asarray(step.deriv(order)(end)), 0.0, 1e-6, words)


def arc_motion(answer: Answer, rng: np.random.Generator) -> None:
    """Judge position and acceleration, (2,) each, of a ball on a circle."""
    for _ in range(3):
        angle, rate, change, radius = rng.uniform([-1.0, 0.5, 0.5, 0.2], [1.0, 2.0, 2.0, 0.8])

        def place(
            t: float, angle: float = angle, rate: float = rate, change: float = change, r: float = radius
        ) -> Array:
            turned = angle + rate * t + change * t**2 / 2
            return r * np.array([np.cos(turned), np.sin(turned)])

        position, acceleration = answer.parts(angle, rate, change, radius, position=(2,), acceleration=(2,))
        agree(position, place(0.0), EXACT, "the ball is not there on the circle")
        step = 1e-4
        expected = (place(step) - 2 * place(0.0) + place(-step)) / step**2
        onward = np.array([-np.sin(angle), np.cos(angle)])
        along, inward = onward * (onward @ expected), expected - onward * (onward @ expected)
        mistakes = {
            "at a steady rate the ball's velocity still changes its direction": along,
            "what turns the velocity points outward": along - inward,
            "the part along the circle has the wrong sign": inward - along,
            "the part along the circle is missing": inward,
        }
        words = "it is not the second derivative of the position"
        agree(acceleration, expected, 1e-5, words, mistakes)


def turning_hand(answer: Answer, rng: np.random.Generator) -> None:
    """Judge the hand's path (2,) over time by the ball that follows it: at rest at the end, on the other bearing."""
    for sign in (1, -1):
        angle, duration, radius, length = rng.uniform([0.5, 0.9, 0.2, 0.4], [1.5, 1.5, 0.5, 0.8])
        gravity = 9.81
        setting = (sign * angle, duration, radius, length, gravity)
        start, end = (radius * np.array([np.cos(a), np.sin(a)]) for a in (0.0, sign * angle))
        agree(answer(0.0, *setting, shape=(2,)), start, 1e-6, "at the start the hand is not above the ball at rest")
        agree(answer(duration, *setting, shape=(2,)), end, 1e-6, "at the end the hand is not at the new bearing")
        times = np.linspace(0.0, duration, 2 * N_STEPS + 1)
        path = np.array([answer(float(t), *setting, shape=(2,)) for t in times])
        ball, velocity = _followed(path, start, duration, length, gravity)
        swing = float(np.hypot(np.linalg.norm(ball - end), np.linalg.norm(velocity) * np.sqrt(length / gravity)))
        words = f"after the turn the ball still swings by {1e3 * swing:.2g} mm; {1e3 * LEAST_SWING:g} mm is allowed"
        require(swing <= LEAST_SWING, words)


TASKS = (ball_acceleration, hand_for_ball, step_coefficients, arc_motion, turning_hand)


def _acceleration(hand: Array | float, ball: Array | float, length: float, gravity: float) -> Array:
    """Return the ball's acceleration as the slope of its potential, a parabola about the place below the hand."""

    def potential(offset: Array) -> Array:
        return gravity * offset**2 / (2 * length)

    offset = np.asarray(ball) - np.asarray(hand)
    return -(potential(offset + 0.5) - potential(offset - 0.5))


def _is_step(coefficients: Array) -> bool:
    return bool(np.all(np.abs(coefficients[: N_ZERO + 1]) < 1e-6) and abs(coefficients.sum() - 1) < 1e-6)


def _followed(path: Array, ball: Array, duration: float, length: float, gravity: float) -> tuple[Array, Array]:
    """Return a ball's position and velocity at the end, at rest at first below a hand on a path (2 n + 1, 2): Runge and Kutta's."""
    h, state = duration / N_STEPS, np.concatenate([ball, np.zeros(2)])

    def rate(state: Array, hand: Array) -> Array:
        return np.concatenate([state[2:], _acceleration(hand, state[:2], length, gravity)])

    for first, middle, last in zip(path[:-2:2], path[1:-1:2], path[2::2], strict=True):
        k1 = rate(state, first)
        k2 = rate(state + h / 2 * k1, middle)
        k3 = rate(state + h / 2 * k2, middle)
        k4 = rate(state + h * k3, last)
        state = state + h / 6 * (k1 + 2 * k2 + 2 * k3 + k4)
    return state[:2], state[2:]
