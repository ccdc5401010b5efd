"""The predictive standard deviation of the landing: the posterior of the model's kernel, corrected by the model's own errors.

A Gaussian process with the regression's kernel knows how far the training casts are, but takes the landing for equally
rough everywhere. It is not: where the string buckles the errors are ten times larger than elsewhere, among training casts
that are as dense. Leave-one-out shows these errors, since it predicts each training cast from all the others.
"""

from __future__ import annotations

import math
from copy import copy
from dataclasses import dataclass, replace
from typing import Annotated

import numpy as np
from pydantic import Field
from scipy.special import stdtrit

from wam_cast.learning.hyperparameters import REGULARIZATION_BOUNDS, tune_by_lbfgs
from wam_cast.learning.kernel.kernel_matrix import gaussian_kernel
from wam_cast.learning.kernel.kernel_regression import KernelRegression
from wam_cast.learning.losses import LeaveOneOutLoss
from wam_cast.parallel.threads import one_thread
from wam_cast.types import Array

TUNING_ROWS = 1000
"""At least so many training casts, and less than twice as many, choose the correction's sigma and lambda: each evaluation costs
their number cubed."""

CORRECTION_START_SIGMA = 0.2
"""Where that search starts, in units of the bounds: one for all parameters, since errors are too noisy to tell three apart."""

LOG_CHANCE_VARIANCE = math.pi**2 / 8
"""Of the logarithm of a normal variable's magnitude, whatever its standard deviation: what is chance in an error's logarithm."""

COVERAGE = 0.95
"""Share of the held-out casts that two standard deviations hold."""

LEAST_RATIO = 1e-3
"""Of an error to the posterior's prediction of it, below which all are alike: its logarithm has no lower end."""

LEAST_EIGENVALUE = 1e-2
"""Of the kernel matrix, in units of lambda, down to which its eigenvectors are kept."""


LEAST_VARIANCE = 1e-12
"""Of the posterior, in units of its prior: without a lambda it is 0 at a training cast, and rounding makes anything of that."""

LARGEST_LOG_RATIO = 50.0
"""Magnitude of an error's logarithm: from less than rounding errors to more than any error [m]."""

# What a file may say; who computes such a number is not asked.
LengthScale = Annotated[float, Field(ge=1e-6, le=1e6)]
Regularization = Annotated[float, Field(ge=0, le=1e6)]
Scale = Annotated[float, Field(ge=1e-9, le=1e9)]


@dataclass(frozen=True)
class ErrorFit:
    """What `LandingUncertainty` learned.

    Attributes
    ----------
    sigma, regularization
        Of the correction's kernel: ARD length scales and lambda.
    scale
        By which the errors of held-out casts are larger than predicted without it; see `held_out_scale`.
    """

    sigma: tuple[LengthScale, LengthScale, LengthScale]
    regularization: Annotated[float, Field(ge=1e-12, le=1e6)]
    scale: Scale


