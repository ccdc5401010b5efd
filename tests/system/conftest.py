"""What the tests of the system share: simulators are slow to build, and reusing them must not show."""

import pytest
from pydrake.systems.framework import LeafSystem

from wam_cast.scenario import Scenario
from wam_cast.system.simulation import CastSimulator


@pytest.fixture(scope="session")
def simulator():
    """Return the reference scenario's simulator; outcomes do not depend on who used it before."""
    return CastSimulator(Scenario())


@pytest.fixture(scope="session")
def limp():
    """Return the class of a controller that is told the cast alone, and lets the arm hang."""

    class Limp(LeafSystem):
        def __init__(self, _scenario=None):
            super().__init__()
            self.DeclareVectorInputPort("arm_state", 14)
            for name, size in (("actuation", 7), ("hand", 6), ("hand_desired", 6), ("stage", 1)):
                self.DeclareVectorOutputPort(name, size, lambda context, output: output.SetZero())

        def set_cast(self, context, cast):
            pass

    return Limp
