"""A model that learns from a few casts of one robot, held to what is known in closed form."""

import numpy as np
import pytest

from wam_cast.adaptation.adaptive_model import AdaptiveModel
from wam_cast.adaptation.priors.interpolated_prior import InterpolatedPrior
from wam_cast.adaptation.priors.robot_ensemble import RobotEnsemble
from wam_cast.adaptation.robot_distribution import RobotDistribution
from wam_cast.cast import Cast, cast_bounds
from wam_cast.errors import InputError
from wam_cast.learning.reference import reference_model
from wam_cast.planning.prediction import ACROSS, ALONG, Predictor
from wam_cast.scenario import Noise, Scenario

LOWER, UPPER = cast_bounds(Scenario())


def filling(n, seed):
    return np.random.default_rng(seed).uniform(LOWER, UPPER, size=(n, 3))


def shapes(casts):
    """Return two smooth ways in which casts differ, (2, n, 7): the landing, and the entry angle that goes with the first."""
    distance, speed, wait = ((casts - LOWER) / (UPPER - LOWER)).T
    along = [0.01 * (1 + distance), 0.006 * np.cos(2 * speed) * (1 - wait)]
    across = [0.001 * speed, 0.002 * np.ones(len(casts))]
    others = np.zeros((2, len(casts), 5))
    others[0, :, 0] = 0.02
    landings = np.stack([np.stack(pair, axis=-1) for pair in zip(along, across, strict=True)])
    return np.concatenate([landings, others], axis=-1)


def offsets(casts, weights):
    return np.einsum("rc,cno->rno", weights, shapes(casts))


@pytest.fixture(scope="module")
def prior():
    rng, casts = np.random.default_rng(0), filling(120, seed=1)
    by_tilt = np.zeros((2, 120, 7))
    by_tilt[0, :, ALONG], by_tilt[1, :, ACROSS] = 0.3, 0.5
    ensemble = RobotEnsemble(casts, offsets(casts, rng.standard_normal((60, 2))), by_tilt, tilt_std=0.003)
    return InterpolatedPrior.of_ensemble(Scenario(), ensemble)


@pytest.fixture(scope="module")
def model(prior):
    return AdaptiveModel(reference_model(), prior)


def landings_of_a_robot(casts, weights):
    """Return the world (x, y) of casts at bearing 0 of a robot whose offset is known, (n, 2)."""
    return reference_model().predict(casts)[:, [ALONG, ACROSS]] + offsets(casts, weights[np.newaxis])[0, :, :2]


def made(casts, bearing=0.0):
    return [Cast(*row, bearing=bearing) for row in casts]


def test_it_is_a_predictor(model):
    assert isinstance(model, Predictor)
    assert model.training_outputs.shape == reference_model().training_outputs.shape


def test_a_given_model_counts_with_the_noise_of_the_robots():
    robots = RobotDistribution()
    given = AdaptiveModel.from_prior(robots, reference_model())
    assert given.scenario.noise == robots.believed.noise == Noise.typical()
    cast = filling(1, seed=2)[0]
    np.testing.assert_allclose(
        given.noise_variance(cast, False), AdaptiveModel.from_prior(robots).noise_variance(cast, False)
    )
    with pytest.raises(InputError):
        AdaptiveModel.from_prior(RobotDistribution(Scenario.from_dict({"ball": {"mass": 0.05}})), reference_model())


def test_a_few_casts_show_what_a_robot_is(model):
    weights, seen, fresh = np.array([1.5, -1.0]), filling(6, seed=2), filling(200, seed=3)
    learned = model.observe(made(seen), landings_of_a_robot(seen, weights), std=1e-4)
    truth = landings_of_a_robot(fresh, weights)
    before, after = (np.abs(one.predict(fresh)[:, [ALONG, ACROSS]] - truth).max(axis=0) for one in (model, learned))
    assert before[0] > 0.02
    assert after[0] < 0.003
    assert after[1] < 0.001
    assert learned.n_observed == 6
    assert model.n_observed == 0


