"""A prior whose mean and components are known at some casts, and interpolated between them."""

from __future__ import annotations

from copy import copy
from typing import TYPE_CHECKING, Self

import numpy as np
from scipy.special import ndtri

from wam_cast.adaptation.priors.offset import Offset, OffsetLinearization
from wam_cast.cast import cast_bounds
from wam_cast.learning.kernel.kernel_regression import KernelRegression
from wam_cast.planning.prediction import ALONG, OUTPUTS
from wam_cast.scenario import Scenario
from wam_cast.types import Array

if TYPE_CHECKING:
    from wam_cast.adaptation.priors.robot_ensemble import RobotEnsemble

N_COMPONENTS = 20
"""Principal components of an ensemble that are kept. Of the default robots' landings one explains 85 %, twenty 99.95 %."""

SIGMA, REGULARIZATION = 0.4, 1e-3
"""Of the kernel that interpolates: of those that leave out a cast of the default ensemble at a time, about the best."""

REST_SIGMA, REST_REGULARIZATION = 0.5, 1.0
"""Of the kernel that smooths the rest's logarithm."""

LEAST_VARIANCE = 1e-12
"""Of the rest: (1 um)^2 of a landing."""

N_DRAWN = 200
"""Robots whose errors of interpolation tell how large the rest is."""

N_OUTPUTS = len(OUTPUTS)


class InterpolatedPrior:
    """Mean and components by kernel ridge regression over the casts at which they are known.

    The rest is what the components leave out, and what interpolation gets wrong, which each cast left out in turn shows. It is ten
    times larger where the string buckles than elsewhere, and follows the place therefore.

    Parameters
    ----------
    scenario
        Whose bounds the casts keep.
    casts
        `[distance, speed, wait]`, shape (m, 3).
    values
        Mean and components there, shape (m, 1 + n_weights, 7). The last two are the effects of the base's tilt about the world's
        axes at bearing 0.
    left_out
        Variance of what the components leave out, shape (m, 7).
    """

    def __init__(self, scenario: Scenario, casts: Array, values: Array, left_out: Array) -> None:
        self._scenario = scenario
        self.casts, self.values, self.left_out = casts, values, left_out
        bounds = cast_bounds(scenario)
        self._values = KernelRegression(sigma=SIGMA, regularization=REGULARIZATION, input_bounds=bounds)
        self._values.fit(casts, values.reshape(len(casts), -1))
        errors = self._values.leave_one_out_residuals().reshape(values.shape)
        variance = (errors**2).sum(axis=1) + left_out + LEAST_VARIANCE
        self._rest = KernelRegression(sigma=REST_SIGMA, regularization=REST_REGULARIZATION, input_bounds=bounds)
        self._rest.fit(casts, np.log(variance))
        smoothed = np.exp(np.log(variance) - self._rest.leave_one_out_residuals())
        self._rest_scale = _normal_scale(errors, left_out, smoothed)

    @classmethod
    def of_ensemble(cls, scenario: Scenario, ensemble: RobotEnsemble) -> Self:
        """Return the prior whose components are the principal ones of the landings of an ensemble (Karhunen and Loeve).

        The other outputs follow the landings, as far as they do: what they have beside is left out.
        """
        n_robots = len(ensemble.offsets)
        mean = ensemble.offsets.mean(axis=0)
        from_mean = (ensemble.offsets - mean) / np.sqrt(n_robots - 1)
        of_robots, _, _ = np.linalg.svd(from_mean[..., :2].reshape(n_robots, -1), full_matrices=False)
        of_robots = of_robots[:, : min(N_COMPONENTS, n_robots - 1)]
        components = np.einsum("rc,rmo->cmo", of_robots, from_mean)
        left_out = (from_mean**2).sum(axis=0) - (components**2).sum(axis=0)
        tilts = ensemble.tilt_std * ensemble.by_tilt
        values = np.concatenate([mean[np.newaxis], components, tilts]).transpose(1, 0, 2)
        return cls(scenario, ensemble.casts, values, np.maximum(left_out, 0.0))

    def scaled(self, scale: float) -> Self:
        """Return the prior of robots that are so many times as far from what is believed: to first order, all is in proportion."""
        if scale == 1.0:
            return self
        return type(self)(self._scenario, self.casts, scale * self.values, scale**2 * self.left_out)

    @property
    def n_weights(self) -> int:
        """Number of weights."""
        return int(self.values.shape[1]) - 1

    def predict(self, casts: Array, bearing: float) -> Offset:
        """Return mean, components and rest at casts (n, 3) at a bearing [rad]."""
        values = self._values.predict(casts).reshape(len(casts), -1, N_OUTPUTS)
        return Offset(_turned(values, bearing), self._rest_scale * np.exp(self._rest.predict(casts)))

    def linearize(self, casts: Array, bearing: float) -> OffsetLinearization:
        """Return them with their derivatives by the cast in SI units."""
        values, gradient = self._values.linearize(casts)
        log_variance, log_gradient = self._rest.linearize(casts)
        variance, n = self._rest_scale * np.exp(log_variance), len(casts)
        return OffsetLinearization(
            _turned(values.reshape(n, -1, N_OUTPUTS), bearing),
            variance,
            _turned(gradient.reshape(n, -1, N_OUTPUTS, 3), bearing),
            variance[..., np.newaxis] * log_gradient,
        )

    def landing_along(self, weights: Array, casts: Array, bearing: float) -> tuple[Array, Array]:
        """Return the weighted landing along the plane [m], shape (n,), and its derivatives, shape (n, 3)."""
        turned = weights.copy()
        turned[-2:] = _rotation(bearing).T @ weights[-2:]
        one = copy(self._values)
        one.dual_coef_ = self._values.dual_coef_.reshape(len(self.casts), -1, N_OUTPUTS)[..., ALONG] @ turned
        one.target_mean_ = self._values.target_mean_.reshape(-1, N_OUTPUTS)[:, ALONG] @ turned
        return one.linearize(casts)


def _rotation(bearing: float) -> Array:
    """Return what turns effects of tilts about the plane's axes to those of tilts about the world's, shape (2, 2)."""
    cosine, sine = np.cos(bearing), np.sin(bearing)
    return np.array([[cosine, -sine], [sine, cosine]])


def _normal_scale(errors: Array, left_out: Array, variance: Array) -> Array:
    """Return by what to multiply variances, (m, 7), so that they hold errors as those of a normal variable do, shape (7,).

    Errors of interpolation, (m, 1 + n_weights, 7), are drawn for many robots. Nine of ten are then within 1.64 deviations: errors
    have long tails, which would make a mean square larger than what is typical.
    """
    rng = np.random.default_rng(0)
    weights = np.column_stack([np.ones(N_DRAWN), rng.standard_normal((N_DRAWN, errors.shape[1] - 1))])
    drawn = np.einsum("rc,mco->rmo", weights, errors)
    drawn += np.sqrt(left_out) * rng.standard_normal(drawn.shape)
    ratios = np.abs(drawn) / np.sqrt(variance)
    return np.asarray((np.quantile(ratios, 0.9, axis=(0, 1)) / ndtri(0.95)) ** 2)


def _turned(values: Array, bearing: float) -> Array:
    """Return components, the last two of which are the effects of tilts about the plane's axes, of tilts about the world's."""
    values[:, -2:] = np.einsum("ij,nj...->ni...", _rotation(bearing), values[:, -2:])
    return values
