"""Full disks, folders that may only be read, two writers: one line says so, nothing half-written stays, and then it works."""

import ctypes
import itertools
import os
import random
import re
import resource
import subprocess
import time
from contextlib import ExitStack, contextmanager

import pytest

import wam_cast as wc

pytestmark = [pytest.mark.slow, pytest.mark.skipif(os.name != "posix", reason="limits of POSIX")]

COMMANDS = {
    "generate": "generate --casts 120 --seed 5 --workers 1 --out made",
    "fit": "fit casts --out made.model",
    "learn": "learn --robot casts/scenario.yaml --cup 0.75 --casts 4 --out made",
}
CAP_DAC_OVERRIDE, PR_CAPBSET_DROP = 1, 24


def without_privilege():
    """Let permissions count for the administrator too, where tests run as that."""
    if os.geteuid() == 0:
        ctypes.CDLL(None).prctl(PR_CAPBSET_DROP, CAP_DAC_OVERRIDE, 0, 0, 0)


def no_larger_files_than(n_bytes):
    """Return options of a process that cannot write any; of a compiled module Python would leave the first bytes."""
    limit = resource.RLIMIT_FSIZE, (n_bytes, n_bytes)
    return {"environment": {"PYTHONDONTWRITEBYTECODE": "1"}, "preexec_fn": lambda: resource.setrlimit(*limit)}


def refused(ended, folder):
    """Say that a command ended in one line, with nothing but whole files left."""
    *_, line = ended.err.splitlines()
    assert ended.code == 2
    assert line.startswith("error: ")
    assert "cannot" in line
    assert len(line) < 500
    assert not [path for path in folder.rglob("*") if path.suffix == ".tmp"]


@pytest.fixture
def new_folder(made, tmp_path):
    """Return a function that gives a new folder with a dataset to fit to."""
    numbers = itertools.count()

    def new():
        folder = tmp_path / f"folder{next(numbers)}"
        folder.mkdir()
        (folder / "casts").symlink_to(made)
        return folder

    return new


@pytest.mark.parametrize("name", COMMANDS)
def test_where_nothing_may_be_written_then_little_and_then_all(name, start, end, contents, fault, new_folder, n_faults):
    rng = random.Random(name)
    for _ in range(max(1, n_faults // 10)):
        limit, folder = rng.randrange(100, 4000), new_folder()
        with ExitStack() as faults:
            with only_to_be_read(folder) as holds:
                if holds:
                    faults.enter_context(fault(f"{name}: folder may only be read"))
                    refused(end(start(COMMANDS[name], folder, preexec_fn=without_privilege)), folder)
                    assert [path.name for path in folder.iterdir()] == ["casts"]
            # What a full disk says of itself, the system says of a file that is to grow beyond a limit, on any file system.
            faults.enter_context(fault(f"{name}: files may not grow"))
            refused(end(start(COMMANDS[name], folder, **no_larger_files_than(limit))), folder)
            contents(folder)
            assert end(start(COMMANDS[name], folder)).code == 0
            assert contents(folder)


@contextmanager
def only_to_be_read(folder):
    """Let nobody write into a folder, and give whether that holds: not for processes that cannot lay down their privilege."""
    folder.chmod(0o555)
    try:
        write = ["touch", folder / "file"]
        yield subprocess.run(write, preexec_fn=without_privilege, capture_output=True).returncode != 0
    finally:
        folder.chmod(0o755)
        (folder / "file").unlink(missing_ok=True)


@pytest.fixture
def small_disk(tmp_path):
    """Return a file system of its own with little room, if this process may mount one."""
    disk = tmp_path / "disk"
    disk.mkdir()
    mount = ["mount", "-t", "tmpfs", "-o", "size=48k", "tmpfs", disk]
    try:
        subprocess.run(mount, check=True, capture_output=True)
    except (OSError, subprocess.CalledProcessError):
        pytest.skip("no file system may be mounted here")
    yield disk
    subprocess.run(["umount", disk], check=True)


def test_on_a_full_disk(start, end, contents, fault, small_disk):
    with fault("generate: disk full"):
        command = COMMANDS["generate"].replace("120", "320")
        refused(end(start(command, small_disk)), small_disk)
        kept = contents(small_disk)
        assert any(name.endswith(".parquet") for name in kept)
        subprocess.run(["mount", "-o", "remount,size=4m", small_disk], check=True)
        assert end(start(command, small_disk)).code == 0
        found = contents(small_disk)
        assert {name: found[name] for name in kept} == kept


def test_of_two_writers_one_works_and_one_is_told(start, end, fault, tmp_path, made, n_faults):
    rng = random.Random(0)
    for attempt in range(max(1, n_faults // 10)):
        seeds = ((5, 6), (5, 5))[attempt % 2]
        words = f"generate --casts 120 --workers 1 --out {attempt} --seed"
        with fault("generate: two writers"):
            first = start(f"{words} {seeds[0]}")
            time.sleep(rng.uniform(0, 0.5))
            ended = [end(process) for process in (first, start(f"{words} {seeds[1]}"))]
            assert sorted(one.code for one in ended) == [0, 2] or (
                seeds == (5, 5) and {one.code for one in ended} == {0}
            )
            for one in ended:
                assert one.code == 0 or re.search("another run is at work|another seed", one.err)
            winner = seeds[[one.code for one in ended].index(0)]
            data = wc.CastDataset.load(tmp_path / str(attempt))
            assert (data.seed, len(data)) == (winner, 120)
            assert winner == 6 or data.frame.equals(wc.CastDataset.load(made).frame)
