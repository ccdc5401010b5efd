"""Robots drawn at random: each number varies, within its range, about what is believed."""

import numpy as np
import pytest

from wam_cast.adaptation.robot_distribution import RANGES, Range, RobotDistribution, number
from wam_cast.errors import InputError
from wam_cast.scenario import Noise, Scenario
from wam_cast.simulation.loop_stability import check_loop

N_ROBOTS = 200


@pytest.fixture(scope="module")
def drawn():
    robots = [RobotDistribution()._drawn(seed, attempt=0) for seed in range(N_ROBOTS)]
    return {one.name: np.array([number(robot, one.name) for robot in robots]) for one in RANGES}


@pytest.mark.parametrize("one", RANGES, ids=lambda one: one.name)
def test_every_number_varies_over_its_range_and_no_further(one, drawn):
    believed, values = number(Scenario(), one.name), drawn[one.name]
    assert (values.std(axis=0) > 0).all()
    if one.kind == "factor":
        low, high = believed / one.size, believed * one.size
    elif one.kind == "share":
        low, high = believed * (1 - one.size), believed * (1 + one.size)
    elif one.kind == "offset":
        low, high = believed - one.size, believed + one.size
    else:
        low, high = believed, believed + one.size * (1 + one.spread)
    span = high - low
    assert (values >= low - 1e-12).all()
    assert (values <= high + 1e-12).all()
    assert (values.min(axis=0) < low + 0.1 * span).all()
    assert (values.max(axis=0) > high - 0.25 * span).all()


def test_joints_vary_apart_and_so_do_numbers(drawn):
    columns = np.column_stack([values.reshape(N_ROBOTS, -1) for values in drawn.values()])
    correlation = np.corrcoef(columns, rowvar=False)
    friction = [i for i, name in enumerate(_names(drawn)) if name == "arm.coulomb_friction"]
    correlation[np.ix_(friction, friction)] = 0  # all joints of an arm have more or less of it together
    assert np.abs(correlation - np.diag(np.diag(correlation))).max() < 0.35


def _names(drawn):
    return [name for name, values in drawn.items() for _ in range(values.reshape(N_ROBOTS, -1).shape[1])]


def test_twice_the_scale_is_twice_as_far_in_the_same_direction():
    robots = RobotDistribution()
    for seed in range(5):
        once, twice = robots.draw(seed), robots.scaled(2.0).draw(seed)
        assert twice.string.length - 0.6 == pytest.approx(2 * (once.string.length - 0.6), rel=1e-9)
        assert twice.string.mass / 0.003 == pytest.approx((once.string.mass / 0.003) ** 2, rel=1e-9)
        np.testing.assert_allclose(twice.arm.encoder_offset, 2 * np.array(once.arm.encoder_offset), rtol=1e-9)


def test_without_scale_all_are_what_is_believed_but_for_their_delay():
    believed = Scenario(noise=Noise.typical())
    robots = RobotDistribution(believed, ranges=tuple(one for one in RANGES if one.kind != "periods"), scale=0.0)
    assert robots.draw(3) == believed


def test_robots_whose_loop_is_unstable_are_not_drawn():
    robots, seed = RobotDistribution().scaled(2.0), 9
    with pytest.raises(InputError, match="unstable"):
        check_loop(robots._drawn(seed, attempt=0), robots.believed)
    check_loop(robots.draw(seed), robots.believed)


def test_what_one_range_draws_does_not_depend_on_the_others():
    robots = RobotDistribution()
    assert robots.without("ball.mass").draw(5).string == robots.draw(5).string
    assert robots.without("ball.mass").draw(5).ball.mass == robots.believed.ball.mass


def test_a_shift_comes_on_top():
    robots = RobotDistribution()
    assert robots.shifted({"ball.mass": 0.5}).draw(7).ball.mass == pytest.approx(0.5 * robots.draw(7).ball.mass)
    assert robots.shifted({"ball.mass": 0.5}).draw(7).string == robots.draw(7).string


def test_the_same_seed_gives_the_same_robot():
    assert RobotDistribution().draw(11) == RobotDistribution().draw(11) != RobotDistribution().draw(12)
    assert RobotDistribution().scaled(2.0) == RobotDistribution(scale=2.0) != RobotDistribution()


@pytest.mark.parametrize("name", ["string.len", "nothing", "arm.mount", "string", "arm.urdf"])
def test_a_name_of_no_number_is_refused(name):
    with pytest.raises(InputError, match=r"name a number of the scenario"):
        RobotDistribution(ranges=(Range(name, "share", 0.1, ""),))


def test_ranges_beyond_what_a_scenario_may_have_are_refused_in_one_line():
    with pytest.raises(InputError) as caught:
        [RobotDistribution(scale=40.0).draw(seed) for seed in range(10)]
    assert "\n" not in str(caught.value)
