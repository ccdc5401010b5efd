"""A forward model that learns what the robot is made of: physical parameters, identified from the landings of its casts."""

from __future__ import annotations

from collections.abc import Sequence
from copy import copy
from typing import NamedTuple, Self

import numpy as np
from numpy.typing import ArrayLike

from wam_cast.adaptation.adaptive_model import AdaptiveModel, Posterior, believed_model
from wam_cast.adaptation.gauss_newton import most_probable
from wam_cast.adaptation.physical_prior import PhysicalPrior
from wam_cast.adaptation.robot import LANDING_STD
from wam_cast.adaptation.robot_distribution import RobotDistribution
from wam_cast.cast import Cast
from wam_cast.casting_plane import to_casting_plane
from wam_cast.planning.prediction import Predictor
from wam_cast.scenario import Scenario
from wam_cast.types import Array, checks_types

NEVER = 30.0
"""Residual, in standard deviations, of a cast that came down, and with some parameters does not."""


class _Landing(NamedTuple):
    """One that was observed: along and across the casting plane (2,) [m], and the variances (2,) about what parameters make it."""

    cast: Cast
    place: Array
    variance: Array


class IdentifiedModel(AdaptiveModel):
    """An `AdaptiveModel` whose believed robot is the one with the most probable physical parameters.

    Parameters have the standard deviations of the robots' ranges. Those that explain the observed landings best are found by
    Gauss and Newton's method through the simulation, from where the linear model has them, and the posterior about them is
    Laplace's: see `.most_probable`. Then `.N_SIMULATED` casts of that robot are simulated, and a forward model is fitted to them:
    to interpolate by how far robots differ, as the linear model does, errs by 2.6 mm (RMS) between 256 casts or 450, since where
    the string buckles landings differ abruptly; a forward model of one robot errs by 1.4 mm.

    What is approximate: uniform ranges count as normal ones of the same deviation. Of numbers by joint those are parameters that
    move landings, and all joints have the same share of Coulomb's friction; these, delays and whatever else is left out count as
    noise, independent from cast to cast and everywhere as large. The tilt's effect on a prediction is linear, and by how much the
    parameters' uncertainty moves landings is taken at the middle of the robots. The prior is not made wider by what is observed.
    Before the first cast it is the linear model.

    Once for a distribution it takes 8,000 casts by the batched engine, 35 s of a processor. To observe takes 12 s or so
    when there are 5 casts in all, 20 s when there are 20: three to nine times each cast with each parameter
    moved, and the casts of the robot.

    Attributes
    ----------
    parameters
        The most probable ones, in standard deviations from what is believed, as `physics.parameters` has them.
    """

    def __init__(self, believed: Predictor, physics: PhysicalPrior) -> None:
        super().__init__(believed, physics.linear)
        self.physics, self._landings = physics, list[_Landing]()
        self._linear = AdaptiveModel(believed, physics.linear)
        self.parameters = self.posterior.mean

    @classmethod
    @checks_types
    def from_prior(cls, robots: RobotDistribution, believed: Predictor | None = None) -> Self:
        """Return what is known of any robot of a distribution before its first cast: see `AdaptiveModel.from_prior`."""
        return cls(believed_model(robots, believed), PhysicalPrior(robots))

    @property
    def scenario(self) -> Scenario:
        """The one that robots are taken for."""
        return self._linear.scenario

    @property
    def n_observed(self) -> int:
        """Landings that it has learned from."""
        return len(self._landings)

    @checks_types
    def observe(
        self, casts: Sequence[Cast], landings: ArrayLike, std: float = LANDING_STD, *, is_measured: bool = False
    ) -> Self:
        """Return a model that knows these casts' landings too: see `AdaptiveModel.observe`. All at once is cheaper than by one."""
        learned = copy(self)
        learned._linear = self._linear.observe(casts, landings, std, is_measured=is_measured)
        learned._landings = self._landings + [
            _Landing(cast, np.array(to_casting_plane(place, cast.bearing)), std**2 + self._variance(cast, is_measured))
            for cast, place in zip(casts, np.asarray(landings, dtype=float), strict=True)
            if not np.isnan(place).any()
        ]
        return learned._identified() if learned._landings else learned

    def _variance(self, cast: Cast, is_measured: bool) -> Array:
        return np.asarray(self.scatter(cast.to_array(), is_measured) + self.physics.left_out)

    def _identified(self) -> Self:
        """Return the model about its most probable parameters."""
        z, covariance = most_probable(self._residuals, self._linear.posterior.mean)
        std = np.sqrt(np.diag(covariance))
        moved = copy(self)
        moved.parameters, moved._believed, moved._prior = z, self.physics.model(z), self.physics.about(std)
        # The model is of the robot with parameters z, but upright.
        mean = np.concatenate([np.zeros(len(z) - 2), (z / std)[-2:]])
        moved.posterior = Posterior(mean, covariance / np.outer(std, std))
        return moved

    def _residuals(self, z: Array) -> tuple[Array, Array]:
        """Return how far the robot with parameters z is off the observed landings, and the derivatives, in deviations."""
        places, slopes = self.physics.landings(z, [one.cast for one in self._landings])
        deviations = np.sqrt([one.variance for one in self._landings])
        residuals = (places - [one.place for one in self._landings]) / deviations
        jacobian = np.nan_to_num(slopes / deviations[..., np.newaxis]).reshape(-1, len(z))
        return np.nan_to_num(residuals, nan=NEVER).ravel(), jacobian
