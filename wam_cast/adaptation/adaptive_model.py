"""A forward model that learns from the casts of one robot: what is believed of robots like it, and what this one has shown."""

from __future__ import annotations

from collections.abc import Sequence
from copy import copy
from typing import NamedTuple, Self

import numpy as np
from numpy.typing import ArrayLike
from scipy.linalg import cho_factor, cho_solve

from wam_cast.adaptation.priors.known_priors import prior_of
from wam_cast.adaptation.priors.offset import OffsetPrior
from wam_cast.adaptation.robot import LANDING_STD, LARGEST_STD, MOVE_STD, Observation
from wam_cast.adaptation.robot_distribution import RobotDistribution
from wam_cast.cast import PARAMETERS, Cast
from wam_cast.casting_plane import to_casting_plane
from wam_cast.errors import InputError, checked_std, is_finite, quoted
from wam_cast.learning.forward_model import ForwardModel
from wam_cast.learning.reference import reference_model_for
from wam_cast.planning.landing_distribution import scatter_of_move, scatter_of_swing
from wam_cast.planning.prediction import (
    ACROSS,
    ALONG,
    ENTRY_SPEED,
    PEAK_TORQUE_UTILIZATION,
    PEAK_VELOCITY_UTILIZATION,
    Linearization,
    Predictor,
)
from wam_cast.scenario import Scenario
from wam_cast.types import Array, checks_types

LANDING = [ALONG, ACROSS]
PEAKS = [PEAK_TORQUE_UTILIZATION, PEAK_VELOCITY_UTILIZATION]

PEAK_DEVIATIONS = 2.0
"""Standard deviations that a predicted peak utilization lies above its mean: a robot that meets a limit stops short."""

REACH_DEVIATIONS = 2.0
"""By how many standard deviations of the landing the reach is less than the believed robot's."""

WIDTHS = (1.0, 1.5, 2.25, 3.4, 5.0)
"""Among these is the factor of the prior's standard deviations that best explains what is observed: a robot may be farther from
what is believed than those that the prior knows."""

WIDTH_COST = 1.0
"""By how much the logarithm of a width of e is less probable than a width of 1, before the first cast."""


class Posterior(NamedTuple):
    """Of an offset's weights: mean (n,) and covariance (n, n)."""

    mean: Array
    covariance: Array


class _Seen(NamedTuple):
    """Observed offsets: components (m, n_weights), what is seen beyond the mean (m,), and its variance but for the weights (m,)."""

    components: Array
    errors: Array
    variances: Array


