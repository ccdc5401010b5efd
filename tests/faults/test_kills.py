"""Commands that are ended at random moments, and started again until they are done, leave what undisturbed ones leave."""

import os
import random
import signal
import time
from contextlib import ExitStack

import psutil
import pytest

pytestmark = [pytest.mark.slow, pytest.mark.skipif(os.name != "posix", reason="signals of POSIX")]

COMMANDS = {
    "generate": "generate --casts 320 --seed 3 --workers 2 --out made",
    "reproduce": "reproduce --quick --workers 1 --out made",
    "map": "map --radii 2 --bearings 20 --planner gradient --workers 1 --out made.png --json",
    "learn": "learn --robot casts/scenario.yaml --cup 0.75 --cup 0.5,0.3 --casts 10 --out made --json",
    "fit": "fit casts --out made.model",
}
CODES = {"parent killed": -signal.SIGKILL, "worker killed": 0, "interrupted": 130, "terminated": -signal.SIGTERM}
"""With which a command ends that was disturbed so."""


def disturbed(process, kind, moment):
    """End what is to be ended, once the moment has come; return whether it was there before the command had ended."""
    while process.poll() is None:
        time.sleep(0.01)
        if time.monotonic() < moment:
            continue
        others = psutil.Process(process.pid).children(recursive=True)
        if kind == "worker killed":
            workers = [each for each in others if any("spawn_main" in word for word in each.cmdline())]
            if workers:
                workers[-1].kill()
                return True
            continue
        if kind == "interrupted":
            os.killpg(process.pid, signal.SIGINT)  # as a terminal does
        else:
            process.send_signal(signal.SIGKILL if kind == "parent killed" else signal.SIGTERM)
        process.wait(60)
        assert psutil.wait_procs(others, timeout=60)[1] == []
        return True
    return False


@pytest.fixture(params=COMMANDS)
def undisturbed(request, start, end, made, tmp_path):
    """Return a command's name, a folder in which it was done, what it printed, and how long it took [s]."""
    command = COMMANDS[request.param]
    (tmp_path / "casts").symlink_to(made)
    folder = new_folder(tmp_path)
    process, began = start(command, folder), time.monotonic()
    ended = end(process)
    assert ended.code == 0
    return request.param, folder, ended.out, time.monotonic() - began


def new_folder(tmp_path):
    folder = tmp_path / str(len(list(tmp_path.iterdir())))
    folder.mkdir()
    (folder / "casts").symlink_to(tmp_path / "casts")
    return folder


def test_started_again_until_done_it_finds_the_same(undisturbed, start, end, contents, fault, n_faults, tmp_path):
    name, expected, printed, seconds = undisturbed
    rng, own = random.Random(name), list(COMMANDS).index(name)
    kinds = [kind for kind in CODES if name not in ("learn", "fit") or kind != "worker killed"]
    todo = [kinds[(own + i) % len(kinds)] for i, _ in enumerate(range(own, n_faults, len(COMMANDS)))]
    while todo:
        folder = new_folder(tmp_path)
        process = start(COMMANDS[name], folder)
        with ExitStack() as faults:
            while todo and disturbed(process, todo[0], time.monotonic() + rng.uniform(0, seconds)):
                faults.enter_context(fault(f"{name}: {todo[0]}"))
                kind = todo.pop(0)
                if kind != "worker killed":
                    ended = end(process)
                    if not ended.out:  # else it was done a moment before
                        assert ended.code == CODES[kind]
                        assert ended.err.endswith("interrupted\n") is (kind == "interrupted")
                    contents(folder)
                    process = start(COMMANDS[name], folder)
            ended = end(process)
            assert ended.code == 0
            assert contents(folder) == contents(expected)
            assert {path.name for path in folder.rglob(".*")} <= {".lock"}
            assert ended.out == printed or name not in ("map", "learn")
