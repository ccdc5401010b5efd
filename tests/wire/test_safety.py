"""The state machine of the arm's side: what it lets through, when its brakes open, and what stops it. No simulation, no clock."""

import re

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from wam_cast.wire.messages import Command, ControlMode, command_message
from wam_cast.wire.safety import AT_REST, OPENING_COMMANDS, SILENCE, ArmLimits, ArmSafety, SafetyMode

PERIOD, PERIOD_US = 0.002, 2000
SILENT_SAMPLES = round(SILENCE / PERIOD)
LIMITS = ArmLimits(
    torque=np.array([75.6, 101.7, 60.5, 28.8, 11.4, 11.4, 2.6]),
    velocity=np.full(7, 2.0),
    lower=np.full(7, -2.0),
    upper=np.full(7, 2.0),
)
HOME, AT_STANDSTILL = np.array([0.0, -1.2, 0.0, 1.9, 0.0, -0.6, 0.0]), np.zeros(7)
TORQUE = 0.1 * LIMITS.torque


class Arm:
    """A safety machine and the clock and joints that it is told."""

    def __init__(self, max_delay=1):
        self.safety, self.n, self.q, self.v = ArmSafety(LIMITS, PERIOD, max_delay), 0, HOME, AT_STANDSTILL

    @property
    def utime(self):
        return self.n * PERIOD_US

    def sample(self, *messages):
        """Go on by a sample in which these come, and return what is wrong with each: its kind."""
        self.n += 1
        refusals = [self.safety.receive(message, self.utime, self.q) for message in messages]
        self.safety.decide(self.utime, self.q, self.v)
        return [refusal and refusal.kind for refusal in refusals]

    def stay(self, late=1, position=None, sample=None):
        """Return a command to stay that comes, in the next sample, so many periods late."""
        sample = self.n + 1 - late if sample is None else sample
        q = self.q if position is None else position
        return encoded(Command(sample * PERIOD_US, ControlMode.POSITION, position=q))

    def torque(self, late=1, torque=TORQUE, sample=None):
        sample = self.n + 1 - late if sample is None else sample
        return encoded(Command(sample * PERIOD_US, ControlMode.TORQUE, torque=np.asarray(torque)))

    def open(self):
        for _ in range(OPENING_COMMANDS):
            assert self.sample(self.stay()) == [None]
        return self

    def obey(self):
        self.open()
        assert self.sample(self.torque()) == [None]
        assert self.safety.mode is SafetyMode.OBEYING
        return self


def encoded(command):
    return command_message(command).encode()


def with_joint(values, joint, value):
    changed = np.array(values)
    changed[joint - 1] = value
    return changed


def test_brakes_open_after_a_row_of_commands_to_stay_and_not_before():
    arm = Arm()
    for _ in range(OPENING_COMMANDS - 1):
        arm.sample(arm.stay())
        assert arm.safety.mode is SafetyMode.LOCKED
    arm.sample(arm.stay())
    assert arm.safety.mode is SafetyMode.HOLDING
    assert arm.safety.torque is None
    assert arm.sample(arm.torque()) == [None]
    assert arm.safety.mode is SafetyMode.OBEYING
    np.testing.assert_array_equal(arm.safety.torque, TORQUE)


@pytest.mark.parametrize(
    ("wrong", "kind"),
    [
        (lambda arm: arm.torque(), "brakes closed"),
        (lambda arm: arm.stay(position=with_joint(HOME, 4, HOME[3] + 2 * AT_REST)), "not where the arm is"),
        (lambda arm: arm.stay(position=with_joint(HOME, 2, np.nan)), "not finite"),
        (lambda arm: arm.stay(position=with_joint(HOME, 1, 2.5)), "beyond limits"),
        (lambda arm: arm.stay(late=3), "repeated or reordered"),
        (lambda arm: b"garbage", "broken"),
        (lambda arm: arm.stay(late=-1), "of the future"),
    ],
)
def test_one_wrong_command_and_the_row_begins_anew(wrong, kind):
    arm = Arm()
    for _ in range(OPENING_COMMANDS - 1):
        arm.sample(arm.stay())
    assert arm.sample(wrong(arm)) == [kind]
    assert arm.safety.refused == {kind: 1}
    arm.sample(arm.stay())
    assert arm.safety.mode is (SafetyMode.HOLDING if kind == "repeated or reordered" else SafetyMode.LOCKED)