class AdaptiveModel:
    """Predicts the landing of casts of one robot: the believed robot's, plus an offset with normally distributed weights.

    The weights' posterior given observed landings is that of Bayesian linear regression (Bishop, Pattern Recognition and Machine
    Learning, Eq. 3.49 to 3.51), each landing with its own variance: of the measurement, of the noise, and of what offset and
    believed model leave. How wide the prior is follows from the observations' evidence (his Eq. 3.86). It is a `Predictor` for
    casts at one bearing, see `toward`. Peak utilizations are those that 98 % of such robots stay below.

    Attributes
    ----------
    bearing
        Of the casts that are predicted [rad].
    posterior
        Of the weights.
    n_observed
        Landings that it has learned from.
    """

    def __init__(self, believed: Predictor, prior: OffsetPrior) -> None:
        self._believed, self._prior = believed, prior
        self.bearing = 0.0
        self._reach = _common_reach(believed, prior)
        self._seen = _Seen(np.empty((0, prior.n_weights)), np.empty(0), np.empty(0))
        self.posterior = _posterior(self._seen, 1.0)

    @classmethod
    @checks_types
    def from_prior(cls, robots: RobotDistribution, believed: Predictor | None = None) -> Self:
        """Return what is known of any robot of a distribution before its first cast.

        The prior is learned from an ensemble of such robots, once: see `.prior_of`.

        Parameters
        ----------
        robots
            What the robot may be.
        believed
            The forward model of the robot that all are taken for; by default the shipped one, if it serves `robots.believed`.

        Raises
        ------
        InputError
            If there is no such model, it is another scenario's, or the prior has to be learned and cannot.
        """
        return cls(believed_model(robots, believed), prior_of(robots))

    @property
    def scenario(self) -> Scenario:
        """The believed robot's."""
        return self._believed.scenario

    @property
    def reach(self) -> tuple[float, float]:
        """What 98 % of such robots reach, before the first cast [m]: less than the believed robot does."""
        return self._reach

    @property
    def training_casts(self) -> Array:
        """The believed model's, where a search may start, shape (m, 3)."""
        return self._believed.training_casts

    @property
    def training_outputs(self) -> Array:
        """What this robot makes of them, shape (m, 7)."""
        return self._moved(self._believed.training_outputs, self.training_casts)

    @property
    def n_observed(self) -> int:
        """Landings that it has learned from: each has two coordinates."""
        return len(self._seen.errors) // 2

    def toward(self, bearing: float) -> Self:
        """Return the same model for casts at a bearing [rad]: a tilted base puts them off otherwise in each direction."""
        if not is_finite(bearing):
            raise InputError(f"bearing = {quoted(bearing)} must be a finite number: an angle [rad]")
        turned = copy(self)
        turned.bearing = float(bearing)
        return turned

    @checks_types
    def learn(self, observations: Sequence[Observation]) -> Self:
        """Return a model that knows what was seen of these casts too.

        A cast counts as the arm's encoders saw it executed, unless the scenario's noise moves it by less than they err.
        """
        noise, learned = self.scenario.noise, self
        repeats = all(getattr(noise, name) <= getattr(MOVE_STD, name) for name in PARAMETERS)
        alike: dict[tuple[float, bool], list[Observation]] = {}
        for seen in observations:
            is_measured = seen.executed is not None and not repeats
            alike.setdefault((seen.landing_std, is_measured), []).append(seen)
        for (std, is_measured), some in alike.items():
            made = [seen.executed if is_measured and seen.executed else seen.cast for seen in some]
            learned = learned.observe(made, [seen.landing for seen in some], std, is_measured=is_measured)
        return learned

    @checks_types
    def observe(
        self, casts: Sequence[Cast], landings: ArrayLike, std: float = LANDING_STD, *, is_measured: bool = False
    ) -> Self:
        """Return a model that knows these casts' landings too.

        Parameters
        ----------
        casts
            That were made.
        landings
            World (x, y) [m] of each, shape (k, 2); a row of nan, of a ball that did not come down, teaches nothing.
        std
            Standard deviation of the measurement, in x and in y [m].
        is_measured
            Whether the casts are as the arm's encoders saw them made, to `.MOVE_STD`, and not as they were commanded: then the
            noise of the move does not hide where the robot casts.

        Raises
        ------
        InputError
            If there are not as many landings as casts, or they are no places.
        """
        try:
            places = np.asarray(landings, dtype=float) if len(casts) else np.empty((0, 2))
        except (TypeError, ValueError):
            places = np.empty(0)
        if places.shape != (len(casts), 2) or np.isinf(places).any():
            raise InputError(
                f"landings: {quoted(landings)} must be {len(casts)} pairs of world x and y [m], one a cast"
            )
        std = checked_std("std", std, LARGEST_STD)
        landed = [(cast, place) for cast, place in zip(casts, places, strict=True) if not np.isnan(place).any()]
        learned = copy(self)
        seen = [self._seen, *(self._observation(cast, place, std, is_measured) for cast, place in landed)]
        learned._seen = _Seen(*(np.concatenate(parts) for parts in zip(*seen, strict=True)))
        learned.posterior = _posterior(learned._seen, _likeliest_width(learned._seen))
        return learned

    def _observation(self, cast: Cast, place: Array, std: float, is_measured: bool) -> _Seen:
        """Return what one landing shows, along and across the casting plane."""
        x = cast.to_array()[:3]
        in_plane = np.array(to_casting_plane(place, cast.bearing))
        values = self._prior.predict(x[np.newaxis], cast.bearing).values[0][:, LANDING].T
        expected = self._believed.predict(x[np.newaxis])[0, LANDING] + values[:, 0]
        return _Seen(values[:, 1:], in_plane - expected, std**2 + self.noise_variance(x, is_measured))

    def noise_variance(self, cast: Array, is_measured: bool) -> Array:
        """Return the variance of one cast's landing along and across, (2,) [m^2], beyond that of the weights.

        It is that of the scenario's noise, of the move only as far as it is not measured, and of what offset and believed model
        leave.
        """
        along = self._believed.linearize(cast).std ** 2
        rest = self._prior.predict(cast[np.newaxis], self.bearing).variance[0, LANDING]
        return np.asarray(rest + self.scatter(cast, is_measured) + [along, 0.0])

    def scatter(self, cast: Array, is_measured: bool) -> Array:
        """Return the variance of one cast's landing along and across for the scenario's noise, (2,) [m^2]."""
        noise = self.scenario.noise
        moved, _ = scatter_of_move(self._believed, cast, MOVE_STD if is_measured else noise)
        entry_speed = self._believed.predict(cast[np.newaxis])[0, ENTRY_SPEED]
        return np.square(scatter_of_swing(self.scenario, noise, entry_speed)) + np.array([moved, 0.0])

    def landing_components(self, casts: Array) -> Array:
        """Return what each weight moves the landing along by [m], shape (n, n_weights), at casts of shape (n, 3)."""
        return self._prior.predict(casts, self.bearing).values[:, 1:, ALONG]

    def predict(self, casts: Array) -> Array:
        """Return the prediction, shape (n, 7), for casts of shape (n, 3)."""
        return self._moved(self._believed.predict(casts), casts)

    def predict_std(self, casts: Array) -> Array:
        """Return the standard deviations of what is predicted, shape (n, 7), for casts of shape (n, 3).

        The believed model's own error counts along the casting plane, where it is known; the noise of a cast does not.
        """
        offset = self._prior.predict(casts, self.bearing)
        variance = offset.variance + self._variance_of_weights(offset.values)
        variance[:, ALONG] += [self._believed.linearize(cast).std ** 2 for cast in casts]
        return np.sqrt(variance)

    def linearize(self, cast: Array) -> Linearization:
        """Return the `.Linearization` about one cast, shape (3,)."""
        believed, at = self._believed.linearize(cast), self._prior.linearize(cast[np.newaxis], self.bearing)
        weights = np.concatenate([[1.0], self.posterior.mean])
        outputs, gradient = believed.outputs + weights @ at.values[0], believed.gradient.copy()
        gradient += np.einsum("c,cod->od", weights, at.gradient[0])
        components, slopes = at.values[0, 1:], at.gradient[0, 1:]
        of_weights = self.posterior.covariance @ components
        variance = np.sum(components * of_weights, axis=0) + at.variance[0]
        slope = 2.0 * np.einsum("co,cod->od", of_weights, slopes) + at.variance_gradient[0]
        variance[ALONG] += believed.std**2
        slope[ALONG] += 2.0 * believed.std * believed.std_gradient
        std = np.sqrt(variance)
        std_slope = np.divide(slope, 2.0 * std[:, np.newaxis], out=np.zeros_like(slope), where=std[:, np.newaxis] > 0)
        outputs[PEAKS] += PEAK_DEVIATIONS * std[PEAKS]
        gradient[PEAKS] += PEAK_DEVIATIONS * std_slope[PEAKS]
        return Linearization(outputs, gradient, float(std[ALONG]), std_slope[ALONG])

    def landing_with_gradient(self, casts: Array) -> tuple[Array, Array]:
        """Return the landing along the plane [m] of casts of shape (n, 3), shape (n,), and its derivative, shape (n, 3)."""
        landing, gradient = self._believed.landing_with_gradient(casts)
        weights = np.concatenate([[1.0], self.posterior.mean])
        offset, slope = self._prior.landing_along(weights, casts, self.bearing)
        return landing + offset, gradient + slope

    def _moved(self, outputs: Array, casts: Array) -> Array:
        """Return the believed outputs of casts, moved by the offset."""
        offset = self._prior.predict(casts, self.bearing)
        moved = outputs + np.einsum("c,nco->no", np.concatenate([[1.0], self.posterior.mean]), offset.values)
        variance = offset.variance[:, PEAKS] + self._variance_of_weights(offset.values[..., PEAKS])
        moved[:, PEAKS] += PEAK_DEVIATIONS * np.sqrt(variance)
        return np.asarray(moved)

    def _variance_of_weights(self, values: Array) -> Array:
        """Return the variance of outputs for the weights' uncertainty, shape (n, outputs)."""
        components = values[:, 1:]
        return np.asarray(np.einsum("nco,cd,ndo->no", components, self.posterior.covariance, components, optimize=True))


