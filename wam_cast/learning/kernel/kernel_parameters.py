"""What the parameters of `.KernelRidge` and its samples' weights may be: checks that say so, and the scaling of its inputs."""

from __future__ import annotations

from numbers import Integral

import numpy as np
from numpy.typing import ArrayLike

from wam_cast.errors import quoted
from wam_cast.types import Array


def input_scale(X: Array, input_bounds: tuple[ArrayLike, ArrayLike] | None) -> tuple[Array, Array]:
    """Return the offset and the range that scale inputs to the unit cube, each of shape (n_features,), in units of the inputs.

    They are those of `input_bounds`, or of the training inputs X, shape (n_samples, n_features). The range of a constant column is
    then infinite, which scales any value to 0. Raises a ValueError that says what is allowed if the bounds are not.
    """
    if input_bounds is None:
        lower, upper = X.min(axis=0), X.max(axis=0)
        return lower, np.where(upper > lower, upper - lower, np.inf)
    n_features = X.shape[1]
    try:
        lower, upper = (np.broadcast_to(np.asarray(b, dtype=np.float64), n_features) for b in input_bounds)
        is_allowed = bool(np.all(np.isfinite(lower) & np.isfinite(upper) & (lower < upper)))
    except (TypeError, ValueError):
        is_allowed = False
    if not is_allowed:
        raise ValueError(
            f"input_bounds={quoted(input_bounds)} is not allowed: it must be None or a pair (lower, upper), each finite, a number "
            f"or one for each of the {n_features} inputs, with lower < upper; pass for example input_bounds=None to take the "
            "bounds from the training inputs"
        )
    return lower.copy(), upper - lower


def checked_sigma(sigma: float | ArrayLike, n_features: int, *, name: str = "sigma") -> Array:
    """Return the width of the kernel for each input, or raise a ValueError that says what is allowed."""
    try:
        widths = np.asarray(sigma, dtype=np.float64)
        is_allowed = widths.shape in ((), (n_features,)) and bool(np.all(np.isfinite(widths) & (widths > 0)))
    except (TypeError, ValueError):
        is_allowed = False
    if not is_allowed:
        raise ValueError(
            f"{name}={quoted(sigma)} is not allowed: it must be a finite number > 0, or one for each of the "
            f"{n_features} inputs, in units of the scaled inputs; pass for example {name}=0.35"
        )
    return np.broadcast_to(widths, n_features)


def checked_regularization(regularization: float) -> float:
    """Return λ as a float, or raise a ValueError that says what is allowed."""
    try:
        value = float(regularization)
    except (TypeError, ValueError):
        value = np.nan
    if not 0 <= value < np.inf:
        raise ValueError(
            f"regularization={quoted(regularization)} is not allowed: it must be a finite number >= 0; "
            "pass for example regularization=1e-6"
        )
    return value


def checked_n_landmarks(n_landmarks: object, regularization: float) -> int | None:
    """Return the number of landmarks, or raise a ValueError that says what is allowed: with any, λ must be > 0."""
    if n_landmarks is None:
        return None
    if isinstance(n_landmarks, bool) or not isinstance(n_landmarks, Integral) or n_landmarks < 1:
        raise ValueError(
            f"n_landmarks={quoted(n_landmarks)} is not allowed: it must be None or an integer >= 1; pass None to solve exactly"
        )
    if regularization == 0:
        raise ValueError(
            "regularization=0 is not allowed with n_landmarks: it must be > 0; pass for example regularization=1e-6"
        )
    return int(n_landmarks)


def checked_sample_weight(sample_weight: float | ArrayLike, n_samples: int) -> Array:
    """Return the weight of each sample, or raise a ValueError that says what is allowed."""
    try:
        weights = np.asarray(sample_weight, dtype=np.float64)
        is_allowed = weights.shape in ((), (n_samples,)) and bool(np.all(np.isfinite(weights) & (weights >= 0)))
    except (TypeError, ValueError):
        is_allowed = False
    if not is_allowed:
        raise ValueError(
            f"sample_weight={quoted(sample_weight)} is not allowed: it must be a finite number >= 0, or one for each of the "
            f"{n_samples} samples; pass for example sample_weight=None to weigh all alike"
        )
    if not np.any(weights):
        # The words of scikit-learn, by which its checks know the error.
        raise ValueError("sample_weight: Sample weights must contain at least one non-zero number.")
    return np.broadcast_to(weights, n_samples).copy()
