"""Priors that know nothing of robots, against closed forms."""

import numpy as np
import pytest

from wam_cast.adaptation.adaptive_model import AdaptiveModel
from wam_cast.adaptation.priors.feature_priors import (
    ACROSS_STD,
    ALONG_STD,
    KERNEL_SIGMA,
    Affine,
    NoOffset,
    Shift,
    SmoothOffset,
)
from wam_cast.adaptation.priors.offset import OffsetPrior
from wam_cast.cast import Cast, cast_bounds
from wam_cast.learning.reference import reference_model
from wam_cast.planning.prediction import ACROSS, ALONG
from wam_cast.scenario import Scenario

LOWER, UPPER = cast_bounds(Scenario())
PRIORS = (NoOffset, Shift, Affine, SmoothOffset)


def casts(n, seed=0):
    return np.random.default_rng(seed).uniform(LOWER, UPPER, size=(n, 3))


def covariance(prior, x, y, output):
    """Return the prior's covariance of an output between casts x and y."""
    return prior.predict(x, 0.0).values[:, 1:, output] @ prior.predict(y, 0.0).values[:, 1:, output].T


@pytest.mark.parametrize("make", PRIORS)
def test_derivatives_are_those_of_the_values(make):
    prior, step = make(Scenario(), 2.0), 1e-6 * (UPPER - LOWER)
    assert isinstance(prior, OffsetPrior)
    x = casts(4)
    at = prior.linearize(x, 0.3)
    for i in range(3):
        above, below = (prior.predict(x + sign * step * np.eye(3)[i], 0.3).values for sign in (1, -1))
        np.testing.assert_allclose(at.gradient[..., i], (above - below) / (2 * step[i]), rtol=1e-4, atol=1e-6)
    weights = np.random.default_rng(1).standard_normal(1 + prior.n_weights)
    value, slope = prior.landing_along(weights, x, 0.3)
    np.testing.assert_allclose(value, at.values[..., ALONG] @ weights, atol=1e-15)
    np.testing.assert_allclose(slope, np.einsum("c,ncd->nd", weights, at.gradient[:, :, ALONG]), atol=1e-12)


@pytest.mark.parametrize("make", PRIORS[1:])
def test_along_and_across_are_independent_and_as_large_as_told(make):
    prior, middle = make(Scenario(), 2.0), (LOWER + UPPER)[np.newaxis] / 2
    assert covariance(prior, middle, middle, ALONG)[0, 0] == pytest.approx((2 * ALONG_STD) ** 2, rel=0.02)
    assert covariance(prior, middle, middle, ACROSS)[0, 0] == pytest.approx((2 * ACROSS_STD) ** 2, rel=0.02)
    values = prior.predict(middle, 0.0).values[0, 1:]
    assert np.all(values[:, ALONG] * values[:, ACROSS] == 0)


def test_a_smooth_offset_has_the_covariance_of_its_kernel():
    prior, x = SmoothOffset(Scenario()), casts(30)
    u = (x - LOWER) / (UPPER - LOWER)
    kernel = np.exp(-((u[:, np.newaxis] - u) ** 2).sum(axis=-1) / KERNEL_SIGMA**2)
    np.testing.assert_allclose(covariance(prior, x, x, ALONG) / ALONG_STD**2, kernel, atol=0.02)


def test_a_shift_is_the_mean_of_what_was_seen_shrunk_as_normal_means_are():
    model = AdaptiveModel(reference_model(), Shift(Scenario()))
    x, std, true = casts(5, seed=3), 1e-3, 0.004
    landings = reference_model().predict(x)[:, [ALONG, ACROSS]] + [true, 0.0]
    learned = model.observe([Cast(*row) for row in x], landings, std)
    precision = 1 / ALONG_STD**2 + sum(1 / (std**2 + model.noise_variance(row, False)[0]) for row in x)
    seen = sum(true / (std**2 + model.noise_variance(row, False)[0]) for row in x)
    fresh = casts(3, seed=4)
    off = learned.predict(fresh)[:, ALONG] - reference_model().predict(fresh)[:, ALONG]
    np.testing.assert_allclose(off, seen / precision, rtol=1e-9)


def test_nothing_is_learned_of_the_believed_robot():
    model, x = AdaptiveModel(reference_model(), NoOffset(Scenario())), casts(4, seed=5)
    learned = model.observe([Cast(*x[0])], [[0.9, 0.1]])
    np.testing.assert_array_equal(learned.predict(x), reference_model().predict(x))
    assert model.reach == pytest.approx(reference_model().reach)
