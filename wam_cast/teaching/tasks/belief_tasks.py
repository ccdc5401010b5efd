"""Adapting to an unknown robot: what a cast teaches, what is believed after it, which cast teaches most, and where to aim."""

from __future__ import annotations

from functools import partial

import numpy as np

from wam_cast.teaching.answer import Answer, agree, require
from wam_cast.types import Array

EXACT = 1e-7
"""Tolerance of what has a closed form."""

AIMED = 1e-4
"""Tolerance of an aim that an answer may find step by step."""


def posterior(answer: Answer, rng: np.random.Generator) -> None:
    """Judge mean (n,) and covariance (n, n) after one observation, in information form; the order of two must not matter."""
    mean, covariance = rng.normal(size=4), _covariance(rng, 4)
    first, second = ((rng.normal(size=4), float(rng.normal())) for _ in range(2))
    noise_std = float(rng.uniform(0.3, 0.8))
    told = partial(_told, answer, noise_std=noise_std)
    new_mean, new_covariance = told(mean, covariance, *first)
    agree(new_covariance, new_covariance.T, EXACT, "the covariance is not symmetric")
    features, offset = first
    require(
        features @ new_covariance @ features < features @ covariance @ features,
        "after an observation the observed offset must be less uncertain than before",
    )
    right_mean, right_covariance = _informed(mean, covariance, [first], noise_std)
    mistakes = {
        "the noise's standard deviation is taken for its variance": _informed(
            mean, covariance, [first], noise_std**0.5
        )[1],
        "the noise of the measurement is missing": _informed(mean, covariance, [first], 1e-6)[1],
    }
    agree(new_covariance, right_covariance, EXACT, "the covariance is another one", mistakes)
    without = _informed(mean, covariance, [(features, offset + float(features @ mean))], noise_std)[0]
    words = "the mean is another one"
    agree(new_mean, right_mean, EXACT, words, {"what was expected of the cast is not taken off what was seen": without})
    one, other = (told(*told(mean, covariance, *a), *b) for a, b in ((first, second), (second, first)))
    agree(one[0], other[0], EXACT, "two observations teach something else in the other order")


def believed(answer: Answer, rng: np.random.Generator) -> None:
    """Judge mean and standard deviation of a cast's offset."""
    mean, covariance, features = rng.normal(size=4), _covariance(rng, 4), rng.normal(size=4)
    root = np.linalg.cholesky(covariance)
    std = float(np.linalg.norm(root.T @ features))
    offset, found = answer.parts(features, mean, covariance, mean=(), std=())
    agree(offset, float(features @ mean), EXACT, "the mean offset is another one")
    mistakes = {
        "that is the variance": std**2,
        "what is believed of one weight goes with what is believed of others: the covariance has more than a diagonal": float(
            np.linalg.norm(np.sqrt(np.diag(covariance)) * features)
        ),
    }
    agree(found, std, EXACT, "the standard deviation is another one", mistakes)


def most_telling(answer: Answer, rng: np.random.Generator) -> None:
    """Judge which candidate cast leaves the least variance of the targets' offsets; it is never the most uncertain one here."""
    n_tried = 0
    while n_tried < 4:
        covariance, noise_std = _covariance(rng, 3), 0.3
        candidates, targets = rng.normal(size=(6, 3)), rng.normal(size=(5, 3)) * [1.0, 0.2, 0.05]
        after = [_informed(np.zeros(3), covariance, [(one, 0.0)], noise_std)[1] for one in candidates]
        left = np.array([np.trace(targets @ one @ targets.T) for one in after])
        uncertain = int(np.argmax(np.sum((candidates @ covariance) * candidates, axis=1)))
        best, (least, next_least) = int(np.argmin(left)), np.sort(left)[:2]
        if best == uncertain or next_least < 1.05 * least:
            continue  # it would not tell these apart
        n_tried += 1
        found = answer(candidates, targets, covariance, noise_std)
        require(found in range(6), "the result must be the number of a candidate, from 0 on")
        mistakes = {
            "that cast is itself most uncertain; another one tells more about the targets": uncertain,
            "that one leaves the most uncertainty": int(np.argmax(left)),
        }
        agree(found, best, 0.0, "another one leaves less uncertainty of the targets", mistakes)


def aim(answer: Answer, rng: np.random.Generator) -> None:
    """Judge the aim at which the believed landing of the cast that is planned for it is the cup."""
    for _ in range(3):
        slope, mean, cup = rng.uniform(-0.5, 0.5, 3), rng.normal(0.0, 0.1, 3), float(rng.uniform(0.5, 1.0))

        def features_of(distance: float, slope: Array = slope) -> Array:
            return np.array([1.0, 0.5, -0.5]) + slope * (distance - 0.7)

        found = float(answer(cup, features_of, mean))
        landing = found + float(features_of(found) @ mean)
        offset = float(features_of(cup) @ mean)
        mistakes = {
            "it aims away on the wrong side": cup + offset + float(features_of(cup + offset) @ mean),
            "the cast for another aim is another cast, of another offset: once is not enough": cup
            - offset
            + float(features_of(cup - offset) @ mean),
            "it does not correct the aim": cup + offset,
        }
        agree(np.asarray(landing), cup, AIMED, "the cast that is planned for that aim is not believed to hit", mistakes)


TASKS = (posterior, believed, most_telling, aim)

Seen = tuple[Array, float]
"""Features of a cast, and the offset that was seen."""


def _told(
    answer: Answer, mean: Array, covariance: Array, features: Array, offset: float, *, noise_std: float
) -> tuple[Array, Array]:
    n = len(mean)
    new_mean, new_covariance = answer.parts(mean, covariance, features, offset, noise_std, mean=(n,), covariance=(n, n))
    return new_mean, new_covariance


def _covariance(rng: np.random.Generator, n: int) -> Array:
    root = rng.normal(size=(n, n))
    return np.asarray(root @ root.T + 0.1 * np.eye(n))


def _informed(mean: Array, covariance: Array, seen: list[Seen], noise_std: float) -> tuple[Array, Array]:
    """Return mean and covariance after observations, whose information adds up."""
    features, offsets = np.array([one for one, _ in seen]), np.array([offset for _, offset in seen])
    before = np.linalg.inv(covariance)
    after = np.linalg.inv(before + features.T @ features / noise_std**2)
    return after @ (before @ mean + features.T @ offsets / noise_std**2), after
