"""In real time, on a network with a time of its own: what delay, jitter and loss do, and that an arm which stops does so safely."""

import numpy as np
import pytest

from wam_cast.cast import Cast
from wam_cast.errors import InputError
from wam_cast.robot.plant import N_ARM
from wam_cast.scenario import Scenario
from wam_cast.simulation.outcome import Status
from wam_cast.simulation.simulator import simulate_cast
from wam_cast.wire.memory_network import MemoryNetwork
from wam_cast.wire.simulated_arm import SimulatedArm, stable_delay

SHORT_CAST = Cast(distance=0.20, speed=0.80, wait=0.0)

LATER = Scenario.from_dict({"controller": {"delay": 1}})
"""In one process, what real time does: a torque acts a period later."""


def landing_of(cast):
    return tuple(simulate_cast(LATER, cast).landing.tolist())


def test_it_is_the_cast_of_one_process_with_a_delay_of_one_period(in_real_time):
    cup = landing_of(SHORT_CAST)
    one, over_wire = simulate_cast(LATER, SHORT_CAST, cup), in_real_time.controller.cast(SHORT_CAST, cup)
    assert (one.status, over_wire.status) == (Status.CAUGHT, Status.CAUGHT)
    np.testing.assert_allclose(over_wire.landing, one.landing, atol=1e-5)
    np.testing.assert_allclose(over_wire.peak_torque_utilization, one.peak_torque_utilization, atol=0.01)
    assert over_wire.end_time == pytest.approx(one.end_time, abs=0.02)
    assert in_real_time.refusals == []
    assert in_real_time.controller.service["n_missed"] == 0


def test_two_ms_and_a_lost_message_in_a_hundred_move_the_landing_by_less_than_a_millimetre(in_real_time):
    cup = landing_of(SHORT_CAST)
    in_real_time.link.delay, in_real_time.link.loss, in_real_time.link.doubling = 0.002, 0.01, 0.01
    outcome = in_real_time.controller.cast(SHORT_CAST, cup)
    assert outcome.is_caught
    assert outcome.miss < 1e-3
    assert in_real_time.controller.service["refused"]["repeated or reordered"] > 0


def test_eight_ms_are_refused_before_anything_moves(in_real_time):
    in_real_time.link.delay = 0.008
    outcome = in_real_time.controller.cast(SHORT_CAST)
    assert outcome.status is Status.STOPPED
    assert "the brakes stayed closed" in outcome.stop_reason
    assert "stale: its torque would be 8 ms late; 4 ms at most" in outcome.stop_reason
    log = in_real_time.arm.one_pass.log()
    assert len(log.times) == 1  # where it began


@pytest.mark.parametrize("failure", [{"loss": 1.0}, {"delay": 0.004}], ids=str)
def test_a_link_that_fails_amid_a_cast_stops_the_arm_where_it_is(in_real_time, failure):
    in_real_time.fail_at(0.15, **failure)
    outcome = in_real_time.controller.cast(SHORT_CAST)
    assert outcome.status is Status.STOPPED
    assert outcome.stop_reason.startswith("no command in time for 20 ms")
    log = in_real_time.arm.one_pass.log()
    n_q = log.states.shape[1] // 2
    q, v = log.states[:, :N_ARM], log.states[:, n_q : n_q + N_ARM]
    moving = np.abs(v[np.searchsorted(log.times, 0.15)]).max()
    assert moving > 0.3  # it was under way
    assert np.abs(v[-1]).max() < 0.1  # the ball swings on, and tugs at the wrist
    limits = in_real_time.arm.safety.limits
    assert np.all((q > limits.lower) & (q < limits.upper))
    assert np.all(np.abs(v) < limits.velocity)
    stopped = np.searchsorted(log.times, log.times[-1] - 0.5)
    assert np.abs(q[stopped:] - q[stopped]).max() < 0.06
    assert np.all(np.abs(log.torques) <= limits.torque * (1 + 1e-9))


def test_ctrl_c_on_the_controllers_side_has_the_arm_stay(in_real_time, monkeypatch):
    command = in_real_time.controller._law.command

    def interrupted(status):
        if status.robot_utime > 100_000:
            raise KeyboardInterrupt
        return command(status)

    monkeypatch.setattr(in_real_time.controller._law, "command", interrupted)
    with pytest.raises(KeyboardInterrupt):
        in_real_time.controller.cast(SHORT_CAST)


def test_a_loop_that_bears_no_delay_is_refused_in_real_time():
    scenario = Scenario.from_dict({"controller": {"delay": 1}})
    assert [stable_delay(one, one) for one in (Scenario(), scenario)] == [1, 0]
    network = MemoryNetwork()
    with pytest.raises(InputError, match="in real time a command acts a period later"):
        SimulatedArm(network.join(), scenario, clock=network, is_real_time=True)


def test_a_cast_past_the_arms_limits_is_stopped(in_real_time):
    cast = Cast(0.4, 1.9, 0.0)
    outcome = in_real_time.controller.cast(cast)
    assert outcome.status is Status.STOPPED
    assert "speed" in outcome.stop_reason
