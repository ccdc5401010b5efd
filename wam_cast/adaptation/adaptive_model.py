"""A forward model that learns from the casts of one robot: what is known of robots like it, and what this one has shown."""

from __future__ import annotations

from collections.abc import Sequence
from copy import copy
from typing import Self

import numpy as np
from numpy.typing import ArrayLike

from wam_cast.adaptation.landing_prior import LandingPrior
from wam_cast.adaptation.robot import LANDING_STD
from wam_cast.cast import Cast
from wam_cast.errors import InputError, quoted
from wam_cast.planning.landing_distribution import scatter_of_move
from wam_cast.planning.prediction import ACROSS, ALONG, Linearization, Predictor
from wam_cast.scenario import Scenario
from wam_cast.types import Array, checks_types


class AdaptiveModel:
    """Predicts the landing of casts of one robot: the believed robot's, plus an offset with normally distributed weights.

    The weights' posterior given observed landings is that of Bayesian linear regression (Bishop, Pattern Recognition and Machine
    Learning, Eq. 3.50 and 3.51), each landing with its own variance: of the measurement, of the noise, and of what the offset and
    the believed robot's model leave. It is a `Predictor` for casts at one bearing, see `toward`; but for the landing its
    predictions are the believed robot's.

    Attributes
    ----------
    bearing
        Of the casts that are predicted [rad].
    weights, covariance
        Mean and covariance of the offset's weights, (n,) and (n, n).
    n_observed
        Landings that it has learned from.
    """

    def __init__(self, believed: Predictor, prior: LandingPrior) -> None:
        self._believed, self._prior = believed, prior
        self.bearing, self.n_observed = 0.0, 0
        self.weights: Array = np.zeros(prior.n_weights)
        self.covariance: Array = np.eye(prior.n_weights)

    @property
    def scenario(self) -> Scenario:
        """The believed robot's."""
        return self._believed.scenario

    @property
    def reach(self) -> tuple[float, float]:
        """The believed robot's [m]."""
        return self._believed.reach

    @property
    def training_casts(self) -> Array:
        """The believed robot's model's, where a search may start, shape (m, 3)."""
        return self._believed.training_casts

    @property
    def training_outputs(self) -> Array:
        """What this robot makes of them, shape (m, 7)."""
        return self._offset(self._believed.training_outputs, self.training_casts)

    def toward(self, bearing: float) -> Self:
        """Return the same model for casts at a bearing [rad]: a tilted base puts them off otherwise in each direction."""
        turned = copy(self)
        turned.bearing = bearing
        return turned

    @checks_types
    def observe(self, casts: Sequence[Cast], landings: ArrayLike, std: float = LANDING_STD) -> Self:
        """Return a model that knows these casts' landings too.

        Parameters
        ----------
        casts
            That were made.
        landings
            World (x, y) [m] of each, shape (k, 2); a row of nan, of a ball that did not come down, teaches nothing.
        std
            Standard deviation of the measurement, in x and in y [m].

        Raises
        ------
        InputError
            If there are not as many landings as casts, or they are no places.
        """
        places = np.asarray(landings, dtype=float)
        if places.shape != (len(casts), 2) or np.isinf(places).any():
            raise InputError(
                f"landings: {quoted(landings)} must be {len(casts)} pairs of world x and y [m], one a cast"
            )
        if not 0 <= std < np.inf:
            raise InputError(f"std = {std:g} m must be at least 0")
        learned = copy(self)
        for cast, place in zip(casts, places, strict=True):
            if not np.isnan(place).any():
                learned._learn(cast, place, std)
        return learned

    def _learn(self, cast: Cast, place: Array, std: float) -> None:
        """Update the weights by one landing."""
        x = cast.to_array()[:3]
        cosine, sine = np.cos(cast.bearing), np.sin(cast.bearing)
        in_plane = np.array([cosine * place[0] + sine * place[1], cosine * place[1] - sine * place[0]])
        mean, features = self._features(x[np.newaxis], cast.bearing)
        believed = self._believed.linearize(x)
        error = in_plane - believed.outputs[[ALONG, ACROSS]] - mean[0] - features[0].T @ self.weights
        noise = self.scenario.noise
        moved, _ = scatter_of_move(self._believed, x, noise)
        common = std**2 + (noise.swing * self.scenario.string.length) ** 2 + self._prior.rest_std**2
        variance = common + np.array([moved + believed.std**2, 0.0])
        gain = (
            self.covariance
            @ features[0]
            @ np.linalg.inv(features[0].T @ self.covariance @ features[0] + np.diag(variance))
        )
        self.weights = self.weights + gain @ error
        self.covariance = self.covariance - gain @ features[0].T @ self.covariance
        self.n_observed += 1

    def predict(self, casts: Array) -> Array:
        """Return the prediction, shape (n, 7), for casts of shape (n, 3)."""
        return self._offset(self._believed.predict(casts), casts)

    def linearize(self, cast: Array) -> Linearization:
        """Return the `.Linearization` about one cast, shape (3,)."""
        believed = self._believed.linearize(cast)
        values, slopes = self._prior.linearize(cast[np.newaxis], self.bearing)
        weights = np.concatenate([[1.0], self.weights])
        outputs, gradient = believed.outputs.copy(), believed.gradient.copy()
        outputs[[ALONG, ACROSS]] += weights @ values[0]
        gradient[[ALONG, ACROSS]] += np.einsum("c,cod->od", weights, slopes[0])
        along, along_slope = values[0, 1:, 0], slopes[0, 1:, 0]
        variance = believed.std**2 + along @ self.covariance @ along + self._prior.rest_std[0] ** 2
        std = float(np.sqrt(variance))
        slope = (believed.std * believed.std_gradient + along @ self.covariance @ along_slope) / std
        return Linearization(outputs, gradient, std, slope)

    def landing_with_gradient(self, casts: Array) -> tuple[Array, Array]:
        """Return the landing along the plane [m] of casts of shape (n, 3), shape (n,), and its derivative, shape (n, 3)."""
        landing, gradient = self._believed.landing_with_gradient(casts)
        values, slopes = self._prior.linearize(casts, self.bearing)
        weights = np.concatenate([[1.0], self.weights])
        return landing + values[..., 0] @ weights, gradient + np.einsum("c,ncd->nd", weights, slopes[:, :, 0])

    def across_std(self, cast: Array) -> float:
        """Return the standard deviation of the landing across the casting plane [m] of one cast, shape (3,)."""
        _, features = self._features(cast[np.newaxis], self.bearing)
        across = features[0, :, 1]
        return float(np.sqrt(across @ self.covariance @ across + self._prior.rest_std[1] ** 2))

    def _features(self, casts: Array, bearing: float) -> tuple[Array, Array]:
        """Return the prior's mean, (n, 2), and its components, (n, n_weights, 2)."""
        values = self._prior.predict(casts, bearing)
        return values[:, 0], values[:, 1:]

    def _offset(self, outputs: Array, casts: Array) -> Array:
        mean, features = self._features(casts, self.bearing)
        moved = outputs.copy()
        moved[:, [ALONG, ACROSS]] += mean + np.einsum("nco,c->no", features, self.weights)
        return moved