@pytest.mark.parametrize(
    ("torque", "words"),
    [
        (with_joint(TORQUE, 3, np.nan), "not finite: joint 3"),
        (with_joint(TORQUE, 7, -np.inf), "not finite: joint 7"),
        (with_joint(TORQUE, 1, 75.7), r"beyond limits: joint 1 is to give 75\.7 N m, 100 %"),
        (with_joint(TORQUE, 4, -30), "beyond limits: joint 4 is to give -30 N m, 104 %"),
        # The wrist's joints 5 and 6 share two motors: each within its own limit, both together beyond.
        (with_joint(with_joint(TORQUE, 5, 8.0), 6, 8.0), "beyond limits: joint 5 is to give 8 N m, 140 %"),
    ],
)
def test_a_torque_that_is_refused_is_as_one_that_never_came(torque, words):
    arm = Arm().obey()
    (kind,) = arm.sample(arm.torque(torque=torque))
    assert arm.safety.mode is SafetyMode.OBEYING
    np.testing.assert_array_equal(arm.safety.torque, TORQUE)
    for _ in range(SILENT_SAMPLES - 1):
        arm.sample(arm.torque(torque=torque))
    assert arm.safety.mode is SafetyMode.STOPPED
    assert arm.safety.refused == {kind: SILENT_SAMPLES}
    assert re.fullmatch(
        f"no command in time for 20 ms: the last one that was refused is {words}.*", arm.safety.stop_reason
    )


def test_torques_at_their_limits_are_obeyed():
    arm = Arm().obey()
    assert arm.sample(arm.torque(torque=LIMITS.torque * [1, -1, 0, 1, 0, -1, 1])) == [None]


def test_the_arm_stops_after_20_ms_of_silence_and_not_a_sample_earlier():
    arm = Arm().obey()
    for _ in range(SILENT_SAMPLES - 1):
        arm.sample()
        assert arm.safety.mode is SafetyMode.OBEYING
    arm.sample()
    assert arm.safety.mode is SafetyMode.STOPPED
    assert arm.safety.stop_reason == "no command in time for 20 ms"
    assert arm.safety.torque is None
    assert arm.sample(arm.torque()) == ["stopped"]
    assert arm.sample(arm.stay()) == ["stopped"]
    assert arm.safety.mode is SafetyMode.STOPPED


def test_brakes_close_again_when_nobody_wants_anything():
    arm = Arm().open()
    for _ in range(SILENT_SAMPLES):
        assert arm.safety.mode is SafetyMode.HOLDING
        arm.sample()
    assert arm.safety.mode is SafetyMode.LOCKED
    arm.sample(arm.stay())
    assert arm.safety.mode is SafetyMode.LOCKED


