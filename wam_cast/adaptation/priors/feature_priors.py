"""Priors that know nothing of robots: a shift, an affine function of the cast, and any smooth function of it."""

from __future__ import annotations

import numpy as np
from scipy.linalg import solve_triangular

from wam_cast.adaptation.priors.offset import Offset, OffsetLinearization
from wam_cast.cast import cast_bounds
from wam_cast.planning.prediction import ACROSS, ALONG, OUTPUTS
from wam_cast.scenario import Scenario
from wam_cast.types import Array

ALONG_STD, ACROSS_STD = 0.01, 0.003
"""Standard deviation of how far a landing is off, along and across [m]: about that of the default robots."""

KERNEL_SIGMA = 0.7
"""Length scale of a smooth function, in casts scaled to the unit cube of their bounds."""

N_CENTERS_LOG2 = 6
"""64 centers carry a smooth function."""

N_OUTPUTS = len(OUTPUTS)


class FeaturePrior:
    """An offset of the landing that is a weighted sum of features of the cast, along and across by weights of their own.

    A subclass says what they are: `_features(u)` returns them at casts scaled to the unit cube of the bounds, shape (n, p), and
    their derivatives by u, shape (n, p, 3). Their weights have the standard deviations `ALONG_STD` and `ACROSS_STD` times `scale`.
    """

    n_features: int

    def __init__(self, scenario: Scenario, scale: float = 1.0) -> None:
        self._lower, upper = cast_bounds(scenario)
        self._span = upper - self._lower
        self._stds = {ALONG: scale * ALONG_STD, ACROSS: scale * ACROSS_STD}

    @property
    def n_weights(self) -> int:
        """Number of weights: of each feature along and across."""
        return 2 * self.n_features

    def predict(self, casts: Array, bearing: float) -> Offset:
        """Return it at casts (n, 3); whatever the bearing, it is the same."""
        at = self.linearize(casts, bearing)
        return Offset(at.values, at.variance)

    def linearize(self, casts: Array, bearing: float) -> OffsetLinearization:
        """Return it with its derivatives by the cast in SI units."""
        del bearing
        features, slopes = self._features((casts - self._lower) / self._span)
        n = len(casts)
        values = np.zeros((n, 1 + self.n_weights, N_OUTPUTS))
        gradient = np.zeros((*values.shape, 3))
        for which, (output, std) in enumerate(self._stds.items()):
            own = slice(1 + which * self.n_features, 1 + (which + 1) * self.n_features)
            values[:, own, output] = std * features
            gradient[:, own, output] = std * slopes / self._span
        return OffsetLinearization(values, np.zeros((n, N_OUTPUTS)), gradient, np.zeros((n, N_OUTPUTS, 3)))

    def landing_along(self, weights: Array, casts: Array, bearing: float) -> tuple[Array, Array]:
        """Return the weighted landing along the plane [m], shape (n,), and its derivatives, shape (n, 3)."""
        at = self.linearize(casts, bearing)
        return at.values[..., ALONG] @ weights, np.einsum("c,ncd->nd", weights, at.gradient[:, :, ALONG])

    def _features(self, u: Array) -> tuple[Array, Array]:
        raise NotImplementedError


class NoOffset(FeaturePrior):
    """The robot is the believed one: nothing is learned."""

    n_features = 0

    def _features(self, u: Array) -> tuple[Array, Array]:
        return np.empty((len(u), 0)), np.empty((len(u), 0, 3))


class Shift(FeaturePrior):
    """All casts are as far off."""

    n_features = 1

    def _features(self, u: Array) -> tuple[Array, Array]:
        return np.ones((len(u), 1)), np.zeros((len(u), 1, 3))


class Affine(FeaturePrior):
    """A shift, and a slope by each parameter: over half its bounds it is as large as the shift may be."""

    n_features = 4

    def _features(self, u: Array) -> tuple[Array, Array]:
        slopes = np.vstack([np.zeros(3), 2.0 * np.eye(3)])
        return np.column_stack([np.ones(len(u)), 2.0 * u - 1.0]), np.broadcast_to(slopes, (len(u), 4, 3))


class SmoothOffset(FeaturePrior):
    """A Gaussian process with a Gaussian kernel, which carries a shift too, in the span of its values at some centers.

    ::

        phi(u) = L^-1 k(U, u),     L L^T = k(U, U)

    so that phi(u)^T phi(v) is the kernel wherever u is a center (the subset of regressors: Rasmussen and Williams, Gaussian
    Processes for Machine Learning, Eq. 8.13).
    """

    n_features = 2**N_CENTERS_LOG2

    def __init__(self, scenario: Scenario, scale: float = 1.0) -> None:
        from scipy.stats import qmc  # takes a second, which the other priors do without

        super().__init__(scenario, scale)
        self._centers = qmc.Sobol(3, seed=0).random_base2(N_CENTERS_LOG2)
        kernel = _kernel(self._centers, self._centers) + 1e-6 * np.eye(self.n_features)
        self._factor = np.linalg.cholesky(kernel)

    def _features(self, u: Array) -> tuple[Array, Array]:
        kernel = _kernel(u, self._centers)
        offsets = (u[:, np.newaxis] - self._centers) / KERNEL_SIGMA**2
        slopes = -2.0 * offsets * kernel[..., np.newaxis]
        whitened = solve_triangular(self._factor, np.eye(self.n_features), lower=True)
        return kernel @ whitened.T, np.einsum("cd,ndi->nci", whitened, slopes)


def _kernel(u: Array, v: Array) -> Array:
    """Return the covariances of values at u and v, shape (n, m), that of a shift included."""
    squared = ((u[:, np.newaxis] - v) ** 2).sum(axis=-1) / KERNEL_SIGMA**2
    return np.asarray(np.exp(-squared))
