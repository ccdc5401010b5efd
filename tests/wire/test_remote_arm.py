"""The controller's side: whose statuses it answers, what it refuses to begin with, what it makes of other versions, how it ends."""

import json

import numpy as np
import pytest

from wam_cast.arm.posture import starting_posture
from wam_cast.cast import Cast
from wam_cast.errors import InputError, MachineError
from wam_cast.scenario import Scenario
from wam_cast.simulation.outcome import Status
from wam_cast.wire.memory_network import MemoryNetwork
from wam_cast.wire.messages import COMMAND_CHANNEL
from wam_cast.wire.remote_arm import ANSWER_PATIENCE, APART, AT_START, BUSY_PATIENCE, RemoteArm
from wam_cast.wire.safety import SafetyMode
from wam_cast.wire.stage import MOST_BYTES, REPLY_CHANNEL, REQUEST_CHANNEL, StageRequest

SHORT_CAST = Cast(distance=0.20, speed=0.80, wait=0.0)


@pytest.fixture(params=["lock_step", "in_real_time"])
def wire(request):
    return request.getfixturevalue(request.param)


def commands_on(network):
    """Return a list of the commands that anybody will send."""
    heard = []
    network.join().subscribe(COMMAND_CHANNEL, heard.append)
    return heard


def test_of_two_controllers_only_the_one_whose_cast_is_made_is_heard(wire, monkeypatch):
    bus, outcomes, channels = wire.network.join(), [], []
    late = RemoteArm(wire.scenario, bus, clock=wire.network)
    publish = bus.publish

    def overtaken(channel, data):
        channels.append(channel)
        if channel == REQUEST_CHANNEL and StageRequest.decode(data).cast is not None and not outcomes:
            outcomes.append(None)  # the question is lost, and the other one's comes first
            wire.fail_at(0.3, loss=1.0)
            outcomes[0] = wire.controller.cast(SHORT_CAST)
            raise KeyboardInterrupt
        publish(channel, data)

    monkeypatch.setattr(bus, "publish", overtaken)
    with pytest.raises(KeyboardInterrupt):
        late.cast(Cast(0.35, 0.9, 0.2, 0.8))
    assert outcomes[0].status is Status.STOPPED
    assert outcomes[0].end_time > 0.3
    assert "no command" in outcomes[0].stop_reason
    assert wire.refusals == []
    assert set(channels) == {REQUEST_CHANNEL}


def test_an_arm_that_waits_elsewhere_is_not_begun_with(wire):
    elsewhere = Scenario.from_dict({"motion": {"start_radius": 0.19}})
    here, there = starting_posture(wire.scenario)[3], starting_posture(elsewhere)[3]
    assert abs(here - there) > 2 * AT_START
    stray, commands = RemoteArm(elsewhere, wire.network.join(), clock=wire.network), commands_on(wire.network)
    words = f"joint 4 of the arm at memory is at {here:.4g} rad, and the scenario starts a cast at {there:.4g} rad"
    with pytest.raises(InputError, match=words):
        stray.cast(SHORT_CAST)
    assert commands == []
    assert wire.arm.safety.refused == {}


@pytest.mark.parametrize("moment", ["before it is answered", "when it is to be sent", "when it is sent", "later"])
def test_interrupted_it_has_the_arm_stay_with_a_command_that_the_arm_takes(lock_step, monkeypatch, moment):
    statuses, commands, times, moments, network = [], [], [], [moment], lock_step.network
    law, bus = lock_step.controller._law, lock_step.controller._bus
    command, publish = law.command, bus.publish

    def at(now):
        if moments and now == moments[0] and len(statuses) == len(commands) + (now != "later") == 30:
            moments.clear()
            raise KeyboardInterrupt

    def watched_command(status):
        statuses.append(status)
        at("before it is answered")
        return command(status)

    def watched_publish(channel, data):
        at("when it is to be sent")
        publish(channel, data)
        at("when it is sent")

    def hear(data):
        commands.append(data)
        times.append(network.now())
        at("later")

    monkeypatch.setattr(law, "command", watched_command)
    monkeypatch.setattr(bus, "publish", watched_publish)
    network.join().subscribe(COMMAND_CHANNEL, hear)
    with pytest.raises(KeyboardInterrupt):
        lock_step.controller.cast(SHORT_CAST)
    monkeypatch.undo()
    network.sleep_until(network.now())
    n_stays = 2 if "sent" in moment else 1
    assert np.all(np.diff(times)[-n_stays:] > 0.9 * APART)
    last, safety = statuses[-1], lock_step.arm.safety
    assert len(statuses) == 30
    assert last.robot_utime > 0
    # In lock step the arm's clock is at the sample that waits for its answer.
    utime = last.utime + (2000 if moment in ("when it is sent", "later") else 0)
    q, v = np.array(last.joint_position), np.array(last.joint_velocity)
    for data in commands[-3:]:
        safety.receive(data, utime, q)
    assert safety.decide(utime, q, v) is SafetyMode.STOPPED
    assert safety.stop_reason == "the controller told it to stay"
    lock_step.arm.work()  # until it is free again


