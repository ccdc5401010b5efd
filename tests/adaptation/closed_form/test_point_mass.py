"""The ball on a massless string, against what mechanics says of pendulums and of free fall."""

import math

import numpy as np
import pytest

from wam_cast.adaptation.closed_form.hand_path import PlannedPath
from wam_cast.adaptation.closed_form.point_mass import PointMass, Swing, fall
from wam_cast.generation.sampling import sample_casts
from wam_cast.motion.pendulum import swing_frequency
from wam_cast.scenario import Scenario

SWING = Swing(length=0.6, reduced_length=0.6, damping=0.0, gravity=9.81)
ONE = np.arange(1)


def moving_hand(place, velocity=lambda t: 0 * t, acceleration=lambda t: 0 * t):
    """Return a hand at the radius 0.2 m whose height follows a function of time."""

    def path(t, rows):
        still = np.zeros_like(t)
        return np.stack([still + 0.2, place(t)]), np.stack([still, velocity(t)]), np.stack([still, acceleration(t)])

    return path


RESTING = moving_hand(lambda t: 0 * t + 0.8)


def swinging(angles, swing=SWING, rate=0.0):
    """Return balls below a hand at rest, and what moves them."""
    model, angles = PointMass(swing, RESTING), np.asarray(angles, dtype=float)
    rate = np.full(len(angles), rate)
    s, c = np.sin(angles), np.cos(angles)
    hand, _, _ = RESTING(0 * angles, None)
    balls = model.at_rest(len(angles))._replace(
        angle=angles,
        rate=rate,
        place=hand + swing.length * np.stack([s, -c]),
        velocity=swing.length * rate * np.stack([c, s]),
    )
    return model, balls


def advanced(model, balls, n_steps, step=0.004):
    """Yield the balls after each step."""
    rows = np.arange(len(balls.t))
    for _ in range(n_steps):
        balls = model.advanced(balls, rows, step)
        yield balls


@pytest.mark.parametrize("reduced_length", [0.6, 0.5])
def test_small_swings_have_the_pendulums_period(reduced_length):
    swing = SWING._replace(reduced_length=reduced_length)
    model, balls = swinging([0.01], swing)
    period = 2 * math.pi * math.sqrt(reduced_length / 9.81)
    n = 500
    *_, after = advanced(model, balls, n, step=2.25 * period / n)
    # A quarter of a swing after the second one it passes the lowest place; 1e-5 is the share of a finite angle.
    assert abs(after.angle[0]) < 1e-5
    assert after.rate[0] == pytest.approx(-0.01 * 2 * math.pi / period, rel=1e-4)


def test_swings_of_the_whole_string_are_almost_the_rigid_ones():
    # The string bends a little at its lowest frequency, which lowers it.
    swing = Swing.of(Scenario())
    rigid = math.sqrt(swing.gravity / swing.reduced_length)
    assert 0 < rigid / swing_frequency(Scenario()) - 1 < 1e-3


def test_a_string_without_mass_and_a_small_ball_are_a_point_mass():
    light = Scenario.from_dict(
        {"string": {"mass": 1e-5, "hook_damping": 0.0}, "ball": {"radius": 1e-3}, "cup": {"rim_height": 0.1}}
    )
    point = Swing.of_point(light)
    np.testing.assert_allclose(Swing.of(light), point, rtol=1e-4, atol=1e-12)
    heavy = Swing.of(Scenario.from_dict({"string": {"mass": 0.03}}))
    # A rod as heavy as the ball: (1 + 1/3) / (1 + 1/2) of the length, but for the ball's size.
    assert heavy.reduced_length / 0.6 == pytest.approx((1 + 1 / 3) / (1 + 1 / 2), rel=0.02)


def test_energy_is_kept_below_a_hand_at_rest():
    model, balls = swinging([1.0, -0.4, 1.5])
    energy = [
        0.5 * (balls.velocity**2).sum(axis=0) + 9.81 * balls.place[1] for balls in [balls, *advanced(model, balls, 400)]
    ]
    assert np.ptp(energy, axis=0).max() < 1e-6


def test_damping_takes_energy_at_its_rate():
    model, balls = swinging([0.02], SWING._replace(damping=0.5))
    *_, after = advanced(model, balls, 500, step=0.002)
    energy = 0.5 * (0.6 * after.rate) ** 2 + 9.81 * 0.6 * (1 - np.cos(after.angle))
    # By exp(-damping t), with the square of the amplitude, but for the swing's phase.
    assert energy[0] / (9.81 * 0.6 * (1 - math.cos(0.02))) == pytest.approx(math.exp(-0.5), rel=0.1)


def test_a_taut_string_keeps_its_length_and_a_slack_one_is_shorter():
    scenario = Scenario()
    casts = sample_casts(scenario, 20, seed=3)
    model = PointMass(SWING, PlannedPath(scenario, casts))
    was_slack, rows = np.zeros(20, dtype=bool), np.arange(20)
    for balls in advanced(model, model.at_rest(20), 500, step=0.005):
        slack = model.slack(balls, rows)
        assert np.abs(slack[balls.is_taut]).max(initial=0.0) < 1e-12
        assert slack.min() > -1e-7
        was_slack |= ~balls.is_taut
    assert was_slack.all()


