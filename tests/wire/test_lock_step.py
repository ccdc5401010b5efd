"""In lock step a cast over the wire is that of one process, bit for bit, whatever the link does; no wait is for ever."""

import pytest

from wam_cast.cast import Cast
from wam_cast.errors import InputError, MachineError
from wam_cast.scenario import Scenario
from wam_cast.simulation.outcome import Status
from wam_cast.simulation.simulator import simulate_cast
from wam_cast.wire.memory_network import MemoryNetwork
from wam_cast.wire.messages import lcmt_panda_command
from wam_cast.wire.remote_arm import RemoteArm
from wam_cast.wire.stage import REQUEST_CHANNEL, StageReply, StageRequest, outcome_record

SHORT_CAST = Cast(distance=0.20, speed=0.80, wait=0.0)


def bits(outcome):
    """Return an outcome as text that no two floats share, nan among them."""
    return repr(outcome_record(outcome))


def landing_of(scenario, cast):
    return tuple(simulate_cast(scenario, cast).landing.tolist())


def test_over_a_link_that_loses_and_doubles_it_is_the_cast_of_one_process_bit_for_bit(lock_step):
    cup = landing_of(lock_step.scenario, SHORT_CAST)
    one = simulate_cast(lock_step.scenario, SHORT_CAST, cup)
    assert one.is_caught
    lock_step.link.loss, lock_step.link.doubling, lock_step.link.jitter = 0.02, 0.05, 0.001
    over_wire = lock_step.controller.cast(SHORT_CAST, cup)
    assert bits(over_wire) == bits(one)
    assert set(lock_step.controller.service["refused"]) == {"repeated or reordered"}


@pytest.mark.slow
def test_with_noise_encoders_and_delay_it_is_still_the_same(make_wire):
    noise = {"distance": 0.01, "torque": 0.01, "encoder_counts": 4096, "swing": 0.01}
    scenario = Scenario.from_dict({"noise": noise, "controller": {"delay": 1}, "arm": {"encoder_offset": 0.005}})
    wire, cast = make_wire(scenario, is_real_time=False), Cast(0.15, 0.6, 0.0, 1e-3)
    assert bits(wire.controller.cast(cast, noise_seed=3)) == bits(simulate_cast(scenario, cast, noise_seed=3))
    assert wire.refusals == []


def test_commands_that_are_lost_for_good_end_the_cast_in_one_line(lock_step):
    lock_step.fail_at(0.02, loss=1.0)
    before = lock_step.network.now()
    outcome = lock_step.controller.cast(SHORT_CAST)
    assert (outcome.status, outcome.stop_reason) == (Status.STOPPED, "no command for 5 s")
    assert lock_step.network.now() - before == pytest.approx(5.0, abs=0.01)


@pytest.mark.parametrize(
    ("spoil", "words"),
    [
        (lambda torque: [*torque[:6], float("nan")], "refused as not finite: joint 7"),
        (lambda torque: [80.0, *torque[1:]], "refused as beyond limits: joint 1 is to give 80 N m, 106 %"),
    ],
)
def test_a_command_that_is_refused_ends_the_cast(lock_step, monkeypatch, spoil, words):
    command = lock_step.controller._law.command

    def spoiled(status):
        message = command(status)
        if status.robot_utime > 20_000 and message.num_joint_torque:
            message.joint_torque = spoil(message.joint_torque)
        assert isinstance(message, lcmt_panda_command)
        return message

    monkeypatch.setattr(lock_step.controller._law, "command", spoiled)
    outcome = lock_step.controller.cast(SHORT_CAST)
    assert outcome.status is Status.STOPPED
    assert words in outcome.stop_reason
    assert outcome.end_time == pytest.approx(0.022)


def test_a_controller_without_an_arm_says_how_to_start_one(lock_step):
    network = MemoryNetwork()
    alone = RemoteArm(lock_step.scenario, network.join(), clock=network)
    with pytest.raises(MachineError, match=r"nobody answers at memory within 5 s; start an arm with `wam-cast robot`"):
        alone.cast(SHORT_CAST)


def test_sides_with_other_control_periods_do_not_begin(lock_step):
    slower = Scenario.from_dict({"controller": {"period": 0.0025}})
    other = RemoteArm(slower, lock_step.network.join(), clock=lock_step.network)
    with pytest.raises(
        InputError, match=r"controller.period = 0.0025 s, and the arm at memory is sampled every 0.002 s"
    ):
        other.cast(SHORT_CAST)


def test_an_arm_that_cannot_turn_so_far_says_so(lock_step):
    with pytest.raises(InputError, match=r"refuses the cast: cast\.bearing = 3\.1 rad: joint 1"):
        lock_step.controller.cast(Cast(0.2, 0.5, 0.1, 3.1))
    assert not lock_step.arm.port.is_open


def test_an_arm_that_was_restarted_does_not_begin_the_cast_anew(lock_step):
    replies = []
    stranger = lock_step.network.join()
    stranger.subscribe("WAM_STAGE_REPLY", replies.append)
    n_before = lock_step.arm.n_casts
    stranger.publish(REQUEST_CHANNEL, StageRequest("7", "the arm before", SHORT_CAST).encode())
    stranger.publish(REQUEST_CHANNEL, b"nonsense")
    lock_step.network.sleep_until(lock_step.network.now())
    (reply,) = (StageReply.decode(data) for data in replies)
    assert (reply.state, reply.detail) == ("refused", "the arm's process was restarted meanwhile; cast again")
    assert not lock_step.arm.work()
    assert lock_step.arm.n_casts == n_before