def test_the_standard_deviation_holds_what_it_says_of_robots_like_these(model):
    rng, z = np.random.default_rng(5), []
    for _ in range(60):
        weights, casts = rng.standard_normal(2), filling(12, seed=int(rng.integers(10**6)))
        truth = landings_of_a_robot(casts, weights)[:, 0]
        z += [(t - one.outputs[ALONG]) / one.std for t, one in zip(truth, map(model.linearize, casts), strict=True)]
    # One error a robot counts twelve times, so that the shares are those of 60 draws.
    assert np.mean(np.abs(z) <= 1) == pytest.approx(0.68, abs=0.15)
    assert np.mean(np.abs(z) <= 2) == pytest.approx(0.95, abs=0.06)


def test_it_becomes_surer_and_the_order_is_of_no_consequence(model):
    casts = filling(5, seed=7)
    places = landings_of_a_robot(casts, np.array([0.5, 0.5]))
    learned, reverse = model.observe(made(casts), places), model.observe(made(casts[::-1]), places[::-1])
    np.testing.assert_allclose(learned.posterior.mean, reverse.posterior.mean, atol=1e-9)
    np.testing.assert_allclose(learned.posterior.covariance, reverse.posterior.covariance, atol=1e-9)
    for x in filling(10, seed=8):
        assert np.all((learned.predict_std(x[np.newaxis]) < model.predict_std(x[np.newaxis]))[0, :3])
        assert learned.linearize(x).std == pytest.approx(learned.predict_std(x[np.newaxis])[0, ALONG])


def test_derivatives_are_those_of_the_prediction(model):
    casts = filling(3, seed=9)
    learned = model.observe(made(casts), landings_of_a_robot(casts, np.array([1.0, 1.0]))).toward(0.4)
    for x in filling(4, seed=10):
        steps = 1e-5 * np.diag(UPPER - LOWER)
        above, below = (learned.predict(x + sign * steps) for sign in (1, -1))
        slope = ((above - below) / (2 * np.diag(steps))[:, np.newaxis]).T
        found = learned.linearize(x)
        np.testing.assert_allclose(found.outputs, learned.predict(x[np.newaxis])[0], rtol=1e-9)
        np.testing.assert_allclose(found.gradient, slope, rtol=1e-4, atol=1e-6)
        std = [(learned.linearize(x + s).std - learned.linearize(x - s).std) / (2 * s.sum()) for s in steps]
        np.testing.assert_allclose(found.std_gradient, std, rtol=1e-3, atol=1e-6)
        landing, gradient = learned.landing_with_gradient(x[np.newaxis])
        assert landing[0] == pytest.approx(found.outputs[ALONG], rel=1e-9)
        np.testing.assert_allclose(gradient[0], found.gradient[ALONG], rtol=1e-6, atol=1e-9)


def test_a_tilted_base_puts_casts_off_in_the_worlds_directions(model, prior):
    # About the world's x axis it moves landings along by 0.3 and about y across by 0.5 m/rad at bearing 0; the last two weights.
    turned = model.toward(np.pi / 2)
    for one, expected in ((model, [[0.0009, 0.0], [0.0, 0.0015]]), (turned, [[0.0, -0.0015], [0.0009, 0.0]])):
        components = prior.predict(filling(5, seed=11), one.bearing).values[:, -2:, :2]
        np.testing.assert_allclose(components, np.broadcast_to(expected, (5, 2, 2)), atol=2e-5)


def test_the_direction_of_a_cast_does_not_change_what_it_shows(model):
    casts, bearing = filling(3, seed=12), 0.7
    x, y = landings_of_a_robot(casts, np.array([1.0, 0.0])).T
    turned = np.column_stack([np.cos(bearing) * x - np.sin(bearing) * y, np.sin(bearing) * x + np.cos(bearing) * y])
    ahead = model.observe(made(casts), np.column_stack([x, y]))
    aside = model.observe(made(casts, bearing), turned)
    np.testing.assert_allclose(aside.posterior.mean[:2], ahead.posterior.mean[:2], atol=0.05)


def test_a_ball_that_never_came_down_teaches_nothing(model):
    assert model.observe(made(filling(1, seed=1)), [[np.nan, np.nan]]).n_observed == 0


@pytest.mark.parametrize("landings", [[[0.5, 0.0]], [[0.5], [0.5]], [[0.5, np.inf], [0.5, 0.0]]])
def test_landings_that_are_none_are_refused(model, landings):
    with pytest.raises(InputError, match="2 pairs of world x and y"):
        model.observe(made(filling(2, seed=1)), landings)