def test_a_ball_that_is_thrown_over_leaves_its_circle_where_tension_ends_and_flies_on_a_parabola():
    # With the speed v at the lowest place the tension vanishes where v^2 = g l (2 + 3 sin(a)), a above the horizontal.
    speed = math.sqrt(9.81 * 0.6 * (2 + 3 * math.sin(0.5)))
    model, balls = swinging([0.0], rate=speed / 0.6)
    balls = next(one for one in advanced(model, balls, 1000) if not one.is_taut[0])
    assert balls.angle[0] - math.pi / 2 == pytest.approx(0.5, abs=1e-5)
    assert (balls.velocity**2).sum() == pytest.approx(9.81 * 0.6 * math.sin(0.5), rel=1e-5)
    for later in advanced(model, balls, 20):
        assert not later.is_taut[0]
        t = later.t - balls.t
        np.testing.assert_allclose(
            later.place, balls.place + balls.velocity * t - [[0.0], [9.81 / 2]] * t**2, atol=1e-12
        )


def test_a_string_that_is_pulled_tight_takes_the_velocity_along_it():
    model, balls = swinging([0.0])
    # It falls from beside the hand, half its length above the place where the string holds it.
    start = np.array([[0.5], [0.8]])
    balls = balls._replace(is_taut=np.array([False]), place=start, velocity=np.zeros((2, 1)))
    balls = next(one for one in advanced(model, balls, 1000) if one.is_taut[0])
    depth = 0.6 * math.sqrt(1 - 0.25)
    np.testing.assert_allclose(balls.place[:, 0], [0.5, 0.8 - depth], atol=1e-6)
    assert balls.angle[0] == pytest.approx(math.pi / 6)
    # Of the fall's speed sqrt(2 g depth) the string leaves the part across it, downward and so inward.
    assert 0.6 * balls.rate[0] == pytest.approx(-math.sqrt(2 * 9.81 * depth) * 0.5, rel=1e-5)


def test_a_hand_that_is_dropped_faster_than_free_fall_leaves_the_ball_to_fall():
    path = moving_hand(lambda t: 0.8 - 10 * t**2, lambda t: -20 * t, lambda t: 0 * t - 20)
    found = fall(SWING, path, np.array([2.0]), rim_height=0.12, ball_radius=0.02)
    time = math.sqrt(2 * (0.2 - 0.12) / 9.81)
    assert found.radius[0] == pytest.approx(0.2)
    assert found.crossing_time[0] == pytest.approx(time, abs=1e-5)
    assert found.velocity[1, 0] == pytest.approx(-9.81 * time, rel=1e-4)
    assert found.crossing_slack[0] == pytest.approx((20 - 9.81) / 2 * time**2, rel=1e-3)
    assert found.slack[0] == found.crossing_slack[0]  # the hand goes on ahead


def test_a_ball_that_stays_above_the_rim_has_no_landing():
    found = fall(SWING, RESTING, np.array([0.5]), rim_height=0.12, ball_radius=0.02)
    assert all(np.isnan(values).all() for values in found)


@pytest.mark.slow
def test_landings_do_not_depend_on_the_step_nor_on_which_casts_are_computed_with_them():
    scenario = Scenario()
    casts = sample_casts(scenario, 12, seed=8)
    swing = Swing.of(scenario)

    def landings(casts, step):
        path = PlannedPath(scenario, casts)
        return fall(swing, path, path.drop_end + 1.5, 0.12, 0.02, step).radius

    coarse, usual, fine = (landings(casts, step) for step in (0.016, 0.004, 0.002))
    assert np.abs(usual - fine).max() < 1e-4
    assert np.abs(usual - fine).mean() < 0.5 * np.abs(coarse - fine).mean()
    np.testing.assert_array_equal(landings(casts[5:7], 0.004), usual[5:7])


def test_landings_scale_as_mechanics_does():
    # Twice as large and sqrt(2) as long in time, under the same gravity.
    def scaled(size):
        values = {
            "arm": {"mount": "floor", "mount_height": 0.0},
            "string": {"length": 0.3 * size, "mass": 1e-5, "hook_damping": 0.0},
            "ball": {"radius": 0.01 * size},
            "cup": {"rim_height": 0.06 * size, "inner_radius": 0.02 * size},
            "motion": {
                "start_radius": 0.2 * size,
                "start_height": 0.4 * size,
                "drop_distance": 0.22 * size,
                "drop_duration": 0.3 * math.sqrt(size),
            },
        }
        return Scenario.from_dict(values)

    cast, radii = np.array([[0.1, 0.4, 0.1]]), []
    for size in (1.0, 1.5):
        scenario = scaled(size)
        path = PlannedPath(scenario, cast * [size, math.sqrt(size), math.sqrt(size)])
        found = fall(Swing.of_point(scenario), path, path.drop_end + 1.0, scenario.cup.rim_height, 0.01 * size)
        radii.append(found.radius[0] / size)
    assert radii[0] == pytest.approx(radii[1], abs=1e-4)