def _common_reach(believed: Predictor, prior: OffsetPrior) -> tuple[float, float]:
    """Return the believed reach, less at either end by as much as a robot's landings may be off there."""
    ends = []
    for inward, end in zip((1.0, -1.0), believed.reach, strict=True):
        nearest = np.argmin(np.abs(believed.training_outputs[:, ALONG] - end))
        offset = prior.predict(believed.training_casts[nearest : nearest + 1], 0.0)
        components = offset.values[0, 1:, ALONG]
        std = np.sqrt(components @ components + offset.variance[0, ALONG])
        ends.append(end + inward * REACH_DEVIATIONS * float(std))
    return ends[0], ends[1]


def believed_model(robots: RobotDistribution, given: Predictor | None) -> Predictor:
    """Return the forward model of what robots are taken for: the given one, else the shipped one.

    It plans for the noise of what robots are taken for. Raises `.InputError` if there is none, or it is another scenario's.
    """
    model = given or reference_model_for(robots.believed)
    if model is None:
        raise InputError(
            "believed: the shipped forward model does not serve these robots' scenario; give one that was fitted to it, "
            "such as ForwardModel.load(FILE)"
        )
    if isinstance(model, ForwardModel):
        return model.bound_to(robots.believed, model.controller)
    if model.scenario != robots.believed:
        raise InputError("believed: the model is not of robots.believed, its noise included; give one that is")
    return model


