"""Numbers that describe many casts."""

from __future__ import annotations

import math
from typing import TypedDict

import numpy as np
from scipy.special import ndtri

from wam_cast.types import Array


class Statistics(TypedDict):
    """How many finite values there are, and their mean, median, 95th percentile and maximum, None if there are none."""

    n: int
    mean: float | None
    median: float | None
    p95: float | None
    max: float | None


def describe(values: Array) -> Statistics:
    """Return the statistics of the finite ones among `values`, shape (n,)."""
    finite = values[np.isfinite(values)]
    if len(finite) == 0:
        return Statistics(n=0, mean=None, median=None, p95=None, max=None)
    return Statistics(
        n=len(finite),
        mean=float(np.mean(finite)),
        median=float(np.median(finite)),
        p95=float(np.percentile(finite, 95)),
        max=float(np.max(finite)),
    )


def rmse(residuals: Array) -> float:
    """Return the root of the mean squared residual."""
    return float(np.sqrt(np.mean(residuals**2)))


def rmse_interval(residuals: Array, seed: int) -> tuple[float, float]:
    """Return the 95 % interval of the RMSE of residuals, shape (n,), by the bootstrap over them (percentiles, 2000 resamples)."""
    from scipy import stats  # takes a second, which a cast and its preview do not need

    def root_mean_square(sample: Array, axis: int = -1) -> Array:
        return np.asarray(np.sqrt(np.mean(sample**2, axis=axis)))

    interval = stats.bootstrap(
        (residuals,), root_mean_square, n_resamples=2000, method="percentile", rng=np.random.default_rng(seed)
    ).confidence_interval
    return float(interval.low), float(interval.high)


def wilson_interval(n_hits: int, n: int) -> tuple[float, float]:
    """Return Wilson's 95 % interval of a rate (Wilson, Journal of the American Statistical Association 22, 1927)."""
    z2 = float(ndtri(0.975)) ** 2
    middle, denominator = n_hits + z2 / 2, n + z2
    half = math.sqrt(z2 * (n_hits * (n - n_hits) / n + z2 / 4))
    # Of no hits, or nothing else, one end is the rate itself, which rounding would miss.
    return (middle - half) / denominator if n_hits else 0.0, (middle + half) / denominator if n_hits < n else 1.0


def coverage(residuals: Array, std: Array, shares: Array) -> Array:
    """Return which share of normal errors of standard deviations `std`, shape (n,), lies within the central intervals of `shares`.

    The residuals, shape (n,), are honest if that is the share that each interval should hold, shape (m,).
    """
    half_widths = ndtri((1 + shares) / 2)
    return np.asarray(np.mean(np.abs(residuals / std)[:, np.newaxis] <= half_widths, axis=0))
