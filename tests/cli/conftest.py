"""The command line, run in this process or in one of its own, in a folder of its own."""

import os
import subprocess
import sys
from dataclasses import dataclass
from pathlib import Path

import pytest

import wam_cast
from wam_cast.cli import main, model_choice, terminal
from wam_cast.generation.sampling import sample_cast
from wam_cast.learning import dataset

ROOT = Path(wam_cast.__file__).parents[1]

FAULTS = Path(__file__).parents[1] / "faults"


@dataclass
class Result:
    code: int
    out: str
    err: str


@pytest.fixture(autouse=True)
def folder(tmp_path, monkeypatch):
    """Work in a new folder, `here`, whose name needs quoting in a shell."""
    path = tmp_path / "my work"
    path.mkdir()
    monkeypatch.chdir(path)
    monkeypatch.setenv("COLUMNS", "100")
    return path


@pytest.fixture
def terminal_of(monkeypatch):
    """Return a function that gives the tables a terminal so many columns wide; rich reads COLUMNS once, where it is set."""

    def give(columns):
        settings = {"soft_wrap": True, "highlight": False, "markup": False, "emoji": False}
        monkeypatch.setattr(terminal, "out", terminal.Terminal(width=columns, **settings))

    return give


@pytest.fixture
def cli(monkeypatch, capsys):
    """Return a function that runs a command line in this process."""

    def run(*words):
        capsys.readouterr()
        monkeypatch.setattr(sys, "argv", ["wam-cast", *map(str, words)])
        with pytest.raises(SystemExit) as ended:
            main()
        return Result(ended.value.code, *capsys.readouterr())

    return run


@pytest.fixture
def start():
    """Return a function that starts a command line in a process of its own; what still runs in the end is killed."""
    started = []

    def popen(*words, program=("-m", "wam_cast"), **options):
        # Not by an import path that another installation of the package could be on.
        environment = {**os.environ, "PYTHONPATH": str(ROOT)}
        pipes = {"stdout": subprocess.PIPE, "stderr": subprocess.PIPE} | options
        command = [sys.executable, *program, *map(str, words)]
        started.append(subprocess.Popen(command, env=environment, text=True, start_new_session=True, **pipes))
        return started[-1]

    yield popen
    for process in started:
        if process.poll() is None:
            process.kill()
        process.communicate()


@pytest.fixture
def process(start):
    """Return a function that runs a command line in a process of its own, to its end."""

    def run(*words, **options):
        ended = start(*words, **options)
        out, err = ended.communicate(timeout=300)
        return Result(ended.returncode, out, err)

    return run


@pytest.fixture
def small_program():
    """Return the program, for `start` and `process`, that casts by closed forms; it says first that it is ready."""
    return [FAULTS / "small_command.py"]


@pytest.fixture
def closed_form_row(monkeypatch):
    """Return what simulates a row there."""
    monkeypatch.syspath_prepend(FAULTS)
    import closed_forms

    monkeypatch.setattr(closed_forms, "SECONDS", 0)
    yield closed_forms.row
    del sys.modules["closed_forms"]


@pytest.fixture
def without_workers(monkeypatch, inline_executor):
    """Make datasets in this process."""

    def generate(*args, executor=None, n_workers=None, **options):
        return dataset.generate_dataset(*args, executor=inline_executor, **options)

    monkeypatch.setattr(wam_cast, "generate_dataset", generate, raising=False)


@pytest.fixture
def no_physics(monkeypatch, without_workers):
    """Make datasets in this process and without physics: a cast lands where a closed form says; 60 of them train a model."""

    def row(scenario, seed, number):
        cast = sample_cast(scenario, seed, number)
        values = dict.fromkeys(dataset.SCHEMA.names, 0.0)
        landing = {"landing_along": 0.2 + cast.distance + 0.4 * cast.speed, "landing_across": 0.0}
        parameters = {"distance": cast.distance, "speed": cast.speed, "wait": cast.wait}
        good = {
            "status": "landed",
            "is_slack": True,
            "slack": 0.05,
            "peak_torque_utilization": 0.5,
            "peak_velocity_utilization": 0.5,
        }
        return values | parameters | landing | good | {"cast": number}

    monkeypatch.setattr(dataset, "simulate_row", row)
    monkeypatch.setattr(model_choice, "TRAINING_CASTS", 60)
    monkeypatch.setattr(model_choice, "require_workable", lambda *_, **__: None)


@pytest.fixture
def scenarios(folder, lively_cup):
    """Write scenario files: what differs from the reference scenario is in their names."""
    texts = {"heavy": "ball: {mass: 0.04}", "lively": f"cup: {lively_cup}", "narrow": "cup: {inner_radius: 0.0205}"}
    for name, text in texts.items():
        (folder / f"{name}.yaml").write_text(text, encoding="utf-8")
