"""Faults of the machine and of other programs, drawn from fixed seeds; how many is an option, and what came of them is counted.

pytest tests/faults --faults 60    # 60 kills and 60 corruptions; a few by default
"""

import json
import os
import signal
import subprocess
import sys
from collections import Counter
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pyarrow.parquet as pq
import pytest
from PIL import Image

import wam_cast

ENVIRONMENT = {**os.environ, "PYTHONPATH": str(Path(wam_cast.__file__).parents[1])}
SMALL_COMMAND = Path(__file__).with_name("small_command.py")

FEW = 4
"""Kills, and corruptions."""


def pytest_addoption(parser):
    parser.addoption("--faults", type=int, default=FEW, metavar="N", help="kills and corruptions in tests/faults")


def pytest_terminal_summary(terminalreporter):
    counts = Counter(
        each
        for reports in terminalreporter.stats.values()
        for report in reports
        if getattr(report, "when", None) == "call"
        for each in report.user_properties
        if each[0] in ("tried", "survived")
    )
    kinds = sorted({kind for _, kind in counts})
    if kinds:
        terminalreporter.section("faults: tried, survived, lost")
        for kind in [*kinds, "all"]:
            tried, survived = (
                sum(n for (what, which), n in counts.items() if what == name and kind in (which, "all"))
                for name in ("tried", "survived")
            )
            terminalreporter.write_line(f"{kind:40} {tried:5d} {survived:5d} {tried - survived:5d}")


@pytest.fixture
def n_faults(request):
    # Without a default the option is there only if this folder is named on pytest's command line.
    return request.config.getoption("--faults", FEW)


@pytest.fixture
def fault(record_property):
    """Return a context manager for what follows a fault of some kind: it is survived if the context ends well."""

    @contextmanager
    def one(kind):
        record_property("tried", kind)
        yield
        record_property("survived", kind)

    return one


BY_A_CLOCK = ("fit_s", "predict_us", "wall_s", "wall_s_by_phase")


def read_json(path):
    """Return what is in a file of JSON, but for what a clock measured."""

    def without_times(values):
        return {name: value for name, value in values.items() if name not in BY_A_CLOCK}

    return json.loads(path.read_bytes(), object_hook=without_times)


def read_model(path):
    with np.load(path) as file:
        return {name: file[name].tobytes() for name in file}


def read_picture(path):
    with Image.open(path) as image:
        return image.convert("RGB").tobytes()


def read_part(path):
    pq.ParquetFile(path, page_checksum_verification=True).read()
    return path.read_bytes()


READ = {".parquet": read_part, ".json": read_json, ".model": read_model, ".png": read_picture}
NOT_COMPARED = ("phases", "wall.json", "report.md", "report.html")
"""They hold times."""


@pytest.fixture(scope="session")
def contents():
    """Return a function that reads all that a command has left, file by file; it raises if one is not whole."""

    def read(folder):
        made = [
            path
            for path in folder.rglob("*")
            if path.is_file() and path.relative_to(folder).parts[0].startswith("made")
        ]
        paths = [path for path in sorted(made) if path.name[0] != "."]
        found = {str(path.relative_to(folder)): READ.get(path.suffix, Path.read_bytes)(path) for path in paths}
        return {name: content for name, content in found.items() if not set(Path(name).parts) & set(NOT_COMPARED)}

    return read


@pytest.fixture(scope="session")
def made(tmp_path_factory):
    """Return a dataset of 120 casts without physics."""
    folder = tmp_path_factory.mktemp("made")
    command = [
        sys.executable,
        SMALL_COMMAND,
        *["generate", "--casts", "120", "--seed", "5", "--workers", "1", "--out", "casts"],
    ]
    subprocess.run(command, cwd=folder, env=ENVIRONMENT, check=True, capture_output=True)
    return folder / "casts"


@dataclass
class Ended:
    code: int
    out: str
    err: str


@pytest.fixture
def end():
    """Return a function that waits for the end of a command, and sees that it shows nothing of the program's inside."""

    def wait(process):
        out, err = process.communicate(timeout=120)
        assert "Traceback" not in err, err
        assert "Exception" not in err, err
        return Ended(process.returncode, out, err)

    return wait


@pytest.fixture
def start(tmp_path):
    """Return a function that starts a command in a folder, and returns when it has said that it is under way."""
    started = []

    def popen(words, folder=tmp_path, environment=None, **options):
        pipes = {"stdout": subprocess.PIPE, "stderr": subprocess.PIPE} | options
        command = [sys.executable, SMALL_COMMAND, *words.split()]
        options = pipes | {"env": ENVIRONMENT | (environment or {}), "start_new_session": True}
        process = subprocess.Popen(command, cwd=folder, text=True, **options)
        started.append(process)
        if process.stdout is not None:
            assert process.stdout.readline() == "ready\n", process.communicate()
        return process

    yield popen
    for process in started:
        if process.poll() is None:
            os.killpg(process.pid, signal.SIGKILL)
        process.communicate()