def test_a_late_command_is_better_than_an_older_one_but_not_for_long():
    arm = Arm(max_delay=1).obey()
    for _ in range(SILENT_SAMPLES // 2):
        assert arm.sample(arm.torque(late=2, torque=0.5 * TORQUE)) in ([None], ["repeated or reordered"])
    np.testing.assert_array_equal(arm.safety.torque, 0.5 * TORQUE)
    arm.sample(arm.torque())  # in time: all is well again
    for _ in range(SILENT_SAMPLES):
        assert arm.safety.mode is SafetyMode.OBEYING
        arm.sample(arm.torque(late=2))
    assert arm.safety.mode is SafetyMode.STOPPED
    assert "more than 2 ms late, up to which the control loop is stable" in arm.safety.stop_reason


def test_stale_commands_are_refused_by_the_arms_own_clock():
    arm = Arm(max_delay=1).obey()
    for _ in range(5):
        arm.sample()
    assert arm.sample(arm.torque(late=3)) == ["stale"]
    assert arm.sample(arm.torque(late=2)) == [None]
    assert Arm(max_delay=2).obey().safety.mode is SafetyMode.OBEYING


def test_brakes_stay_closed_for_commands_that_always_come_too_late():
    arm = Arm(max_delay=1)
    for _ in range(20):
        arm.sample(arm.stay(late=2) if arm.n > 2 else b"")
    assert arm.safety.mode is SafetyMode.LOCKED
    arm.safety.stay_locked()
    assert arm.safety.stop_reason == (
        "the brakes stayed closed: commands come more than 2 ms late, up to which the control loop is stable"
    )


def test_doubled_and_reordered_commands_change_nothing():
    arm = Arm(max_delay=3).obey()
    for i in range(1, 30):
        first, second = arm.torque(torque=i / 30 * TORQUE), arm.torque(late=2, torque=-TORQUE)
        assert arm.sample(first, first, second, first) == [None, *3 * ["repeated or reordered"]]
        np.testing.assert_array_equal(arm.safety.torque, i / 30 * TORQUE)
    assert arm.safety.mode is SafetyMode.OBEYING


@pytest.mark.parametrize(
    ("q", "v", "words"),
    [
        (with_joint(HOME, 2, -2.01), AT_STANDSTILL, "joint 2 position"),
        (HOME, with_joint(AT_STANDSTILL, 4, 2.1), "joint 4 speed"),
        (HOME, with_joint(AT_STANDSTILL, 5, np.nan), "joint 5 encoder"),
        (with_joint(HOME, 7, np.nan), AT_STANDSTILL, "joint 7 encoder"),
    ],
)
def test_an_arm_beyond_its_limits_stops_at_once(q, v, words):
    arm = Arm().obey()
    arm.q, arm.v = q, v
    arm.sample(arm.torque())
    assert arm.safety.mode is SafetyMode.STOPPED
    assert arm.safety.stop_reason == f"the arm left its limits: {words}"


def test_told_to_stay_the_arm_stops_wherever_it_is():
    arm = Arm().obey()
    assert arm.sample(arm.stay(position=arm.q + 0.05)) == [None]  # where it was a while ago
    assert arm.safety.mode is SafetyMode.STOPPED
    assert arm.safety.stop_reason == "the controller told it to stay"


def test_a_reset_closes_the_brakes_and_lets_nothing_old_through():
    arm = Arm().obey()
    arm.safety.stop("enough")
    arm.safety.stop("another reason")
    assert arm.safety.stop_reason == "enough"
    arm.safety.reset()
    assert (arm.safety.mode, arm.safety.stop_reason) == (SafetyMode.LOCKED, "")
    assert arm.sample(arm.torque(sample=arm.n - 1)) == ["repeated or reordered"]
    arm.obey()


MESSAGES = st.sampled_from(["stay", "torque", "late", "stale", "huge", "nan", "elsewhere", "garbage", "nothing"])


@given(st.lists(MESSAGES, max_size=60), st.integers(0, 3))
def test_whatever_comes_no_torque_beyond_limits_acts_and_none_with_closed_brakes(script, max_delay):
    arm = Arm(max_delay)
    n_stays = 0
    for word in script:
        make = {
            "stay": lambda: arm.stay(late=0),
            "torque": lambda: arm.torque(late=0),
            "late": lambda: arm.torque(late=max_delay + 1),
            "stale": lambda: arm.torque(late=max_delay + 2),
            "huge": lambda: arm.torque(late=0, torque=2 * LIMITS.torque),
            "nan": lambda: arm.torque(late=0, torque=np.full(7, np.nan)),
            "elsewhere": lambda: arm.stay(late=0, position=HOME + 0.1),
            "garbage": lambda: b"\x00" * 20,
        }
        was = arm.safety.mode
        arm.sample(*([] if word == "nothing" else [make[word]()]))
        n_stays = n_stays + (word == "stay")
        torque = arm.safety.torque
        assert (torque is not None) == (arm.safety.mode is SafetyMode.OBEYING)
        assert torque is None or np.array_equal(torque, TORQUE)
        assert arm.safety.mode is not SafetyMode.OBEYING or n_stays >= OPENING_COMMANDS
        assert was is not SafetyMode.STOPPED or arm.safety.mode is SafetyMode.STOPPED
