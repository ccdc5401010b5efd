"""Planning under uncertainty: how a cast's noise comes to the landing, chances to hit, and which cast to take."""

from __future__ import annotations

import numpy as np
from scipy.special import ndtr

from wam_cast.teaching.answer import Answer, agree, require
from wam_cast.types import Array

EXACT = 1e-8
"""Tolerance of what has a closed form."""

DRAWN = 0.01
"""Tolerance of a probability that an answer may find by drawing at random."""


def landing_std(answer: Answer, rng: np.random.Generator) -> None:
    """Judge the standard deviation of a landing, by that of a sum of independent variables."""
    for _ in range(3):
        slopes, cast_std = rng.normal(size=3), rng.uniform(0.5, 2.0, 3)
        model_std = float(rng.uniform(0.5, 2.0))
        parts = np.append(slopes * cast_std, model_std)
        expected = float(np.linalg.norm(parts))
        mistakes = {
            "that is the variance": expected**2,
            "independent errors do not add up as if all were bad at once": np.abs(parts).sum(),
            "errors of opposite slopes must not cancel": abs(parts.sum()),
            "the model's own error is missing": float(np.linalg.norm(parts[:3])),
            "the model's own error adds to the rest as if they always went together": float(
                np.linalg.norm(parts[:3]) + model_std
            ),
        }
        found = answer(slopes, cast_std, model_std)
        agree(found, expected, EXACT, "it is not the standard deviation of the sum", mistakes)


def hit_probability(answer: Answer, rng: np.random.Generator) -> None:
    """Judge the chance that a landing on a line is within a radius, by quadrature."""
    for _ in range(3):
        offset, std, radius = rng.uniform([-1.5, 0.5, 0.8], [-0.3, 1.2, 1.6])
        grid, weight = _quadrature(-radius, radius)
        expected = float(weight @ _density((grid - offset) / std)) / std
        mistakes = {
            "it leaves out that the landing is off the middle": 1 - 2 * float(ndtr(-radius / std)),
            "it has the ball stopped on one side only": float(ndtr((radius - offset) / std)),
            "that is the chance to miss": 1 - expected,
            "std is taken for a variance": float(
                ndtr((radius - offset) / std**0.5) - ndtr((-radius - offset) / std**0.5)
            ),
        }
        agree(answer(offset, std, radius), expected, EXACT, "it is not the chance of that interval", mistakes)
        agree(answer(-offset, std, radius), expected, EXACT, "short and long by the same must be as likely to hit")


def disc_probability(answer: Answer, rng: np.random.Generator) -> None:
    """Judge the chance that a landing in the plane is within a circle, by quadrature."""
    for _ in range(2):
        offset, std = rng.uniform([0.2, -0.9], [0.9, -0.2]), rng.uniform(0.4, 1.0, 2)
        radius = float(rng.uniform(0.9, 1.4))
        square = np.prod(ndtr((radius - offset) / std) - ndtr((-radius - offset) / std))
        expected = _in_disc(offset, std, radius)
        mistakes = {
            "that is the chance of a square about the circle": square,
            "it leaves out that the landing is off the middle": _in_disc(np.zeros(2), std, radius),
            "along and across are in the wrong order": _in_disc(offset, std[::-1], radius),
        }
        found = answer(offset, std, radius)
        require(-1e-12 <= found <= 1 + 1e-12, "a probability is between 0 and 1")
        agree(found, expected, DRAWN, "it is not the chance of the circle", mistakes)


def best_cast(answer: Answer, rng: np.random.Generator) -> None:
    """Judge the choice among casts by their chances to hit; that of least predicted miss is never the best one here."""
    n_tried = 0
    while n_tried < 3:
        offsets, stds = rng.uniform(-0.8, 0.8, (6, 2)), rng.uniform(0.1, 1.2, (6, 2))
        chances = np.array([_in_disc(offset, std, 1.0) for offset, std in zip(offsets, stds, strict=True)])
        near, sure = int(np.argmin(np.linalg.norm(offsets, axis=1))), int(np.argmin(np.prod(stds, axis=1)))
        best = int(np.argmax(chances))
        if best in (near, sure) or np.sort(chances)[-1] - np.sort(chances)[-2] < 5 * DRAWN:
            continue  # it would not tell these apart
        n_tried += 1
        mistakes = {
            "that one is predicted to miss least, and another is more likely to hit": near,
            "that one scatters least, and another is more likely to hit": sure,
            "that one is least likely to hit": int(np.argmin(chances)),
        }
        found = answer(offsets, stds, 1.0)
        require(found in range(6), "the result must be the number of a cast, from 0 on")
        agree(found, best, 0.0, "another one is more likely to hit", mistakes)


TASKS = (landing_std, hit_probability, disc_probability, best_cast)


def _density(z: Array) -> Array:
    """Return the density of the standard normal distribution."""
    return np.asarray(np.exp(-(z**2) / 2) / np.sqrt(2 * np.pi))


_RULE = np.polynomial.legendre.leggauss(60)


def _quadrature(low: float, high: float) -> tuple[Array, Array]:
    """Return points and weights of Gauss and Legendre's rule."""
    grid, weight = _RULE
    return low + (high - low) * (grid + 1) / 2, weight * (high - low) / 2


def _in_disc(offset: Array, std: Array, radius: float) -> float:
    """Return the chance of a circle, in strips across it; turned into angles, its edge is smooth."""
    angle, weight = _quadrature(-np.pi / 2, np.pi / 2)
    along, half = radius * np.sin(angle), radius * np.cos(angle)
    strip = ndtr((half - offset[1]) / std[1]) - ndtr((-half - offset[1]) / std[1])
    return float(weight @ (half * _density((along - offset[0]) / std[0]) / std[0] * strip))