def _posterior(seen: _Seen, width: float) -> Posterior:
    """Return the weights' posterior under a prior of that standard deviation."""
    n_weights = seen.components.shape[1]
    covariance = width**2 * np.eye(n_weights)
    if not len(seen.errors):
        return Posterior(np.zeros(n_weights), covariance)
    gain = width**2 * cho_solve(_factor(seen, width), seen.components).T
    return Posterior(gain @ seen.errors, covariance - width**2 * gain @ seen.components)


def _factor(seen: _Seen, width: float) -> tuple[Array, bool]:
    """Return the Cholesky factor of what was seen's covariance before it was seen, and that it is the lower one."""
    factor: tuple[Array, bool] = cho_factor(
        width**2 * seen.components @ seen.components.T + np.diag(seen.variances), lower=True
    )
    return factor


def _likeliest_width(seen: _Seen) -> float:
    """Return the width of the prior that is the most probable one after the observations."""
    if not len(seen.errors):
        return 1.0

    def log_probability(width: float) -> float:
        factor, lower = _factor(seen, width)
        evidence = -0.5 * seen.errors @ cho_solve((factor, lower), seen.errors) - np.log(np.diag(factor)).sum()
        return float(evidence - WIDTH_COST * np.log(width))

    return max(WIDTHS, key=log_probability)
