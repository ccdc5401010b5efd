"""`generate --scheduler` on a cluster of processes, and when they fail: one line, exit code 2, finished parts kept."""

import importlib.util
import json
import os
import subprocess
import sys
import time
from pathlib import Path

import pytest

import wam_cast

pytestmark = [
    pytest.mark.slow,
    pytest.mark.skipif(
        importlib.util.find_spec("distributed") is None, reason="the extra `distributed` is not installed"
    ),
]

ROOT = Path(wam_cast.__file__).parents[1]

FAULTS = Path(__file__).parents[1] / "faults"
"""Where the closed forms are that workers cast by."""

START = "import sys; {first}; from distributed.cli.dask_{what} import main; main(sys.argv[1:])"

WITHOUT_THE_PACKAGE = "sys.modules['wam_cast'] = None"


class Cluster:
    """A scheduler, and workers that are started one by one."""

    def __init__(self, folder):
        self._folder, self._started = folder, []
        file = folder / "scheduler.json"
        self.scheduler = self._start("scheduler", "--port", "0", "--no-dashboard", "--scheduler-file", file)
        while not file.exists():
            time.sleep(0.1)
        self.address = json.loads(file.read_text())["address"]

    def _start(self, what, *words, first="pass"):
        path = os.pathsep.join(map(str, [ROOT, FAULTS, self._folder]))
        command = [sys.executable, "-c", START.format(what=what, first=first), "--host", "127.0.0.1", *map(str, words)]
        quiet = {"stdout": subprocess.DEVNULL, "stderr": subprocess.DEVNULL}
        self._started.append(
            subprocess.Popen(command, cwd=self._folder, env=os.environ | {"PYTHONPATH": path}, **quiet)
        )
        return self._started[-1]

    def worker(self, **options):
        return self._start("worker", self.address, "--nthreads", "1", "--no-nanny", "--no-dashboard", **options)

    def end(self):
        for process in self._started:
            process.kill()
            process.wait()


@pytest.fixture
def cluster(tmp_path):
    cluster = Cluster(tmp_path)
    yield cluster
    cluster.end()


def test_a_cluster_without_workers_is_waited_for_aloud(cluster, start, small_program):
    words = ("generate", "--casts", "3", "--out", "data", "--scheduler", cluster.address)
    running = start(*words, program=small_program)
    line = running.stderr.readline()
    assert line == f"waiting for workers: none has come yet; `dask worker {cluster.address}` starts one\n"
    cluster.worker()
    out, err = running.communicate(timeout=120)
    assert (running.returncode, err) == (0, "")
    assert out.startswith("ready\n3 casts in data")


def test_a_worker_that_cannot_import_the_package_is_named(cluster, process, small_program):
    cluster.worker(first=WITHOUT_THE_PACKAGE)
    words = ("generate", "--casts", "3", "--out", "data", "--scheduler", cluster.address)
    result = process(*words, program=small_program)
    assert (result.code, result.out) == (2, "ready\n")
    (line,) = result.err.splitlines()
    assert line.startswith(f"error: --scheduler {cluster.address}: the worker tcp://127.0.0.1:")
    assert "has no wam_cast that works (ModuleNotFoundError" in line
    assert "install the same there" in line


def test_workers_that_leave_are_waited_for_and_a_scheduler_that_is_killed_keeps_finished_parts(
    cluster, start, folder, small_program
):
    worker = cluster.worker()
    words = ("generate", "--casts", "1000", "--out", "data", "--scheduler", cluster.address)
    running = start(*words, program=small_program)
    while not (folder / "data" / "casts" / "part-00000.parquet").exists():
        assert running.poll() is None, running.communicate()
        time.sleep(0.1)
    worker.kill()
    line = running.stderr.readline()
    assert line.startswith("waiting for workers: all that it had have gone, and their logs say why; `dask worker"), (
        line + running.stderr.read()
    )
    cluster.scheduler.kill()
    out, err = running.communicate(timeout=120)
    assert (running.returncode, out) == (2, "ready\n")
    kept, fault = err.splitlines()
    assert "of 1000 casts were simulated; finished parts are kept in data. Go on with: wam-cast generate" in kept
    assert (
        fault
        == f"error: the Dask scheduler at {cluster.address} is gone; start it and its workers again, and then this"
    )
    assert (folder / "data" / "casts" / "part-00000.parquet").exists()


SCRIPT = """
import sys
from distributed import Client
from wam_cast.parallel.workers import run_rows
from worker_test_helper import death

with Client(sys.argv[1]) as client:
    list(run_rows(death, [5], client.get_executor()))
"""


def test_a_row_that_kills_its_worker_four_times_is_one_line(cluster, helper, tmp_path):
    for _ in range(4):
        cluster.worker()
    done = subprocess.run(
        [sys.executable, "-c", SCRIPT, cluster.address],
        env=os.environ | {"PYTHONPATH": os.pathsep.join([str(ROOT), str(tmp_path)])},
        capture_output=True,
        text=True,
        timeout=120,
        check=False,
    )
    *_, line = done.stderr.splitlines()
    assert line.startswith(
        "wam_cast.errors.MachineError: the executor ClientExecutor lost its workers (Attempted to run"
    )
    assert "on 4 different workers" in line
    assert "start again with a new one" in line
