"""Casts simulated with physical parameters of a robot that are not known: at any of them, and their derivatives by them."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from wam_cast.adaptation.physical_parameters import PhysicalParameters
from wam_cast.adaptation.priors.filling import filling_casts
from wam_cast.adaptation.priors.interpolated_prior import InterpolatedPrior
from wam_cast.adaptation.priors.robot_ensemble import FIRST_SEED
from wam_cast.adaptation.robot_distribution import RobotDistribution
from wam_cast.batch.arguments import Precision
from wam_cast.batch.engine import simulate_batch
from wam_cast.cast import Cast
from wam_cast.errors import InputError
from wam_cast.learning.dataset import CastDataset
from wam_cast.learning.forward_model import ForwardModel
from wam_cast.learning.reference import reference_model
from wam_cast.planning.prediction import ACROSS, ALONG, OUTPUTS
from wam_cast.scenario import Scenario
from wam_cast.types import Array

N_CASTS = 256
"""At which it is known how robots differ; in between it is interpolated."""

N_SIMULATED = 1700
"""Casts of one robot, from which a forward model learns: as many as the shipped one has."""

N_LEFT_OUT = 8
"""Robots that tell how much is left out."""

STEP, LONG_STEP = 0.01, 0.1
"""Of a parameter, in its standard deviations, over which a difference is taken: in double precision, and in single, which errs by
up to 7 micrometres."""


class PhysicalPrior:
    """How robots of a distribution differ by their physical parameters, as the batched engine has it.

    Derivatives are differences: a cast with them all, in a batch, takes 4 ms of a processor for each parameter, 8 ms in double
    precision; JAX's forward mode takes 19 ms, and knows neither slack nor peaks.

    Attributes
    ----------
    parameters
        That count.
    linear
        The prior that takes landings for linear in the parameters, about their means.
    left_out
        Variance that the numbers of the robots that are no parameters give landings along and across, (2,) [m^2].
    """

    def __init__(self, robots: RobotDistribution, n_casts: int = N_CASTS) -> None:
        self._belief = robots.believed.without_noise
        self.parameters = PhysicalParameters.of(robots)
        casts, nothing = filling_casts(self._belief, n_casts), np.zeros(self.parameters.n)
        drawn = [robots.draw(FIRST_SEED + number).without_noise for number in range(N_LEFT_OUT)]
        others = [self.parameters.scenario(nothing, of=robot) for robot in drawn]
        points = [self.parameters.scenario(z) for z in _around(nothing, LONG_STEP)]
        outputs = self._simulated([[self._belief, *points, *others]] * len(casts), casts)
        lands = np.isfinite(outputs).all(axis=(1, 2))
        if lands.mean() < 0.5:
            raise InputError(f"robots: {lands.sum()} of {len(casts)} casts land on all of them; choose narrower ranges")
        self._casts, outputs = casts[lands], outputs[lands]
        self._expected, middle = outputs[:, 0], outputs[:, 1]
        self._slopes = _slopes(outputs[:, 1 : 2 + self.parameters.n], LONG_STEP)
        left_out = ((outputs[:, 2 + self.parameters.n :] - middle[:, np.newaxis]) ** 2).mean(axis=1)
        self.left_out = left_out[:, [ALONG, ACROSS]].mean(axis=0)
        self._left_out = left_out
        self.linear = self._interpolated(middle, np.ones(self.parameters.n))

    def landings(self, z: Array, casts: Sequence[Cast]) -> tuple[Array, Array]:
        """Return landings along and across of casts with parameters z, (k, 2), and the derivatives by them, (k, 2, n).

        nan of balls that do not come down. In place of the arm the base's tilt is turned by a cast's bearing: that saves the turn.
        """
        by_bearing = {
            bearing: [self.parameters.scenario(_turned(point, bearing)) for point in _around(z, STEP)]
            for bearing in {cast.bearing for cast in casts}
        }
        rows = np.array([cast.to_array() for cast in casts])
        outputs = self._simulated([by_bearing[cast.bearing] for cast in casts], rows, "float64")[..., [ALONG, ACROSS]]
        return outputs[:, 0], _slopes(outputs, STEP).transpose(0, 2, 1)

    def model(self, z: Array) -> ForwardModel:
        """Return a forward model of the robot with parameters z, but upright, fitted to `N_SIMULATED` casts of it.

        Its kernel is the shipped model's.
        """
        robot = self.parameters.scenario(np.concatenate([z[:-2], np.zeros(2)]))
        casts = filling_casts(self._belief, N_SIMULATED)
        frame = simulate_batch(robot, casts, precision="float32", belief=self._belief)
        kernel = reference_model().info
        data = CastDataset(robot, 0, frame, engine="batch")
        return ForwardModel.from_hyperparameters(data, kernel.sigma, kernel.regularization)

    def about(self, std: Array) -> InterpolatedPrior:
        """Return the prior of robots whose parameters have deviations `std` about those of a `model`: its mean is none."""
        return self._interpolated(self._expected, std)

    def _interpolated(self, outputs: Array, std: Array) -> InterpolatedPrior:
        mean = (outputs - self._expected)[:, np.newaxis]
        values = np.concatenate([mean, std[:, np.newaxis] * self._slopes], axis=1)
        return InterpolatedPrior(self._belief, self._casts, values, self._left_out)

    def _simulated(
        self, scenarios: Sequence[Sequence[Scenario]], casts: Array, precision: Precision = "float32"
    ) -> Array:
        """Return the outputs of each cast with each of its scenarios, as many for all, shape (m, s, 7)."""
        by_scenario = [one for same in zip(*scenarios, strict=True) for one in same]
        n = len(scenarios[0])
        frame = simulate_batch(by_scenario, np.tile(casts, (n, 1)), precision=precision, belief=self._belief)
        outputs = frame[list(OUTPUTS)].to_numpy(dtype=float).reshape(n, len(casts), len(OUTPUTS))
        return outputs.transpose(1, 0, 2)


def _around(z: Array, step: float) -> Array:
    """Return parameters, and those a step beside in each, shape (1 + n, n)."""
    return np.asarray(z + np.vstack([np.zeros(len(z)), step * np.eye(len(z))]))


def _slopes(outputs: Array, step: float) -> Array:
    """Return the derivatives by parameters of outputs (m, 1 + n, o) of those around some, shape (m, n, o)."""
    return np.asarray((outputs[:, 1:] - outputs[:, :1]) / step)


def _turned(z: Array, bearing: float) -> Array:
    """Return parameters whose tilt, the last two, about the world's axes is given about those of a casting plane."""
    c, s = np.cos(bearing), np.sin(bearing)
    return np.concatenate([z[:-2], [[c, s], [-s, c]] @ z[-2:]])
