"""Regression: polynomials, a kernel, its ridge, and leave-one-out, which is compared with leaving out each cast in turn."""

from __future__ import annotations

from itertools import combinations_with_replacement

import numpy as np

from wam_cast.teaching.answer import Answer, agree, require
from wam_cast.types import Array

EXACT = 1e-7
"""Tolerance of what has a closed form."""


def monomials(answer: Answer, rng: np.random.Generator) -> None:
    """Judge features (n, k) by what they span: all polynomials of three variables up to a degree, and no others."""
    X = rng.uniform(-1, 1, (60, 3))
    for degree in (1, 2, 3):
        features = answer(X, degree, shape=None)
        require(
            features.ndim == 2 and len(features) == len(X),
            f"the result must have a row for each of {len(X)} casts, and has the shape {features.shape}",
        )
        # One after the other, so that the first that is missing is named.
        chosen = [powers for k in range(degree + 1) for powers in combinations_with_replacement(range(3), k)]
        for powers in chosen:
            column = np.prod(X[:, list(powers)], axis=1)
            weights, *_ = np.linalg.lstsq(features, column, rcond=None)
            if np.max(np.abs(features @ weights - column)) > EXACT:
                kind = {0: "a constant", 1: "a variable alone"}.get(len(powers), "a power of one variable")
                kind = kind if len(set(powers)) < 2 else "a product of several variables"
                require(False, f"degree {degree}: {kind} is not among the polynomials that the columns make")
        n = features.shape[1]
        require(
            n <= len(chosen), f"degree {degree}: {n} columns are too many; some are of a higher degree or twice there"
        )


def gaussian_kernel(answer: Answer, rng: np.random.Generator) -> None:
    """Judge the kernel matrix (n, m)."""
    A, B, sigma = rng.uniform(size=(4, 3)), rng.uniform(size=(6, 3)), float(rng.uniform(0.4, 0.8))
    square = answer(A, A, sigma, shape=(4, 4))
    agree(square, square.T, EXACT, "k(x, x') = k(x', x) fails: the matrix of a set with itself is not symmetric")
    agree(np.diag(square), np.ones(4), EXACT, "a cast is as like itself as can be: k(x, x) must be 1")
    exponent = np.array([[sum((a - b) ** 2 for a, b in zip(x, y, strict=True)) for y in B] for x in A])
    mistakes = {
        "it falls off too slowly: one sigma away the kernel must be 1/e": np.exp(-exponent / (2 * sigma**2)),
        "sigma must scale the distance, so both are squared": np.exp(-exponent / sigma),
        "the distance is not squared": np.exp(-np.sqrt(exponent) / sigma),
        "the distance is not squared, and sigma is": np.exp(-np.sqrt(exponent) / sigma**2),
    }
    found = answer(A, B, sigma, shape=(4, 6))
    agree(found, np.exp(-exponent / sigma**2), EXACT, "it does not fall off as it should", mistakes)


def ridge_weights(answer: Answer, rng: np.random.Generator) -> None:
    """Judge the weights (n,), by the equations that they solve."""
    K, y, regularization = _problem(rng)
    weights = answer(K, y, regularization, shape=y.shape)
    one = np.eye(len(y))
    mistakes = {
        "regularization is added to the diagonal alone, not to all of K": np.linalg.solve(K + regularization, y),
        "regularization is missing": np.linalg.solve(K, y),
        "regularization has the wrong sign": np.linalg.solve(K - regularization * one, y),
        "those are weights of features; a kernel's have K once": np.linalg.solve(K @ K + regularization * one, K @ y),
    }
    # What is compared is the left side, of weights that are right and of those that mistakes give.
    left = K + regularization * one
    words = "the weights do not leave the residuals that ridge regression does"
    agree(left @ weights, y, EXACT, words, {hint: left @ other for hint, other in mistakes.items()})


def leave_one_out(answer: Answer, rng: np.random.Generator) -> None:
    """Judge the errors (n,), measured minus predicted, by leaving out each in turn."""
    K, y, regularization = _problem(rng)
    expected = _left_out(K, y, regularization)
    residual = y - K @ np.linalg.solve(K + regularization * np.eye(len(y)), y)
    mistakes = {
        "the sign is wrong: measured minus predicted": -expected,
        "those are the errors of casts that the model has learned from": residual,
        "those are squares; the errors themselves are wanted": expected**2,
    }
    words = "leaving out each cast in turn gives other errors"
    agree(answer(K, y, regularization, shape=y.shape), expected, EXACT, words, mistakes)


def best_sigma(answer: Answer, rng: np.random.Generator) -> None:
    """Judge the choice of sigma by leave-one-out."""
    X, sigmas, regularization = rng.uniform(size=(30, 3)), np.array([0.02, 0.1, 0.3, 0.8, 2.0, 30.0]), 1e-3
    for frequency in (1.0, 5.0):
        y = np.sin(frequency * X[:, 0]) + X[:, 1] * X[:, 2] + 0.02 * rng.normal(size=30)
        distance = np.sum((X[:, None] - X) ** 2, axis=2)
        kernels = [np.exp(-distance / sigma**2) for sigma in sigmas]
        errors = [np.sqrt(np.mean(_left_out(K, y, regularization) ** 2)) for K in kernels]
        training = [np.linalg.norm(y - K @ np.linalg.solve(K + regularization * np.eye(30), y)) for K in kernels]
        best = int(np.argmin(errors))
        found = float(answer(X, y, sigmas, regularization))
        mistakes = {
            "it is chosen by the error of casts that were learned from": sigmas[np.argmin(training)],
            "that is the place of sigma among those given, not sigma": best,
            "that sigma errs most": sigmas[np.argmax(errors)],
        }
        right = float(sigmas[best])
        if not np.any(np.isclose(found, [*sigmas, *map(float, mistakes.values())])):
            require(False, "it is none of the sigmas that were given")
        agree(np.asarray(found), right, 1e-6, "another sigma has a smaller leave-one-out error", mistakes)


TASKS = (monomials, gaussian_kernel, ridge_weights, leave_one_out, best_sigma)


def _problem(rng: np.random.Generator, n: int = 12) -> tuple[Array, Array, float]:
    """Return a kernel matrix (n, n), values (n,) and a regularization."""
    X = rng.uniform(size=(n, 3))
    K = np.exp(-np.sum((X[:, None] - X) ** 2, axis=2) / 0.25)
    return K, rng.normal(size=n), float(rng.uniform(0.05, 0.2))


def _left_out(K: Array, y: Array, regularization: float) -> Array:
    """Return the error of each value, predicted from all the others."""
    errors = np.empty(len(y))
    for i in range(len(y)):
        rest = np.arange(len(y)) != i
        weights = np.linalg.solve(K[np.ix_(rest, rest)] + regularization * np.eye(len(y) - 1), y[rest])
        errors[i] = y[i] - K[i, rest] @ weights
    return errors
