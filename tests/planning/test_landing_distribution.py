"""Landing distribution: against brute force, random draws and closed forms."""

import math

import numpy as np
import pytest
from scipy.stats import norm

from wam_cast.cast import cast_bounds
from wam_cast.planning.landing_distribution import (
    LandingStd,
    clearance,
    clearance_across,
    landing_std,
    repeatability,
    rim_clear_probability,
    scatter_of_move,
    scatter_of_swing,
)
from wam_cast.planning.prediction import ENTRY_SPEED
from wam_cast.scenario import Noise, Scenario

REFERENCE = Scenario()
NOISE = Noise(distance=0.02, speed=0.05, wait=0.03, swing=0.01)


def with_cup(inner_radius):
    return REFERENCE.model_copy(update={"cup": REFERENCE.cup.model_copy(update={"inner_radius": inner_radius})})


def fits(scenario, angle, along, across):
    """Return whether the ellipse that the ball sweeps lies within the cup's circle, by points on its boundary."""
    ball = scenario.ball.radius
    around = np.linspace(0, 2 * np.pi, 7201)
    x, y = along + ball / math.cos(angle) * np.cos(around), across + ball * np.sin(around)
    return np.hypot(x, y).max() <= scenario.cup.inner_radius


def largest(is_allowed):
    """Return the largest offset [m] that is allowed, by bisection."""
    low, high = 0.0, 0.2
    for _ in range(40):
        middle = (low + high) / 2
        low, high = (middle, high) if is_allowed(middle) else (low, middle)
    return low


# --- clearance


@pytest.mark.parametrize("inner_radius", [0.025, 0.035, 0.06])
@pytest.mark.parametrize("angle", [0.0, 0.2, 0.5, 0.8, 1.1])
def test_a_ball_is_clear_of_the_rim_where_the_swept_ellipse_fits(inner_radius, angle):
    scenario = with_cup(inner_radius)
    along = clearance(scenario, angle)
    if not fits(scenario, angle, 0, 0):
        assert along == 0
        assert clearance_across(scenario, angle, np.zeros(1)) == -np.inf
        return
    assert along == pytest.approx(largest(lambda e: fits(scenario, angle, e, 0)), abs=1e-6)
    for share in (0.0, 0.3, -0.6, 0.9):
        (width,) = clearance_across(scenario, angle, np.array([share * along]))
        at = share * along
        assert width == pytest.approx(largest(lambda e: fits(scenario, angle, at, e)), abs=2e-6)  # noqa: B023 - used at once
    np.testing.assert_array_equal(clearance_across(scenario, angle, np.array([1.01, -1.01]) * along), -np.inf)


def test_flat_entries_count_as_78_degrees():
    wide = with_cup(0.15)
    assert clearance(wide, 1.5) == clearance(wide, math.acos(0.2)) == clearance(wide, 2.0)
    assert 0 < clearance(wide, 1.5) < clearance(wide, 1.3)


def test_a_ball_from_above_has_the_same_room_in_all_directions():
    room = REFERENCE.cup.inner_radius - REFERENCE.ball.radius
    assert clearance(REFERENCE, 0.0) == pytest.approx(room)
    at = np.array([0.0, 0.5, 0.9]) * room
    np.testing.assert_allclose(clearance_across(REFERENCE, 0.0, at), np.sqrt(room**2 - at**2), rtol=1e-4)


# --- probability


@pytest.mark.parametrize("angle", [0.0, 0.4, 0.7])
@pytest.mark.parametrize(
    ("offset", "std"),
    [
        ((0.0, 0.0), LandingStd(0.005, 0.002)),
        ((0.004, 0.0), LandingStd(0.003, 0.003)),
        ((-0.012, 0.003), LandingStd(0.004, 0.008)),
        ((0.02, 0.0), LandingStd(0.02, 0.001)),
    ],
)
def test_probability_is_the_share_of_random_landings_that_fit(angle, offset, std):
    draws = np.random.default_rng(0).normal(offset, std, size=(4000, 2))
    around = np.linspace(0, 2 * np.pi, 721)
    x = draws[:, :1] + REFERENCE.ball.radius / math.cos(angle) * np.cos(around)
    y = draws[:, 1:] + REFERENCE.ball.radius * np.sin(around)
    share = np.mean(np.hypot(x, y).max(axis=1) <= REFERENCE.cup.inner_radius)
    found = rim_clear_probability(REFERENCE, angle, offset, std)
    assert found == pytest.approx(share, abs=4 * 0.5 / math.sqrt(len(draws)))


