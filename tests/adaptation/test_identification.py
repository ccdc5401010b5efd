"""What a robot is made of follows from its casts: held to robots whose numbers are known, and to the engine's own derivatives."""

import numpy as np
import pytest

pytest.importorskip("jax", reason="the extra `batch` is not installed")

from wam_cast.adaptation import physical_prior
from wam_cast.adaptation.identification import IdentifiedModel
from wam_cast.adaptation.physical_prior import PhysicalPrior
from wam_cast.adaptation.priors.filling import filling_casts
from wam_cast.adaptation.robot_distribution import RobotDistribution, number
from wam_cast.batch.derivatives import batch_derivatives
from wam_cast.batch.engine import simulate_batch
from wam_cast.cast import Cast, cast_bounds, is_allowed
from wam_cast.casting_plane import from_casting_plane
from wam_cast.errors import InputError
from wam_cast.learning.dataset import CastDataset
from wam_cast.learning.forward_model import ForwardModel
from wam_cast.learning.reference import reference_dataset, reference_model
from wam_cast.planning.prediction import ALONG, Predictor
from wam_cast.scenario import Scenario

pytestmark = pytest.mark.slow

BELIEVED = Scenario()
ROBOTS = RobotDistribution(BELIEVED)
MILD = np.array([[0.30, 0.60, 0.10], [0.25, 0.50, 0.20], [0.35, 0.70, 0.15]])
"""Casts in which the string does not buckle."""


N_SIMULATED = 600
"""Casts of the identified robot: a third of the usual ones."""


@pytest.fixture(scope="module", autouse=True)
def _fewer_casts():
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(physical_prior, "N_SIMULATED", N_SIMULATED)
        yield


@pytest.fixture(scope="module")
def physics():
    return PhysicalPrior(ROBOTS, n_casts=64)


@pytest.fixture(scope="module")
def model(physics):
    return IdentifiedModel(reference_model(), physics)


def random_casts(n, seed):
    lower, upper = cast_bounds(BELIEVED)
    casts = np.random.default_rng(seed).uniform(lower, upper, size=(4 * n, 3))
    return casts[is_allowed(BELIEVED, casts)][:n]


def landings(scenario, casts):
    """Return the world (x, y) of casts (n, 3) at bearing 0, (n, 2)."""
    frame = simulate_batch(scenario, casts, precision="float32", belief=BELIEVED)
    return frame[["landing_along", "landing_across"]].to_numpy(dtype=float)


def small_model():
    """Return the forward model of the believed robot after as many casts."""
    data, kernel = reference_dataset(), reference_model().info
    few = CastDataset(data.scenario, data.seed, data.frame[:N_SIMULATED])
    return ForwardModel.from_hyperparameters(few, kernel.sigma, kernel.regularization)


def made(casts, bearing=0.0):
    return [Cast(*row, bearing=bearing) for row in casts]


def test_it_is_a_predictor_and_begins_with_the_mean_of_the_robots(model, physics):
    assert isinstance(model, Predictor)
    casts = filling_casts(BELIEVED, 20)
    middle = landings(physics.parameters.scenario(np.zeros(physics.parameters.n)), casts) - landings(BELIEVED, casts)
    predicted = model.predict(casts) - reference_model().predict(casts)
    np.testing.assert_allclose(predicted[:, :2], middle, rtol=0, atol=5e-4)


def test_derivatives_are_those_of_the_batched_engine(physics):
    n, casts = physics.parameters.n, made(MILD)
    _, slopes = physics.landings(np.zeros(n), casts)
    center = physics.parameters.scenario(np.zeros(n))
    values = [number(center, one.name).reshape(-1) for one in physics.parameters.parameters]
    names = [
        one.name if len(value) == 1 or len(one.indices) > 1 else f"{one.name}[{one.indices[0] + 1}]"
        for one, value in zip(physics.parameters.parameters, values, strict=True)
    ]
    by_name = batch_derivatives(center, MILD, names, belief=BELIEVED)
    for i, (one, value, name) in enumerate(zip(physics.parameters.parameters, values, names, strict=True)):
        by_number = by_name[name]
        size = one.std * (value[one.indices[0]] if one.kind in ("share", "factor") else 1.0)
        exact = size * by_number[["landing_along", "landing_across"]].to_numpy()
        np.testing.assert_allclose(slopes[..., i], exact, rtol=0, atol=0.01 * np.abs(exact).max() + 1e-7)


