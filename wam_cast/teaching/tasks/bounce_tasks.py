"""Contact: bounces, a contact law, and the restitution that comes of it, by its first integral instead of steps of time."""

from __future__ import annotations

import math

import numpy as np

from wam_cast.teaching.answer import Answer, agree, require

EXACT = 1e-8
"""Tolerance of what has a closed form."""

SIMULATED = 0.01
"""Tolerance of what an answer finds by steps of time: of a speed [m/s], and of a restitution."""


def restitution(answer: Answer, rng: np.random.Generator) -> None:
    """Judge the coefficient from the heights of a fall and of the bounce after it."""
    for _ in range(3):
        drop, e = rng.uniform([0.2, 0.2], [2.0, 0.9])
        mistakes = {
            "it is a ratio of speeds, not of heights": e**2,
            "it exceeds 1: no ball bounces higher than it fell": 1 / e,
        }
        agree(answer(drop, e**2 * drop), e, EXACT, "it is not the ratio of the speeds", mistakes)


def bouncing_time(answer: Answer, rng: np.random.Generator) -> None:
    """Judge how long a ball bounces, by the sum over its bounces."""
    for _ in range(3):
        height, e, gravity = rng.uniform([0.2, 0.2, 2.0], [2.0, 0.9, 12.0])
        fall = math.sqrt(2 * height / gravity)
        bounces = 2 * fall * float(np.sum(e ** np.arange(1, 1000)))
        mistakes = {
            "the first fall is missing": bounces,
            "the first fall counts once: it has no way up": bounces + 2 * fall,
            "each bounce has a way up and a way down": fall + bounces / 2,
        }
        found = answer(height, e, gravity)
        agree(found, fall + bounces, EXACT, "it is not the sum of all bounces", mistakes)


def contact_force(answer: Answer, rng: np.random.Generator) -> None:
    """Judge the law of Hunt and Crossley: none without contact, never a pull."""
    stiffness, dissipation = rng.uniform([500.0, 0.2], [2000.0, 0.9])
    depth, rate = rng.uniform([0.001, 0.1], [0.01, 0.9])
    agree(answer(-depth, rate, stiffness, dissipation), 0.0, EXACT, "there is a force where nothing touches")
    agree(answer(depth, 0.0, stiffness, dissipation), stiffness * depth, EXACT, "at rest it is not the spring's alone")
    pulled = answer(depth, -2.0 / dissipation, stiffness, dissipation)
    require(pulled >= -EXACT, "the contact pulls where the bodies part fast; it can only push")
    for one in (rate, -rate):
        expected = stiffness * (depth + depth * dissipation * one)
        mistakes = {
            "it is stronger where the bodies part than where they close": stiffness * depth * (1 - dissipation * one),
            "the damper must vanish with the depth, or the force jumps at the touch": stiffness * depth
            + dissipation * one,
            "there is no damper": stiffness * depth,
        }
        found = answer(depth, one, stiffness, dissipation)
        agree(found, expected, EXACT, "it is not the law's force in contact", mistakes)


def rebound_speed(answer: Answer, rng: np.random.Generator) -> None:
    """Judge the speed after an impact, and that it depends on neither mass nor stiffness."""
    for _ in range(2):
        speed, mass, stiffness, dissipation = rng.uniform([0.5, 0.01, 500.0, 0.1], [3.0, 0.1, 5000.0, 0.8])
        expected = _rebound(speed, dissipation)
        mistakes = {"it has the sign of the fall; a speed is positive": -expected, "no speed was lost": speed}
        found = answer(speed, mass, stiffness, dissipation)
        agree(found, expected, SIMULATED, "the ball leaves at another speed", mistakes)


def dissipation_for(answer: Answer, rng: np.random.Generator) -> None:
    """Judge the dissipation that leaves a restitution at a speed, by the bounce that it gives."""
    for _ in range(2):
        e, speed = rng.uniform([0.3, 0.8], [0.85, 2.5])
        found = answer(e, speed)
        require(found >= 0, "a contact with a negative dissipation would give the ball speed")
        kept = _rebound(speed, float(found)) / speed if found > 0 else 1.0
        words = f"with that dissipation the ball keeps {kept:.3f} of its speed, not {e:.3f}; {SIMULATED:g} is allowed"
        require(abs(kept - e) <= SIMULATED, words)


TASKS = (restitution, bouncing_time, contact_force, rebound_speed, dissipation_for)


def _rebound(speed: float, dissipation: float) -> float:
    """Return the speed after an impact, from the law's first integral: d (u + v) = log((1 + d u) / (1 - d v))."""
    from scipy.optimize import brentq  # the process of a notebook of another exercise does without

    u = dissipation * speed

    def mismatch(v: float) -> float:
        return u + v - math.log((1 + u) / (1 - v))

    return float(brentq(mismatch, 0.0, min(u, 1 - 1e-12))) / dissipation
