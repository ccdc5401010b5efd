"""Parameters differ as the numbers of robots do that are drawn."""

import numpy as np
import pytest

from wam_cast.adaptation.physical_parameters import PhysicalParameters
from wam_cast.adaptation.robot_distribution import RANGES, TILT, RobotDistribution, number
from wam_cast.scenario import Scenario

BELIEVED = Scenario()


@pytest.fixture(scope="module")
def parameters():
    return PhysicalParameters.of(RobotDistribution(BELIEVED))


@pytest.mark.parametrize(
    "one", [one for one in RANGES if one.kind not in ("periods", "fraction")], ids=lambda r: r.name
)
@pytest.mark.parametrize("scale", [1.0, 2.0])
def test_their_deviations_are_those_of_the_ranges(one, scale):
    moving = [
        (i, parameter)
        for i, parameter in enumerate(PhysicalParameters.of(RobotDistribution(BELIEVED, scale=scale)).parameters)
        if parameter.name == one.name
    ]
    rng, believed = np.random.default_rng(0), number(BELIEVED, one.name)
    drawn = np.array([one.drawn(believed, scale, rng) for _ in range(4000)]).reshape(4000, -1)
    for _, parameter in moving:
        moved = [parameter.moved(believed, z).reshape(-1)[parameter.indices[0]] for z in (-1.0, 0.0, 1.0)]
        own = drawn[:, parameter.indices[0]]
        if one.kind == "factor":
            moved, own = np.log(moved), np.log(own)
        assert moved[1] == pytest.approx(np.mean(own), abs=0.06 * np.std(own))
        np.testing.assert_allclose(np.diff(moved), np.std(own), rtol=0.03)
        assert np.array_equal(parameter.indices, [parameter.indices[0]])


def test_all_joints_have_the_same_share_of_friction(parameters):
    one = next(one for one in RANGES if one.kind == "fraction")
    rng = np.random.default_rng(0)
    drawn = np.array([one.drawn(np.zeros(7), 1.0, rng) for _ in range(4000)]).mean(axis=1)
    parameter = next(parameter for parameter in parameters.parameters if parameter.name == one.name)
    none, middle, more = (parameter.moved(np.zeros(7), z) for z in (-3.0, 0.0, 1.0))
    np.testing.assert_allclose(none, 0.0)
    np.testing.assert_allclose(middle, drawn.mean(), rtol=0.03)
    np.testing.assert_allclose(more - middle, drawn.std(), rtol=0.05)


def test_each_moves_its_own_number_and_no_other(parameters):
    nothing, middle = np.zeros(parameters.n), parameters.scenario(np.zeros(parameters.n))
    for i, one in enumerate(parameters.parameters):
        z = nothing.copy()
        z[i] = 1.0
        moved = parameters.scenario(z)
        for other in {parameter.name for parameter in parameters.parameters}:
            differs = np.flatnonzero((number(moved, other) - number(middle, other)).reshape(-1))
            assert list(differs) == (list(one.indices) if other == one.name else [])


def test_the_tilt_comes_last_even_where_robots_are_upright():
    upright = PhysicalParameters.of(RobotDistribution(BELIEVED).without(TILT))
    for one in (PhysicalParameters.of(RobotDistribution(BELIEVED)), upright):
        assert [(last.name, last.indices) for last in one.parameters[-2:]] == [(TILT, (0,)), (TILT, (1,))]
    assert upright.scenario(np.ones(upright.n)).arm.base_tilt == (0.0, 0.0)


def test_what_all_robots_have_in_common_is_known():
    light = PhysicalParameters.of(RobotDistribution(BELIEVED).shifted({"ball.mass": 0.5}))
    assert light.scenario(np.zeros(light.n)).ball.mass == pytest.approx(0.5 * BELIEVED.ball.mass)


def test_what_is_no_parameter_stays_as_a_robot_has_it(parameters):
    other = Scenario.from_dict({"controller": {"delay": 1}, "arm": {"mass_scale": [1.1] * 7}, "ball": {"mass": 0.05}})
    moved = parameters.scenario(np.zeros(parameters.n), of=other)
    assert moved.controller.delay == 1
    assert moved.ball.mass == BELIEVED.ball.mass
    assert moved.arm.mass_scale == (1.1, 1.1, 1.1, 1.0, 1.1, 1.1, 1.1)