class Answers:
    """An arm's side that gives each question an answer with these values, or these bytes; and a controller that asks it."""

    def __init__(self):
        self.network, self.values, self.data = MemoryNetwork(), {}, None
        self.controller = RemoteArm(Scenario(), self.network.join(), clock=self.network)
        self.side = self.network.join()
        self.side.subscribe(REQUEST_CHANNEL, self.answer)

    def answer(self, question):
        reply = {"number": json.loads(question)["number"], "robot": "r", "state": "ready", "period": 0.002}
        reply |= {"is_real_time": False, **self.values}
        self.side.publish(REPLY_CHANNEL, json.dumps(reply).encode() if self.data is None else self.data)


@pytest.fixture(scope="module")
def all_answers():
    return Answers()


@pytest.fixture
def answers(all_answers):
    all_answers.values, all_answers.data = {}, None
    return all_answers


def test_an_arm_that_is_busy_with_anothers_cast_is_asked_for_a_while(answers):
    answers.values, begun = {"state": "busy"}, answers.network.now()
    with pytest.raises(MachineError, match="is busy with another's cast; try again later"):
        answers.controller.cast(SHORT_CAST)
    assert answers.network.now() - begun == pytest.approx(BUSY_PATIENCE, abs=0.5)


@pytest.mark.parametrize(
    ("values", "data", "words"),
    [
        ({"state": 5}, None, "no reply: state: input should be 'ready', "),
        ({"state": "paused"}, None, "not 'paused'"),
        ({"number": [1]}, None, "no reply: number: input should be a valid string"),
        ({"period": "x"}, None, "no reply: period: input should be a valid number"),
        ({"period": float("nan")}, None, "no reply: period: "),
        ({}, b"[" * 1000, "no reply: the top level: invalid JSON: recursion limit"),
        ({}, b" " * (MOST_BYTES + 1), "no reply: 65537 bytes, where 65536 are the most"),
        ({"state": "done", "outcome": {"status": "lost"}}, None, "no outcome: status: input should be 'caught', "),
        ({"state": "done"}, None, "no outcome: status: a value is missing"),
    ],
    ids=str,
)
def test_what_is_no_answer_is_told_as_another_version(answers, values, data, words):
    answers.values, answers.data, begun = values, data, answers.network.now()
    with pytest.raises(MachineError, match="run the same version on both sides") as error:
        answers.controller.cast(SHORT_CAST)
    assert words in str(error.value)
    assert answers.network.now() - begun == pytest.approx(0 if "outcome" in words else ANSWER_PATIENCE, abs=0.5)


def test_an_answer_with_more_in_it_than_this_version_knows_is_heard(answers):
    answers.values = {"mood": "good", "period": 0.004}
    with pytest.raises(InputError, match=r"the arm at memory is sampled every 0\.004 s"):
        answers.controller.cast(SHORT_CAST)


def test_noise_on_the_channel_is_no_answer(answers):
    answers.side.publish(REPLY_CHANNEL, b"noise")
    answers.values = {"state": "refused", "detail": "out of order"}
    with pytest.raises(InputError, match="refuses the cast: out of order"):
        answers.controller.cast(SHORT_CAST)
