"""What the tests of the system share: simulators are slow to build, and reusing them must not show."""

import pytest

from wam_cast.scenario import Scenario
from wam_cast.system.simulation import CastSimulator


@pytest.fixture(scope="session")
def simulator():
    """Return the reference scenario's simulator; outcomes do not depend on who used it before."""
    return CastSimulator(Scenario())
