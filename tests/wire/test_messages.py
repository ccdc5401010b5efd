"""What goes over the wire, bit for bit, and what is none of it."""

import json

import numpy as np
import pytest
from drake import lcmt_iiwa_command, lcmt_panda_command, lcmt_panda_status
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra import numpy as some

from wam_cast.cast import Cast
from wam_cast.simulation.outcome import Outcome, Status
from wam_cast.wire.messages import (
    ArmStatus,
    Command,
    ControlMode,
    MessageError,
    RobotMode,
    command_message,
    decode_command,
    decode_status,
    status_message,
)
from wam_cast.wire.stage import StageReply, StageRequest, outcome_of, outcome_record, stopped_outcome

SEVEN = some.arrays(float, 7)


@given(st.integers(0, 2**62), SEVEN, SEVEN, SEVEN, st.sampled_from(ControlMode), st.sampled_from(RobotMode))
def test_every_number_arrives_to_its_last_bit(utime, q, v, torque, control_mode, robot_mode):
    status = ArmStatus(utime, utime // 2, q, v, torque, control_mode, robot_mode, success_rate=0.25)
    there = decode_status(status_message(status).encode())
    assert [a.tobytes() for a in (there.q, there.v, there.torque)] == [a.tobytes() for a in (q, v, torque)]
    assert (there.utime, there.robot_utime, there.success_rate) == (utime, utime // 2, 0.25)
    assert (there.control_mode, there.robot_mode) == (control_mode, robot_mode)
    for command in (
        Command(utime, ControlMode.TORQUE, torque=torque),
        Command(utime, ControlMode.POSITION, position=q),
    ):
        there = decode_command(command_message(command).encode())
        sent, came = (one.position if one.torque is None else one.torque for one in (command, there))
        assert sent.tobytes() == came.tobytes()
        assert (there.utime, there.mode) == (utime, command.mode)


def test_fields_are_where_drake_and_its_tools_look_for_them():
    q, v, torque = np.arange(7) / 10, np.arange(7) / 5, np.arange(7.0)
    status = status_message(ArmStatus(3, 2, q, v, torque, ControlMode.TORQUE, RobotMode.MOVE))
    there = lcmt_panda_status.decode(status.encode())
    assert (there.joint_position, there.joint_velocity, there.joint_torque) == tuple(map(tuple, (q, v, torque)))
    assert there.control_mode == lcmt_panda_status.CONTROL_MODE_TORQUE
    command = command_message(Command(3, ControlMode.TORQUE, torque=torque))
    assert (command.num_joint_torque, command.num_joint_position, command.num_joint_velocity) == (7, 0, 0)


def iiwa():
    message = lcmt_iiwa_command()
    message.num_joints, message.joint_position = 7, [0.0] * 7
    return message.encode()


def panda(mode, n=7):
    message = lcmt_panda_command()
    message.control_mode_expected, message.num_joint_torque, message.joint_torque = mode, n, [0.0] * n
    return message.encode()


@pytest.mark.parametrize(
    ("data", "words"),
    [
        (b"", "no lcmt_panda_command"),
        (b"\x00" * 1000, "no lcmt_panda_command"),
        (iiwa(), "no lcmt_panda_command"),
        (panda(ControlMode.TORQUE)[:-9], "no lcmt_panda_command"),
        (panda(ControlMode.TORQUE, 6), "6 joints, where the arm has 7"),
        (panda(2), "control mode 2 is none"),
        (panda(0), "no control mode"),
        (panda(ControlMode.POSITION), "position: 0 joints"),
    ],
)
def test_what_is_no_command_says_why(data, words):
    with pytest.raises(MessageError, match=words):
        decode_command(data)


@given(st.binary(max_size=400))
def test_whatever_bytes_come_they_are_a_message_or_none(data):
    for decode in (decode_command, decode_status, StageRequest.decode, StageReply.decode):
        with pytest.raises(MessageError):
            decode(data)


ANYTHING = st.recursive(
    st.none() | st.booleans() | st.integers() | st.floats() | st.text(max_size=9),
    lambda inner: st.lists(inner, max_size=4) | st.dictionaries(st.text(max_size=9), inner, max_size=3),
    max_leaves=6,
)
NUMBERS = st.integers() | st.floats()
CASTS = st.fixed_dictionaries(dict.fromkeys(("distance", "speed", "wait"), NUMBERS | st.text(max_size=2)))
GOOD = {
    "number": st.text(max_size=9),
    "robot": st.text(max_size=9),
    "cast": st.none() | CASTS,
    "cup": st.none() | st.lists(NUMBERS, max_size=3),
    "noise_seed": st.integers(),
    "state": st.sampled_from(["ready", "busy", "casting", "done", "refused"]),
    "period": NUMBERS,
    "is_real_time": st.booleans(),
    "outcome": st.none() | st.dictionaries(st.text(max_size=9), ANYTHING, max_size=2),
}


@given(ANYTHING | st.fixed_dictionaries({}, optional={name: good | ANYTHING for name, good in GOOD.items()}))
def test_whatever_json_comes_it_is_a_question_or_an_answer_or_none(values):
    data = json.dumps(values).encode()
    for kind in (StageRequest, StageReply):
        try:
            message = kind.decode(data)
        except MessageError:
            continue
        assert repr(kind.decode(message.encode())) == repr(message)
        assert isinstance(message.number, str)
        if isinstance(message, StageReply):
            assert 0 < message.period < np.inf
        elif message.cup is not None:
            assert np.all(np.abs(message.cup) <= 100)
    with pytest.raises(MessageError):
        outcome_of(values)


QUESTION = {"number": "a", "robot": "", "cast": None, "cup": None, "noise_seed": 0}


@pytest.mark.parametrize(
    "data",
    [
        *(json.dumps(QUESTION | one).encode() for one in ({"noise_seed": np.inf}, {"noise_seed": -1}, {"number": 1})),
        *(json.dumps(QUESTION | {"cup": cup}).encode() for cup in ({"a": 1}, [0.5], [0.5, np.inf], [0.5, 1e9])),
        *(
            json.dumps(QUESTION | {"cast": cast}).encode()
            for cast in ([1, 2], {"distance": "x", "speed": 1, "wait": 1}, {"distance": 10**400, "speed": 1, "wait": 1})
        ),
        json.dumps(QUESTION).encode()[:-2] + b"9" * 5000 + b"}",
        b"[" * 100_000,
        b'{"number": "a"}'.ljust(100_000),
        json.dumps(QUESTION | {"number": "\ud800"}).encode(),
    ],
)
def test_what_is_no_question_is_one_error(data):
    with pytest.raises(MessageError, match="no question: "):
        StageRequest.decode(data)


def test_a_status_of_another_arm_is_refused():
    status = status_message(ArmStatus(1, 0, *np.zeros((3, 7)), ControlMode.TORQUE, RobotMode.MOVE))
    status.robot_mode = 3
    with pytest.raises(MessageError, match="robot mode 3"):
        decode_status(status.encode())
    status.num_joints = 6
    with pytest.raises(MessageError, match="6 joints"):
        decode_status(status.encode())


def test_questions_and_answers_arrive_as_they_were_asked():
    asked = StageRequest("a-1", "robot", Cast(0.3, 0.6, 0.1, -0.7), (0.75, 1 / 3), 5)
    assert StageRequest.decode(asked.encode()) == asked
    assert StageRequest.decode(StageRequest("a").encode()) == StageRequest("a")
    reply = StageReply("a-1", "robot", "done", 0.002, True, outcome={"x": 0.1}, service={"refused": {"stale": 2}})
    assert StageReply.decode(reply.encode()) == reply
    nonsense = json.dumps({"number": 1, "robot": "", "cast": {"distance": "far"}, "cup": None, "noise_seed": 0})
    with pytest.raises(ValueError, match="no question"):
        StageRequest.decode(nonsense.encode())


def test_an_outcome_arrives_to_its_last_bit():
    rng = np.random.default_rng(0)
    numbers = iter((rng.normal(size=20) / 3).tolist())
    outcome = Outcome(
        *(Status.CAUGHT, rng.normal(size=2), next(numbers), next(numbers), next(numbers), rng.normal(size=3)),
        *(next(numbers), True, next(numbers), np.nan, rng.random(7), rng.random(7), next(numbers)),
        *(("joint 4 speed",), next(numbers)),
    )
    record = json.loads(json.dumps(outcome_record(outcome)))
    assert repr(outcome_of(record)) == repr(outcome)
    with pytest.raises(ValueError, match="slack"):
        outcome_of({name: value for name, value in record.items() if name != "slack"})


def test_a_stopped_cast_is_an_outcome_that_says_why():
    outcome = stopped_outcome("no command in time for 20 ms", 0.5)
    assert (outcome.status, outcome.stop_reason, outcome.end_time) == (
        Status.STOPPED,
        "no command in time for 20 ms",
        0.5,
    )
    assert not outcome.is_caught
    assert np.isnan(outcome.landing).all()
