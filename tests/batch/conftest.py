import pytest

pytest.importorskip("jax", reason="the extra `batch` is not installed")

from pydrake.systems.analysis import ResetIntegratorFromFlags

from wam_cast.simulation import station_loop
from wam_cast.simulation.integration import ACCURACY, begin_integration


@pytest.fixture
def fixed_steps(monkeypatch):
    """Let Drake integrate in equal steps, as the batched engine does, where nothing touches."""

    def begin(simulator, method, max_step, accuracy):
        begin_integration(simulator, method, max_step, accuracy)
        if accuracy == ACCURACY:
            ResetIntegratorFromFlags(simulator, method, max_step)
            simulator.get_mutable_integrator().set_fixed_step_mode(True)

    monkeypatch.setattr(station_loop, "begin_integration", begin)