def test_a_turned_tilt_is_a_turned_cast(physics):
    z = np.zeros(physics.parameters.n)
    z[-2:] = 1.5, -1.0
    bearing = 0.6
    scenarios = [physics.parameters.scenario(of) for of in (z, 0 * z)]
    frames = [simulate_batch(one, made(MILD, bearing), belief=BELIEVED) for one in scenarios]
    tilted, upright = (frame[["landing_along", "landing_across"]].to_numpy(dtype=float) for frame in frames)
    found = physics.landings(z, made(MILD, bearing))[0] - physics.landings(0 * z, made(MILD, bearing))[0]
    assert np.abs(found).max() > 2e-3
    np.testing.assert_allclose(found, tilted - upright, rtol=0, atol=2e-4)


def test_five_casts_identify_a_longer_string_and_a_heavier_ball(model, physics):
    bearing = 0.5
    robot = Scenario.from_dict({"string": {"length": 0.612}, "ball": {"mass": 0.033}, "arm": {"coulomb_friction": 0.5}})
    seen, fresh = filling_casts(BELIEVED, 5), random_casts(60, seed=2)
    places = [from_casting_plane(*place, bearing) for place in landings(robot, seen)]
    learned = model.observe(made(seen, bearing), places, std=1e-4).toward(bearing)
    truth = landings(robot, fresh)
    identified = landings(physics.parameters.scenario(learned.parameters), fresh)
    assert np.quantile(np.abs(identified - truth), 0.95) < 1e-3
    # A prediction has the error besides that a forward model of so many casts has of its own robot.
    own = np.abs(small_model().predict(fresh)[:, :2] - landings(BELIEVED, fresh))[:, ALONG]
    before, after = (np.abs(one.predict(fresh)[:, :2] - truth)[:, ALONG] for one in (model.toward(bearing), learned))
    assert np.median(before) > 5e-3
    assert np.median(after) < np.median(own) + 3e-4
    assert learned.n_observed == 5
    assert model.n_observed == 0
    assert physics.parameters.scenario(learned.parameters).string.length == pytest.approx(0.612, abs=0.002)


def test_what_it_says_of_robots_like_these_is_so(model):
    casts, z = random_casts(24, seed=3), []
    for seed in range(2):
        robot, rng = ROBOTS.draw(seed).without_noise, np.random.default_rng(seed)
        truth = landings(robot, casts)
        lands = np.isfinite(truth).all(axis=1)
        learned = model.observe(made(casts[:6]), truth[:6] + 0.002 * rng.standard_normal((6, 2)))
        fresh, there = casts[6:][lands[6:]], truth[6:][lands[6:]]
        z += ((learned.predict(fresh)[:, ALONG] - there[:, ALONG]) / learned.predict_std(fresh)[:, ALONG]).tolist()
    # A robot's errors are alike: from 33 to 100 % are within one deviation, robot by robot, and 81 % of eight robots'.
    assert 0.25 < np.sqrt(np.mean(np.square(z))) < 1.5
    assert np.mean(np.abs(z) < 2) >= 0.9


def test_what_teaches_nothing_leaves_it_and_what_is_wrong_is_refused(model):
    casts = made(filling_casts(BELIEVED, 1))
    assert model.observe(casts, [[np.nan, np.nan]]).n_observed == 0
    with pytest.raises(InputError, match="2 pairs of world x and y"):
        model.observe(2 * casts, [[0.5, 0.0]])
