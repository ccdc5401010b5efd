"""Landings of robots that were drawn at random, against each robot simulated by Drake."""

import numpy as np
import pytest

import wam_cast as wc
from wam_cast.adaptation.priors.robot_ensemble import FIRST_SEED, simulate_ensemble
from wam_cast.adaptation.robot_distribution import TILT, RobotDistribution
from wam_cast.cast import Cast
from wam_cast.errors import InputError
from wam_cast.scenario import Scenario


@pytest.mark.slow
def test_offsets_are_those_of_the_robots_without_tilt_and_the_tilt_is_a_derivative():
    robots = RobotDistribution()
    ensemble = simulate_ensemble(robots, 2, 4, "float64")
    upright = robots.without(TILT)
    cast = Cast(*ensemble.casts[2])
    believed = wc.simulate_cast(Scenario(), cast)
    for number, offset in enumerate(ensemble.offsets):
        robot = wc.simulate_cast(upright.draw(FIRST_SEED + number).without_noise, cast, belief=Scenario())
        np.testing.assert_allclose(offset[2, :2], robot.landing - believed.landing, rtol=0, atol=1e-6)
    for axis, slope in enumerate(ensemble.by_tilt):
        tilt = 0.001 * np.eye(2)[axis]
        above, below = (
            wc.simulate_cast(
                Scenario.from_dict({"arm": {"base_tilt": list(sign * tilt)}}), cast, belief=Scenario()
            ).landing
            for sign in (1, -1)
        )
        np.testing.assert_allclose(slope[2, :2], (above - below) / 0.002, rtol=0.02, atol=2e-3)
    assert ensemble.tilt_std == pytest.approx(np.deg2rad(0.3) / np.sqrt(3))


@pytest.mark.slow
def test_robots_whose_casts_do_not_land_are_refused():
    never = Scenario.from_dict({"cup": {"rim_height": 0.02}, "motion": {"drop_distance": 0.185, "hold_duration": 0.01}})
    with pytest.raises(InputError, match="of 4 casts land on all of them"):
        simulate_ensemble(RobotDistribution(never), 2, 4, "float64")  # compiled by the test above
