"""An arm and its controller in one process, over a link of a quality of your choice."""

from dataclasses import dataclass, field

import pytest

from wam_cast.scenario import Scenario
from wam_cast.wire.lossy_link import LossyLink
from wam_cast.wire.memory_network import MemoryNetwork
from wam_cast.wire.remote_arm import RemoteArm
from wam_cast.wire.simulated_arm import SimulatedArm


@dataclass
class Wire:
    """Both sides, what was refused between them, and the link, which may be changed."""

    scenario: Scenario
    is_real_time: bool
    link: LossyLink = field(default_factory=LossyLink)
    refusals: list = field(default_factory=list)

    def __post_init__(self):
        self.network = MemoryNetwork(self.link)
        self.arm = SimulatedArm(
            self.network.join(lambda: self.arm.work()),
            self.scenario,
            clock=self.network,
            is_real_time=self.is_real_time,
            on_refusal=self.refusals.append,
            on_outcome=lambda *_: self.mend(),
        )
        self.controller = RemoteArm(self.scenario, self.network.join(), clock=self.network)

    def mend(self):
        """Make the link perfect, as it is again after each cast: else nobody would hear what came of it."""
        self.link.delay = self.link.jitter = self.link.loss = self.link.doubling = 0.0

    def fail_at(self, time, **values):
        """Let the link be as bad as this from a time of the next cast on."""
        arrivals = LossyLink.arrivals.__get__(self.link)

        def failing(sent):
            if self.arm.port.time > time and self.arm.port.is_open:
                vars(self.link).update(values)
            return arrivals(sent)

        self.link.arrivals = failing


@pytest.fixture
def make_wire():
    return Wire


@pytest.fixture(scope="package")
def lock_step():
    return Wire(Scenario(), is_real_time=False)


@pytest.fixture(scope="package")
def in_real_time():
    return Wire(Scenario(), is_real_time=True)


@pytest.fixture(autouse=True)
def perfect_links(request):
    """Leave the links that tests share as perfect as they were."""
    yield
    for name in {"lock_step", "in_real_time"} & set(request.fixturenames):
        wire = request.getfixturevalue(name)
        wire.mend()
        vars(wire.link).pop("arrivals", None)
        wire.refusals.clear()