def test_without_deviation_across_it_is_the_normal_distribution_along():
    along = clearance(REFERENCE, 0.4)
    found = rim_clear_probability(REFERENCE, 0.4, (0.003, 0.0), LandingStd(0.006, 0.0))
    expected = norm.cdf(along, 0.003, 0.006) - norm.cdf(-along, 0.003, 0.006)
    assert found == pytest.approx(expected, abs=1e-6)


@pytest.mark.parametrize(
    "std", [LandingStd(0.0, 0.0), LandingStd(1e-9, 1e-9), LandingStd(0.0, 1e-4), LandingStd(1e-4, 0.0)]
)
def test_without_deviation_a_ball_enters_rim_clear_or_it_does_not(std):
    along = clearance(REFERENCE, 0.4)
    (across,) = clearance_across(REFERENCE, 0.4, np.zeros(1))
    for offset in ((0.0, 0.0), (0.9 * along, 0.0), (0.0, -0.9 * across), (-0.5 * along, 0.5 * across)):
        assert rim_clear_probability(REFERENCE, 0.4, offset, std) == pytest.approx(1, abs=1e-6)
    for offset in ((1.1 * along, 0.0), (-1.1 * along, 0.0), (0.0, 1.1 * across), (0.8 * along, 0.8 * across)):
        assert rim_clear_probability(REFERENCE, 0.4, offset, std) == pytest.approx(0, abs=1e-6)


@pytest.mark.slow
def test_the_probability_vanishes_with_a_huge_deviation_or_too_flat_an_entry():
    at = np.linspace(-1, 1, 20_001) * clearance(REFERENCE, 0.4)
    area = np.trapezoid(2 * np.maximum(clearance_across(REFERENCE, 0.4, at), 0.0), at)
    found = rim_clear_probability(REFERENCE, 0.4, (0.0, 0.0), LandingStd(20.0, 10.0))
    assert found == pytest.approx(area / (2 * math.pi * 20 * 10), rel=1e-3)
    assert found < 1e-5
    assert rim_clear_probability(REFERENCE, 1.4, (0.0, 0.0), LandingStd(1e-3, 1e-3)) == 0


def test_a_wider_cup_a_steeper_entry_and_a_smaller_deviation_are_better():
    std = LandingStd(0.006, 0.002)
    wider = [rim_clear_probability(with_cup(r), 0.5, (0.002, 0.001), std) for r in np.linspace(0.021, 0.06, 20)]
    steeper = [rim_clear_probability(REFERENCE, a, (0.002, 0.001), std) for a in np.linspace(1.0, 0.0, 20)]
    surer = [
        rim_clear_probability(REFERENCE, 0.5, (0.002, 0.001), LandingStd(s, s / 3)) for s in np.geomspace(0.1, 1e-4, 20)
    ]
    for probabilities in (wider, steeper, surer):
        assert np.all(np.diff(probabilities) >= -1e-9)
        assert probabilities[0] < 0.1 * probabilities[-1]


# --- standard deviation


def quadratic(model_class, gradient, curvature):
    """Return a model whose landing is a quadratic of each scaled parameter."""
    gradient, curvature = np.array(gradient), np.array(curvature)
    return model_class(
        along=(lambda s: 0.4 + s @ gradient + 0.5 * s**2 @ curvature, lambda s: gradient + s * curvature)
    )


def test_scatter_of_a_quadratic_landing_is_exact(make_model):
    gradient, curvature = np.array([0.3, -0.2, 0.1]), np.array([0.5, 2.0, -4.0])
    model = quadratic(type(make_model()), gradient, curvature)
    lower, upper = cast_bounds(REFERENCE)
    cast, sizes = (lower + [0.6, 0.4, 0.7] * (upper - lower), np.array([NOISE.distance, NOISE.speed, NOISE.wait]))
    mean_square, _ = scatter_of_move(model, cast, NOISE)
    # E[(g e + h e^2 / 2)^2] = g^2 s^2 + 3/4 h^2 s^4 of each parameter by itself, in scaled units.
    s = sizes / (upper - lower)
    slope = gradient + curvature * [0.6, 0.4, 0.7]
    assert mean_square == pytest.approx(np.sum((slope * s) ** 2 + 0.75 * curvature**2 * s**4), rel=1e-9)
    nodes, weights = np.polynomial.hermite_e.hermegauss(30)
    integral = 0.0
    for parameter in range(3):
        points = cast + np.outer(nodes * sizes[parameter], np.eye(3)[parameter])
        off = model.predict(points)[:, 0] - model.predict(cast[np.newaxis])[0, 0]
        integral += weights @ off**2 / weights.sum()
    assert mean_square == pytest.approx(integral, rel=1e-9)


