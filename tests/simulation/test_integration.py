"""Integration: no string diverges, landings are converged, and what a cast costs is known before."""

import numpy as np
import pytest

from wam_cast.cast import Cast
from wam_cast.errors import InputError
from wam_cast.generation.sampling import sample_cast
from wam_cast.motion.polling import MAX_STATE
from wam_cast.robot.controller import CastController
from wam_cast.robot.station import CastStation
from wam_cast.scenario import Noise, Scenario
from wam_cast.simulation import contact_free
from wam_cast.simulation.integration import EXPLICIT, IMPLICIT, choose_integration, fastest_rate
from wam_cast.simulation.outcome import Status
from wam_cast.simulation.simulator import CastSimulator

TYPICAL = Cast(0.30, 0.60, 0.10)
LONG = Cast(0.40, 0.85, 0.50)


def scenario(**changes):
    return Scenario.from_dict(changes)


def converged(setting, cast, monkeypatch):
    """Return the landing at a far finer accuracy, always by the explicit method."""
    monkeypatch.setattr("wam_cast.simulation.integration.STIFFNESS", np.inf)
    monkeypatch.setattr(contact_free, "ACCURACY", 1e-4)
    landing = CastSimulator(setting).simulate(cast).landing
    monkeypatch.undo()
    return landing


HEAVY = {"ball": {"mass": 0.045}, "string": {"length": 0.55}}
STRINGS = [
    HEAVY,
    pytest.param({"ball": {"mass": 0.060}}, marks=pytest.mark.slow),
    pytest.param({"ball": {"mass": 0.200}, "string": {"mass": 0.0005}}, marks=pytest.mark.slow),
    {"ball": {"mass": 0.002}, "string": {"mass": 0.020}},
    {"string": {"bending_damping": 0.0, "hook_damping": 0.0}},
    pytest.param({"string": {"bending_damping": 2e-5}}, marks=pytest.mark.slow),
    pytest.param({"string": {"n_links": 1}}, marks=pytest.mark.slow),
    pytest.param({"string": {"n_links": 20}}, marks=pytest.mark.slow),
    {"arm": {"coulomb_friction": 1.0}},
]


@pytest.mark.parametrize("changes", STRINGS, ids=str)
def test_any_string_lands_where_it_converges(changes, monkeypatch):
    setting = scenario(**changes)
    outcome = CastSimulator(setting).simulate(LONG)
    assert outcome.status is Status.LANDED
    np.testing.assert_allclose(outcome.landing, converged(setting, LONG, monkeypatch), atol=1e-4)


@pytest.mark.slow
@pytest.mark.parametrize("ball", [0.045, 0.060])
def test_casts_of_a_heavy_ball_never_diverge(ball):
    setting = scenario(ball={"mass": ball}, string={"length": 0.55})
    simulator = CastSimulator(setting)
    statuses = {simulator.simulate(sample_cast(setting, 0, row)).status for row in range(40)}
    assert Status.DIVERGED not in statuses


def test_explicit_and_implicit_method_agree(monkeypatch):
    stiff = scenario(string={"n_links": 15})
    landings = {}
    for limit, method in ((np.inf, EXPLICIT), (0.0, IMPLICIT)):
        monkeypatch.setattr("wam_cast.simulation.integration.STIFFNESS", limit)
        simulator = CastSimulator(stiff)
        assert simulator.integration.method == method
        landings[method] = simulator.simulate(TYPICAL).landing
    np.testing.assert_allclose(landings[EXPLICIT], landings[IMPLICIT], atol=2e-5)


@pytest.mark.parametrize("method", [EXPLICIT, IMPLICIT])
def test_outcome_does_not_depend_on_what_was_simulated_before(method, monkeypatch):
    monkeypatch.setattr("wam_cast.simulation.integration.STIFFNESS", np.inf if method == EXPLICIT else 0.0)
    simulator = CastSimulator(scenario(string={"n_links": 5}))
    assert simulator.integration.method == method
    before = simulator.simulate(TYPICAL)
    simulator.simulate(LONG)
    np.testing.assert_array_equal(simulator.simulate(TYPICAL).landing, before.landing)


def test_stiff_string_is_integrated_implicitly():
    for n_links, method in ((1, EXPLICIT), (10, EXPLICIT), (20, IMPLICIT), (40, IMPLICIT)):
        station = CastStation(scenario(string={"n_links": n_links}), has_scene=False)
        assert choose_integration(station).method == method


def test_fastest_rate_is_that_of_a_pendulum():
    # A point on a light rod, the hook damped: an overdamped mode of rate damping / (mass length^2).
    setting = scenario(string={"n_links": 1, "mass": 1e-5, "hook_damping": 0.1}, ball={"radius": 0.001})
    rate = fastest_rate(CastStation(setting, has_scene=False))
    assert rate > 0.1 / (0.030 * 0.6**2) - 1  # the arm gives way a little, so that the string is damped faster
    assert rate < 1000


@pytest.mark.parametrize(
    "changes", [{}, {"string": {"mass": 0.0005}, "ball": {"mass": 0.1}}], ids=["reference", "light"]
)
def test_mean_step_is_the_expected_one(changes):
    setting = scenario(**changes)
    phase = contact_free.ContactFreePhase(CastStation(setting, has_scene=False))
    log = phase.run(TYPICAL).log
    n_steps = phase._loop._simulator.get_integrator().get_num_steps_taken()
    assert log.times[-1] / n_steps == pytest.approx(phase.integration.expected_step, rel=0.5)


def test_swing_changes_no_integration():
    swinging = CastStation(Scenario(noise=Noise(swing=1.0)), has_scene=False)
    assert choose_integration(swinging) == choose_integration(CastStation(Scenario(), has_scene=False))


@pytest.mark.parametrize(
    "changes",
    [{"simulation": {"max_step": 1e-6}}, {"controller": {"period": 1e-5}, "simulation": {"max_step": 1e-6}}],
    ids=str,
)
def test_cast_that_would_take_minutes_is_refused(changes):
    with pytest.raises(InputError, match=r"would take about \d+ s.*choose longer steps"):
        CastSimulator(scenario(**changes))


@pytest.mark.slow
def test_string_that_flails_ever_faster_asks_for_no_endless_steps(monkeypatch):
    """An arm out of control: it meets its limits, or diverges where no step is short enough, the joints' speeds bounded."""
    unstable = {
        "kp": 15583.44034954718,
        "kd": 299.7330235315739,
        "posture_stiffness": [5.565585486466768 * one for one in Scenario().controller.posture_stiffness],
        "posture_damping": [1.558128995638939 * one for one in Scenario().controller.posture_damping],
        "period": 0.004,
        "delay": 3,
    }
    simulator = CastSimulator(scenario(controller=unstable), make_controller=lambda known: CastController(known))
    assert simulator.simulate(Cast(0.4, 0.6, 0.1)).status is Status.LIMIT_HIT
    monkeypatch.setattr("wam_cast.simulation.integration.MIN_STEP", 2e-5)
    assert simulator.simulate(Cast(0.4, 0.6, 0.1)).status is Status.DIVERGED
    state = simulator._contact_free._loop._simulator.get_context().get_continuous_state_vector().CopyToVector()
    assert np.abs(state).max() < MAX_STATE
