"""`wam-cast robot` and `throw --robot`, without a second process: what they print, and what they refuse."""

import json
from collections import Counter
from types import SimpleNamespace

import pytest

import wam_cast as wc
from wam_cast.cli.work import serving
from wam_cast.simulation.outcome import Status
from wam_cast.wire import bus, remote_arm
from wam_cast.wire.memory_network import MemoryNetwork
from wam_cast.wire.safety import Refusal
from wam_cast.wire.simulated_arm import SimulatedArm
from wam_cast.wire.stage import StageRequest, stopped_outcome

URL = "udpm://239.255.76.67:7667?ttl=0"
CAST = ("throw", "--cup", "0.6", "--cast", "0.2,0.8,0")


@pytest.fixture
def network(monkeypatch):
    """Let the command line's side of the wire be joined within this process."""
    network = MemoryNetwork()
    for module in (bus, serving):
        monkeypatch.setattr(module, "LcmBus", lambda url: network.join())
    monkeypatch.setattr(remote_arm, "WallClock", lambda: network)
    return network


@pytest.mark.parametrize(
    ("words", "parts"),
    [
        ((*CAST, "--robot", "nowhere"), ["'nowhere'", "udpm://GROUP:PORT", URL]),
        ((*CAST, "--robot", URL, "--belief", "b.yaml"), ["--belief", "--scenario"]),
        ((*CAST, "--robot", URL, "--replay", "cast.html"), ["--replay", "leave them out"]),
        (("robot", "--url", "memq://"), ["'memq://'", "udpm://GROUP:PORT"]),
        (("robot", "--scenario", "missing.yaml"), ["missing.yaml", "name a readable YAML file"]),
        (("robot", "--casts", "0"), ["--casts", "greater than or equal to 1"]),
    ],
)
def test_wrong_input_gets_one_line(cli, words, parts):
    result = cli(*words)
    assert (result.code, result.out) == (2, "")
    assert result.err.count("\n") == 1
    assert all(part in result.err for part in parts)


def test_an_arm_that_is_not_there_is_one_line(cli, network):
    result = cli(*CAST, "--robot", URL, "--json")
    assert (result.code, result.out) == (2, "")
    assert result.err.count("\n") == 1
    assert "nobody answers" in result.err
    assert "wam-cast robot" in result.err


@pytest.mark.slow
def test_json_is_that_of_one_process_and_two_keys(cli, network):
    arm = SimulatedArm(network.join(lambda: arm.work()), wc.Scenario(), clock=network)
    here, there = cli(*CAST, "--json"), cli(*CAST, "--robot", URL, "--json")
    assert there.code == here.code == 1  # it lands elsewhere
    assert json.loads(there.out) == {**json.loads(here.out), "robot": URL, "stop_reason": ""}


def test_an_arm_that_stopped_is_an_answer(cli, network, monkeypatch):
    reason = "no command in time for 20 ms"
    monkeypatch.setattr(remote_arm.RemoteArm, "cast", lambda *_, **__: stopped_outcome(reason, 0.3))
    result = cli(*CAST, "--robot", URL)
    assert (result.code, result.err) == (1, "")
    assert f"cup 0.6000, 0.0000: the arm stopped: {reason}" in result.out
    record = json.loads(cli(*CAST, "--robot", URL, "--json").out)
    assert (record["status"], record["stop_reason"], record["landing"]) == ("stopped", reason, [None, None])


class TellingArm:
    """Stands in for an arm: one cast is asked for, of which it has something to tell; the next one has just begun."""

    n_casts = 0

    def __init__(self, bus, scenario, belief, *, is_real_time, on_refusal, on_outcome):
        self.tell_refusal, self.tell_outcome, self.safety = on_refusal, on_outcome, SimpleNamespace(refused=Counter())

    def refuse(self, ms):
        self.safety.refused["stale"] += 1
        self.tell_refusal(Refusal("stale", f"its torque would be {ms} ms late; 4 ms at most"))

    def serve(self, casts):
        for ms in (8, 9, 10):
            self.refuse(ms)
        service = {"refused": {"stale": 3}, "n_ticks": 500, "n_missed": 2, "worst_lateness": 0.0031}
        outcome = stopped_outcome("no command in time for 20 ms", 0.3)
        self.tell_outcome(StageRequest("1", "", wc.Cast(0.2, 0.8, 0.0), (0.6, 0.0)), outcome, service)
        self.refuse(11)  # of the cast that is over
        self.safety.refused.clear()
        self.refuse(12)


def test_the_arm_says_where_it_listens_what_it_refuses_and_what_becomes_of_casts(cli, network, monkeypatch):
    monkeypatch.setattr("wam_cast.wire.simulated_arm.SimulatedArm", TellingArm)
    result = cli("robot", "--real-time", "--casts", "1")
    assert result.code == 0
    assert result.out.splitlines() == [
        f"listening at {URL}, in real time",
        "stop with Ctrl-C",
        "cast 1: cup 0.6000, 0.0000: stopped; no command in time for 20 ms; refused: 3 stale; "
        "2 of 500 deadlines missed, by 3.1 ms at most",
    ]
    # Of each kind the first in each cast.
    lines = [f"refused: stale: its torque would be {ms} ms late; 4 ms at most" for ms in (8, 12)]
    assert result.err.splitlines() == lines
    first, second = map(json.loads, cli("robot", "--json").out.splitlines())
    assert first == {"url": bus.DEFAULT_URL, "mode": "lock step", "period": 0.002}
    assert second["status"] == Status.STOPPED
    assert second["refused"] == {"stale": 3}
    assert second["cast"]["speed"] == 0.8
