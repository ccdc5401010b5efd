"""What is known of a robot's landings before its first cast: how those of robots like it differ from the believed robot's."""

from __future__ import annotations

import numpy as np

from wam_cast.adaptation.landing_ensemble import LandingEnsemble
from wam_cast.cast import cast_bounds
from wam_cast.learning.kernel_ridge import KernelRidge
from wam_cast.scenario import Scenario
from wam_cast.types import Array

N_COMPONENTS = 12
"""Principal components that are kept. Of the default robots' landings along the plane one explains 86 %, ten 99 %."""

SIGMA, REGULARIZATION = 0.5, 1e-4
"""Of the kernel that interpolates components between the ensemble's casts."""


class LandingPrior:
    """A landing off the believed robot's, along and across, as a sum of components with normal weights.

    ::

        offset(x) = mean(x) + sum_c z_c phi_c(x) + rest,     z ~ N(0, I)

    Components are the principal ones of an ensemble of robots (Karhunen and Loeve), interpolated between its casts by kernel ridge
    regression; the last two are the effects of the base's tilt about the casting plane's own axes. `rest` is what they leave.

    Attributes
    ----------
    n_weights
        Number of weights z.
    rest_std
        Standard deviation of what the components leave of a landing, along and across [m], shape (2,).
    """

    def __init__(self, scenario: Scenario, ensemble: LandingEnsemble) -> None:
        n_robots, n_casts, _ = ensemble.offsets.shape
        flat = ensemble.offsets.reshape(n_robots, -1)
        mean = flat.mean(axis=0)
        _, strengths, directions = np.linalg.svd(flat - mean, full_matrices=False)
        kept = min(N_COMPONENTS, n_robots - 1)
        components = strengths[:kept, np.newaxis] * directions[:kept] / np.sqrt(n_robots - 1)
        tilts = ensemble.tilt_std * ensemble.by_tilt.reshape(2, -1)
        self.n_weights = kept + 2
        targets = np.vstack([mean, components, tilts]).reshape(self.n_weights + 1, n_casts, 2)
        self._estimator = KernelRidge(sigma=SIGMA, regularization=REGULARIZATION, input_bounds=cast_bounds(scenario))
        self._estimator.fit(ensemble.casts, targets.transpose(1, 0, 2).reshape(n_casts, -1))
        left_out = self._estimator.leave_one_out_residuals().reshape(n_casts, -1, 2)
        truncated = (strengths[kept:, np.newaxis] * directions[kept:] / np.sqrt(n_robots - 1)).reshape(-1, n_casts, 2)
        self.rest_std: Array = np.sqrt(
            (left_out[:, 1:] ** 2).sum(axis=1).mean(axis=0) + (truncated**2).sum(axis=0).mean(axis=0)
        )

    def predict(self, casts: Array, bearing: float) -> Array:
        """Return mean and components at casts (n, 3) at a bearing [rad], shape (n, 1 + n_weights, 2)."""
        return _turned(self._estimator.predict(casts).reshape(len(casts), -1, 2), bearing)

    def linearize(self, casts: Array, bearing: float) -> tuple[Array, Array]:
        """Return the same, and the derivatives by the cast in SI units, shape (n, 1 + n_weights, 2, 3)."""
        values, gradient = self._estimator.linearize(casts)
        n = len(casts)
        return _turned(values.reshape(n, -1, 2), bearing), _turned(gradient.reshape(n, -1, 2, 3), bearing)


def _turned(values: Array, bearing: float) -> Array:
    """Return components, the last two of which are the effects of tilts about the plane's axes, of tilts about the world's."""
    x, y = values[:, -2].copy(), values[:, -1].copy()
    values[:, -2] = np.cos(bearing) * x - np.sin(bearing) * y
    values[:, -1] = np.sin(bearing) * x + np.cos(bearing) * y
    return values
