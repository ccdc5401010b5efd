"""One recorded cast, into a cup and out of the plane's first bearing, for all tests here."""

import pytest

from wam_cast.cast import Cast, default_cast, default_cup
from wam_cast.casting_plane import from_polar
from wam_cast.scenario import Scenario
from wam_cast.simulation.simulator import CastSimulator


@pytest.fixture(scope="session")
def recording():
    scenario = Scenario()
    cast = default_cast(scenario)
    cup = from_polar(default_cup(scenario)[0], 0.2)
    turned = Cast(cast.distance, cast.speed, cast.wait, bearing=0.2)
    made = CastSimulator(scenario).record(turned, cup, returns=False)
    assert made.outcome.is_caught
    return made