class LandingUncertainty:
    """Predictive standard deviation of the landing along the casting plane.

    ::

        std(x) = scale * posterior(x) * exp(g(x)),     posterior(x)^2 = 1 - k(x)^T (K + lambda I)^-1 k(x) + lambda

    The posterior is that of a Gaussian process with the model's kernel (Rasmussen and Williams, Gaussian Processes for Machine
    Learning, Eq. 2.26). g is a kernel ridge regression of its own, of the logarithm of the ratio of each training cast's
    leave-one-out error to the posterior without that cast (their section 5.4.2). `scale` makes two standard deviations hold 95 %
    of held-out casts: errors have long tails, so that their mean square says little of that. The first output of the
    fitted `estimator` is the landing; g is fitted to `log_ratios`, shape (n_train,); `fit` is what `learn` found.
    """

    def __init__(self, estimator: KernelRegression, log_ratios: Array, fit: ErrorFit) -> None:
        self.log_ratios, self.fit = log_ratios, fit
        self._centers, self._offset = estimator.centers_, estimator.input_offset_
        self._length_scale, self._regularization = estimator.length_scale_, estimator.regularization_
        self._whitening = _whitening(estimator)
        self._correction = KernelRegression(
            sigma=fit.sigma,
            regularization=fit.regularization,
            input_bounds=estimator.input_bounds,
            n_landmarks=estimator.n_landmarks,
        ).fit(estimator.X_fit_, log_ratios)

    @classmethod
    def learn(cls, estimator: KernelRegression) -> LandingUncertainty:
        """Learn from the estimator's own training casts. The scale is 1: see `scaled_by`."""
        residuals, inverse_diagonal = estimator.leave_one_out()
        ratios = np.abs(residuals[:, 0]) * np.sqrt(inverse_diagonal)
        # In units of a typical error, so that only errors that are as good as zero come near the least ratio.
        unit = float(np.median(ratios)) or 1.0
        log_ratios = np.log(ratios / unit + LEAST_RATIO) + np.log(unit)
        rows = slice(None, None, max(1, len(log_ratios) // TUNING_ROWS))
        loss = LeaveOneOutLoss(estimator.X_fit_[rows], log_ratios[rows], input_bounds=estimator.input_bounds)
        least, most = _regularization_bounds(log_ratios)
        tuned = tune_by_lbfgs(
            loss, sigma0=CORRECTION_START_SIGMA, regularization0=least, regularization_bounds=(least, most)
        )
        sigma = float(tuned.sigma)
        return cls(estimator, log_ratios, ErrorFit((sigma, sigma, sigma), float(tuned.regularization), scale=1.0))

    def scaled_by(self, errors: Array) -> LandingUncertainty:
        """Return it times what makes two of it hold 95 % of held-out casts, given their errors in units of it, shape (n,)."""
        scaled = copy(self)
        scaled.fit = replace(self.fit, scale=self.fit.scale * held_out_scale(errors))
        return scaled

    def std(self, X: Array) -> Array:
        """Return the predictive standard deviation [m], shape (n,), at casts of shape (n, 3)."""
        K = gaussian_kernel(*((rows - self._offset) / self._length_scale for rows in (X, self._centers)))
        variance = 1.0 - np.sum((K @ self._whitening.T) ** 2, axis=1)
        variance = np.maximum(np.maximum(variance, 0.0) + self._regularization, LEAST_VARIANCE)
        log_ratio = np.clip(self._correction.predict(X), -LARGEST_LOG_RATIO, LARGEST_LOG_RATIO)
        return np.asarray(self.fit.scale * np.exp(log_ratio) * np.sqrt(variance))

    def linearize(self, x: Array) -> tuple[float, Array]:
        """Return the standard deviation [m] at one cast, shape (3,), and its derivative in SI units, shape (3,)."""
        offsets = (x - self._centers) / self._length_scale
        kernel = np.exp(-np.einsum("ij,ij->i", offsets, offsets))
        white = self._whitening @ kernel
        variance = max(max(1.0 - float(white @ white), 0.0) + self._regularization, LEAST_VARIANCE)
        # d variance / dz = -2 white^T W dk / dz, with dk_n / dz = -2 (z - z_n) k_n
        slope = 4.0 * ((white @ self._whitening) * kernel) @ offsets / self._length_scale
        log_ratio, log_slope = self._correction.linearize(x[np.newaxis])
        log_ratio = np.clip(log_ratio, -LARGEST_LOG_RATIO, LARGEST_LOG_RATIO)
        std = self.fit.scale * float(np.exp(log_ratio[0])) * variance**0.5
        return std, std * (log_slope[0] + slope / (2 * variance))


class ConstantUncertainty:
    """A predictive standard deviation that is the same for all casts: `value` [m]."""

    def __init__(self, value: float) -> None:
        self.value = value

    def std(self, X: Array) -> Array:
        """Return the predictive standard deviation [m], shape (n,), at casts of shape (n, 3)."""
        return np.full(len(X), self.value)

    def linearize(self, x: Array) -> tuple[float, Array]:
        """Return the standard deviation [m] at one cast, shape (3,), and its derivative, which is 0, shape (3,)."""
        return self.value, np.zeros_like(x)


def held_out_scale(errors: Array) -> float:
    """Return the standard deviation of which two hold 95 % of new errors, given those of held-out casts, shape (n,).

    It is half the quantile that does so whatever their distribution (split conformal prediction). A few casts do not show that
    quantile: below 19 there is no room for it. The scale is therefore at least that of normal errors whose variance is known from
    n of them, Student's t.
    """
    n = len(errors)
    rank = min(n, math.ceil((n + 1) * COVERAGE))
    quantile = np.sort(np.abs(errors))[rank - 1]
    normal = stdtrit(n, (1 + COVERAGE) / 2) * np.sqrt(np.mean(errors**2))
    return float(max(quantile, normal)) / 2


def _regularization_bounds(log_ratios: Array) -> tuple[float, float]:
    """Return between which lambda is sought for the correction, in units of its signal's variance.

    An error may be small by chance, and a planner would seek just these. What its logarithm has of variance beyond chance is the
    signal's; where it has none, errors are taken for equally large.
    """
    least, most = REGULARIZATION_BOUNDS
    signal = float(np.var(log_ratios)) - LOG_CHANCE_VARIANCE
    return (most if signal <= 0 else float(np.clip(LOG_CHANCE_VARIANCE / signal, least, most))), most


def _whitening(estimator: KernelRegression) -> Array:
    """Return W, shape (r, n_centers), with W^T W = (K + lambda I)^-1 up to eigenvalues so small that they explain nothing.

    As a sum of squares the explained variance keeps its digits; the product k^T (K + lambda I)^-1 k loses most of them where
    little is left to explain.
    """
    if estimator.landmarks_ is not None:
        return estimator.landmarks_.whitening()
    Z_fit = (estimator.X_fit_ - estimator.input_offset_) / estimator.length_scale_
    regularization = estimator.regularization_
    with one_thread():
        values, vectors = np.linalg.eigh(gaussian_kernel(Z_fit, Z_fit))
    kept = values > LEAST_EIGENVALUE * max(regularization, np.finfo(np.float64).eps)
    return np.ascontiguousarray(vectors[:, kept].T / np.sqrt(values[kept] + regularization)[:, np.newaxis])
