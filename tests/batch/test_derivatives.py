"""Derivatives through the flight are the differences of Drake's casts."""

import numpy as np
import pytest

from wam_cast.batch.derivatives import QUANTITIES, batch_derivatives
from wam_cast.cast import Cast
from wam_cast.scenario import Scenario
from wam_cast.simulation.simulator import CastSimulator

pytestmark = pytest.mark.slow

CAST = Cast(0.30, 0.60, 0.10)
STEPS = {
    "distance": 1e-4,
    "speed": 1e-4,
    "wait": 1e-4,
    "string.length": 1e-4,
    "string.mass": 1e-5,
    "string.hook_damping": 1e-6,
    "ball.mass": 1e-4,
    "arm.coulomb_friction": 1e-2,
    "arm.mass_scale[4]": 1e-2,
    "arm.encoder_offset[2]": 1e-3,
    "controller.kp": 30.0,
    "cup.rim_height": 1e-4,
    "arm.mount_height": 1e-4,
    "gravity": 1e-3,
}


def changed(scenario, cast, name, by):
    if name in ("distance", "speed", "wait"):
        return scenario, Cast(**{key: getattr(cast, key) + by * (key == name) for key in ("distance", "speed", "wait")})
    values = scenario.model_dump()
    path, _, joint = name.partition("[")
    part, _, field = path.partition(".")
    if not field:
        values[part] += by
    elif isinstance(values[part][field], tuple):
        moved = [not joint or i == int(joint.rstrip("]")) for i in range(1, 8)]
        values[part][field] = [one + by * moves for one, moves in zip(values[part][field], moved, strict=True)]
    else:
        values[part][field] += by
    return Scenario.from_dict(values), cast


def outcome(scenario, cast):
    told = CastSimulator(scenario).simulate(cast)
    return np.array([getattr(told, name) for name in QUANTITIES])


@pytest.fixture(scope="module")
def middle():
    return Scenario.from_dict({"arm": {"coulomb_friction": 0.5}})


@pytest.fixture(scope="module")
def derivatives(middle):
    return batch_derivatives(middle, [CAST.to_array()], list(STEPS))


@pytest.mark.parametrize("name", STEPS)
def test_they_are_the_central_differences_of_drake(middle, derivatives, name):
    step = STEPS[name]
    above, below = (outcome(*changed(middle, CAST, name, by)) for by in (step, -step))
    expected = (above - below) / (2 * step)
    np.testing.assert_allclose(derivatives[name].iloc[0], expected, rtol=0, atol=0.01 * np.abs(expected).max())
