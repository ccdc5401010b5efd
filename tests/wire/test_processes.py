"""Both sides as processes that LCM joins: found, killed, restarted, interrupted. Skipped where there is no multicast."""

import json
import os
import signal
import subprocess
import sys

import pytest

from wam_cast.cast import Cast
from wam_cast.errors import MachineError
from wam_cast.scenario import Scenario
from wam_cast.simulation.outcome import Status
from wam_cast.simulation.simulator import simulate_cast
from wam_cast.wire.bus import LcmBus
from wam_cast.wire.messages import STATUS_CHANNEL, decode_status
from wam_cast.wire.remote_arm import RemoteArm
from wam_cast.wire.stage import outcome_record

pytestmark = [pytest.mark.slow, pytest.mark.skipif(os.name != "posix", reason="signals of POSIX")]

CAST = Cast(distance=0.20, speed=0.80, wait=0.0)


@pytest.fixture(scope="module")
def url():
    """Return an address that no other test uses, if multicast arrives here."""
    address = f"udpm://239.255.76.67:{20000 + os.getpid() % 20000}?ttl=0"
    heard, listener, speaker = [], LcmBus(address), LcmBus(address)
    listener.subscribe("HELLO", heard.append)
    for _ in range(20):
        speaker.publish("HELLO", b"hello")
        listener.handle(0.1)
    if not heard:
        pytest.skip("no multicast on this machine")
    return address


@pytest.fixture
def start():
    """Return a function that starts a command of `wam-cast`; what is left of them at the end is killed."""
    started = []

    def run(*words):
        command = [sys.executable, "-m", "wam_cast", *words]
        started.append(subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True))
        return started[-1]

    yield run
    for process in started:
        process.kill()
        process.communicate()


def line_of(process):
    return json.loads(process.stdout.readline())


def when_it_moves(bus, do):
    """Have something done once when the arm has been moving for a while; with somebody's `bus` who hears its statuses."""
    done = []

    def look(data):
        if not done and decode_status(data).robot_utime > 50_000:
            done.append(do())

    bus.subscribe(STATUS_CHANNEL, look)
    return done


class BadBus(LcmBus):
    """Loses and doubles some of what is sent."""

    n_sent = 0

    def publish(self, channel, data):
        self.n_sent += 1
        for _ in range(0 if self.n_sent % 50 == 7 else 2 if self.n_sent % 20 == 3 else 1):
            super().publish(channel, data)


def test_an_arm_and_its_controller_that_are_killed_and_restarted(url, start):
    arm = start("robot", "--url", url, "--json")
    assert line_of(arm) == {"url": url, "mode": "lock step", "period": 0.002}

    # The controller is killed: the arm stops waiting, tells of it, and casts with the next one.
    throw = start("throw", "--cup", "0.6", "--cast", "0.2,0.8,0", "--robot", url, "--json")
    witness = LcmBus(url)
    killed = when_it_moves(witness, throw.kill)
    while not killed:
        witness.handle(0.1)
    told = line_of(arm)
    assert (told["status"], told["stop_reason"]) == ("stopped", "no command for 5 s")
    one = simulate_cast(Scenario(), CAST)
    assert repr(outcome_record(RemoteArm(Scenario(), BadBus(url)).cast(CAST))) == repr(outcome_record(one))
    told = line_of(arm)
    assert told["status"] == "landed"
    assert set(told["refused"]) == {"repeated or reordered"}

    # The arm is killed: its controller says so in one line, and casts with the next one.
    bus = LcmBus(url)
    controller = RemoteArm(Scenario(), bus)
    killer = LcmBus(url)
    killed = when_it_moves(killer, arm.kill)
    hear = bus.handle
    bus.handle = lambda timeout: (killer.handle(), hear(timeout))
    with pytest.raises(MachineError, match="fell silent amid the cast"):
        controller.cast(CAST)
    assert killed
    arm = start("robot", "--url", url, "--json")
    assert line_of(arm)["url"] == url
    assert repr(outcome_record(controller.cast(CAST))) == repr(outcome_record(one))

    assert line_of(arm)["status"] == "landed"
    arm.send_signal(signal.SIGINT)
    assert arm.wait(timeout=60) == 130
    assert arm.communicate()[1].strip() == "interrupted"


def test_in_real_time_the_arm_casts_or_says_why_it_stopped(url, start):
    arm = start("robot", "--url", url, "--real-time", "--casts", "1", "--json")
    assert line_of(arm)["mode"] == "real time"
    throw = start("throw", "--cup", "0.6", "--cast", "0.2,0.8,0", "--robot", url, "--json")
    out, err = throw.communicate(timeout=120)
    record, told = json.loads(out), line_of(arm)
    assert record["status"] == told["status"]
    assert told["n_ticks"] > 0
    if record["status"] == Status.STOPPED:  # a busy machine is no arm's friend
        assert throw.returncode == 1
        assert record["stop_reason"] == told["stop_reason"] != ""
        assert told["n_missed"] > 0 or "late" in told["stop_reason"] or "no command" in told["stop_reason"]
    else:
        assert record["status"] in ("caught", "short", "long", "rim_bounce")
    assert arm.wait(timeout=60) == 0
    assert err == ""