def test_derivative_of_the_scatter_agrees_with_finite_differences(curved_model):
    lower, upper = cast_bounds(REFERENCE)
    for scaled in ([0.3, 0.5, 0.2], [0.7, 0.2, 0.9]):
        cast = lower + scaled * (upper - lower)
        _, gradient = scatter_of_move(curved_model, cast, NOISE)
        for parameter, step in enumerate(1e-5 * np.eye(3)):
            above, below = (scatter_of_move(curved_model, cast + k * step, NOISE)[0] for k in (1, -1))
            assert gradient[parameter] == pytest.approx((above - below) / 2e-5, rel=1e-6, abs=1e-9)


def test_a_cliff_nearby_counts_where_the_gradient_is_none(make_model):
    # Flat at the cast, and 0.2 m lower beyond a step that is 1.5 standard deviations of the speed away.
    model = type(make_model())(along=(lambda s: 0.6 - 0.2 * (s[:, 1] > 0.6), lambda s: 0 * s))
    lower, upper = cast_bounds(REFERENCE)
    speed = Noise(speed=0.1 / 1.5 * (upper - lower)[1])
    mean_square, gradient = scatter_of_move(model, lower + 0.5 * (upper - lower), speed)
    assert mean_square == pytest.approx(0.2**2 / 6)
    np.testing.assert_array_equal(gradient, 0)


def test_deviations_add_in_quadrature(make_model):
    model = make_model(std=0.004)
    cast = model.training_casts[0]
    entry_speed = model.predict(cast[np.newaxis])[0, ENTRY_SPEED]
    swing = scatter_of_swing(REFERENCE, NOISE, entry_speed)
    move = scatter_of_move(model, cast, NOISE)[0]
    assert move > 0.004**2
    found = landing_std(model, cast, NOISE)
    assert found == pytest.approx((math.sqrt(0.004**2 + move + swing.along**2), swing.across))
    assert landing_std(model, cast, Noise()) == pytest.approx((0.004, 0))
    swung = scatter_of_swing(REFERENCE, Noise(swing=0.01), entry_speed)
    assert landing_std(model, cast, Noise(swing=0.01)) == pytest.approx((math.hypot(0.004, swung.along), swung.across))


@pytest.mark.slow
def test_a_swing_scatters_landings_by_what_a_simulation_shows():
    batch = pytest.importorskip("wam_cast.batch.engine", reason="the extra `batch` is not installed")
    swinging, n = Scenario(noise=Noise(swing=0.005)), 256
    casts = np.repeat([(0.06, 0.29, 0.49), (0.21, 0.47, 0.48), (0.35, 0.67, 0.43)], n, axis=0)
    landed = batch.simulate_batch(swinging, casts, noise_seeds=range(len(casts)), precision="float32")
    for first in range(0, len(casts), n):
        some = landed.iloc[first : first + n]
        expected = scatter_of_swing(swinging, swinging.noise, some["entry_speed"].mean())
        # 256 casts tell a deviation to 5 %; that across is up to 12 % more where the ball rises first.
        np.testing.assert_allclose(some[["landing_along", "landing_across"]].std(), expected, rtol=0.25)


@pytest.mark.parametrize("noise", [Noise(), Noise(torque=0.01), Noise(encoder_counts=4096), Noise(swing=1e-6)])
def test_plans_allow_for_a_tenth_of_a_typical_arms_noise_at_least(noise):
    little, typical = repeatability(Scenario(noise=noise)), Noise.typical()
    for name in ("distance", "speed", "wait", "swing"):
        assert getattr(little, name) == pytest.approx(getattr(typical, name) / 10)


def test_plans_allow_for_the_scenarios_noise_where_there_is_more():
    found, typical = repeatability(Scenario(noise=Noise(speed=0.5))), Noise.typical()
    assert found.speed == 0.5
    assert found.wait == pytest.approx(typical.wait / 10)
    moves = repeatability(Scenario(noise=typical))
    assert (moves.distance, moves.swing) == (typical.distance, typical.swing)
