"""What tests of several layers share."""

import gc
import json
import math
import os
import pickle
import resource
import shutil
import signal
import subprocess
import sys
from concurrent.futures import Executor, Future
from contextlib import contextmanager
from pathlib import Path
from types import SimpleNamespace

# Before NumPy is loaded, here and in the processes that tests start: the threads of BLAS would wait for each other longer than they
# work, most of all where pytest uses the other cores too.
os.environ.update(OMP_NUM_THREADS="1", OPENBLAS_NUM_THREADS="1")
# What one process has compiled the others need not: Python takes seconds for what a process imports, XLA half a minute for the
# batched engine.
os.environ.pop("PYTHONDONTWRITEBYTECODE", None)
os.environ.setdefault("JAX_COMPILATION_CACHE_DIR", str(Path(__file__).parents[1] / ".pytest_cache" / "jax"))

import hypothesis
import numpy as np
import psutil
import pytest
from filelock import FileLock

from wam_cast.arm.arm_model import arm_model
from wam_cast.cast import Cast
from wam_cast.errors import InputError, MachineError
from wam_cast.scenario import Arm

sys.dont_write_bytecode = False  # what the variable has set here

# Where the tests themselves run in the background, SIGINT is ignored, and would be by every process that they start.
if signal.getsignal(signal.SIGINT) is signal.SIG_IGN:
    signal.signal(signal.SIGINT, signal.default_int_handler)

BROWSERS = ("chromium", "chromium-browser", "google-chrome")

SOFTWARE_GRAPHICS = ("--use-gl=angle", "--use-angle=swiftshader", "--enable-unsafe-swiftshader")
"""WebGL without a graphics card."""

NOTEBOOKS = Path(__file__).parents[1] / "notebooks"

LONGEST_LINE = 1000
"""Letters of an error."""

LONGEST_ANSWER = 120
"""Seconds, on a machine that does other work too."""

MOST_MEMORY = 1_000_000_000
"""Bytes that a test of generated inputs may add."""

HEALTH = hypothesis.HealthCheck
CHECKS = [HEALTH.too_slow, HEALTH.function_scoped_fixture, HEALTH.data_too_large, HEALTH.filter_too_much]
ALWAYS = {"deadline": None, "database": None, "suppress_health_check": CHECKS, "print_blob": False}
hypothesis.settings.register_profile("quick", max_examples=30, derandomize=True, **ALWAYS)
hypothesis.settings.register_profile("thorough", max_examples=1000, **ALWAYS)
hypothesis.settings.load_profile(os.environ.get("HYPOTHESIS_PROFILE", "quick"))


def pytest_collection_finish():
    """Let the garbage collector forget what is loaded by now: to look through it again and again takes a tenth of the time."""
    gc.collect()
    gc.freeze()


WORK = """
import os
import signal
import time
from pathlib import Path

def die_twice(row):
    for time in range(2):
        try:
            Path(__file__).with_name(f"row {row} died {time}").touch(exist_ok=False)
        except FileExistsError:
            continue
        os.kill(os.getpid(), signal.SIGKILL)

def process(row):
    return os.getpid()

def process_or_death(row):
    if row < 0:
        die_twice(row)
    return os.getpid()

def death(row):
    os.kill(os.getpid(), signal.SIGKILL)

def sleep(row):
    time.sleep(row)

class Loads:
    n = 0

    def __reduce__(self):
        return load, ()

    def __call__(self, row):
        return Loads.n

def load():
    Loads.n += 1
    return Loads()

def square(row):
    if row in (3, 11):
        die_twice(row)
    if row == 100:
        raise ZeroDivisionError("row 100")
    return row * row

def dying_row(scenario, seed, row):
    if row == 1:
        die_twice(row)
    return {"cast": row, "status": "landed"}

def dead_row(scenario, seed, row):
    if row == 60:
        os.kill(os.getpid(), signal.SIGKILL)
    return {"cast": row, "status": "landed"}
"""
"""What worker processes are given to do."""


class InlineExecutor(Executor):
    """Does the work at once: processes would take longer to start than a few casts."""

    def submit(self, fn, /, *args):
        future = Future()
        future.set_result(fn(*args))
        return future


class PicklingExecutor(InlineExecutor):
    """Does so with a copy of what it is given, made as for another process."""

    def submit(self, fn, /, *args):
        return super().submit(pickle.loads(pickle.dumps(fn)), *args)


@pytest.fixture
def inline_executor():
    return InlineExecutor()


@pytest.fixture
def pickling_executor():
    return PicklingExecutor()


@pytest.fixture
def helper(tmp_path, monkeypatch):
    """A module that worker processes can import."""
    (tmp_path / "worker_test_helper.py").write_text(WORK)
    monkeypatch.syspath_prepend(tmp_path)
    import worker_test_helper

    yield worker_test_helper
    del sys.modules["worker_test_helper"]


@pytest.fixture(scope="session")
def answered():
    """Return a context manager for what takes a generated input: it works or raises a typed error of one line, soon."""

    def too_long(*_):
        raise AssertionError(f"no answer within {LONGEST_ANSWER} s")

    @contextmanager
    def soon():
        previous = signal.signal(signal.SIGALRM, too_long)
        signal.alarm(LONGEST_ANSWER)
        try:
            yield
            hypothesis.event("it works")
        except (InputError, MachineError) as error:
            hypothesis.event("it is refused")
            assert str(error).isprintable()
            assert len(str(error)) <= LONGEST_LINE
        finally:
            signal.alarm(0)
            signal.signal(signal.SIGALRM, previous)

    return soon


@pytest.fixture
def little_memory():
    """Fail if a test takes much memory, even for a moment."""
    own, before = psutil.Process().memory_info().rss, resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    yield
    peak = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    unit = 1 if sys.platform == "darwin" else 1024  # bytes
    assert peak == before or peak * unit - own < MOST_MEMORY


@pytest.fixture(scope="session")
def lively_cup():
    """Return the part of a scenario that makes a ball bounce in its cup; the reference cup hardly lets it."""
    return {"restitution": 0.7}


@pytest.fixture
def floor_without_physics(monkeypatch):
    """Map the floor in this process: plans are off by 1 mm, and balls come down 3 mm beyond the cup's axis and 2 mm to its left.

    With noise, up to a millimetre more beyond it. At the lowest bearing they never come down; elsewhere they are caught if the
    cup is nearer than 0.9 m. Returns what was planned and what was cast.
    """
    # Most tests need none of what these import.
    from wam_cast.experiments import floor_map, trials
    from wam_cast.planning.landing_distribution import LandingStd
    from wam_cast.planning.plan import Plan
    from wam_cast.simulation.outcome import Status

    planned, cast = [], []

    def plan(model, cup, method="program", solver=None):
        planned.append((cup, method, solver))
        return Plan(
            cup=cup,
            cast=Cast(0.3, 0.5, 0.1, bearing=0.02),
            predicted_landing=np.array([cup[0] - 0.001, 0.0]),
            predicted_miss=0.001,
            predicted_std=LandingStd(0.004, 0.003),
            predicted_entry_angle=0.1,
            predicted_entry_speed=2.0,
            predicted_slack=0.02,
            predicted_peak_torque_utilization=0.5,
            predicted_peak_velocity_utilization=0.5,
            rim_clear_probability=1.0 - 0.5 * cup[0],
            is_feasible=cup[0] < 0.9,
            method=method,
            n_evaluations=1,
            n_solutions=1,
            reason="it was told so",
            searches=(),
        )

    def simulate(scenario, one, cup, *, noise_seed):
        cast.append((one, cup, noise_seed))
        radius = math.hypot(*cup)
        outward = np.array(cup) / radius
        noise = 0.001 * np.random.default_rng(noise_seed).random() if scenario.noise.is_on else 0.0
        landing = cup + (0.003 + noise) * outward + 0.002 * np.array([-outward[1], outward[0]])
        status = Status.CAUGHT if radius < 0.9 else Status.LONG
        if one.bearing < arm_model(Arm()).bearing_limits[0] + 0.05:
            landing, status = np.full(2, np.nan), Status.NEVER_CROSSED
        return SimpleNamespace(
            status=status,
            is_caught=status is Status.CAUGHT,
            landing=landing,
            landing_along=radius + 0.003 + noise,
            landing_across=0.002,
            miss=float(np.linalg.norm(landing - cup)),
            entry_angle=0.1,
            is_slack=True,
            slack=0.02,
            peak_torque_utilization=np.full(7, 0.5),
            peak_velocity_utilization=np.full(7, 0.5),
            limits_hit=(),
        )

    def inline(function, rows, *_):
        yield from map(function, rows)

    monkeypatch.setattr(floor_map, "plan_cast", plan)
    monkeypatch.setattr(trials, "simulate_cast", simulate)
    monkeypatch.setattr(trials, "run_rows", inline)
    return SimpleNamespace(planned=planned, cast=cast)


@pytest.fixture(scope="session")
def robots_by_formula():
    """Return what is believed of robots that are off the reference by an affine function of a cast, and `landing(cast)` of one."""
    # Most tests need none of what these import.
    from wam_cast.adaptation.adaptive_model import AdaptiveModel
    from wam_cast.adaptation.priors.feature_priors import Affine
    from wam_cast.casting_plane import from_casting_plane
    from wam_cast.learning.reference import reference_model
    from wam_cast.scenario import Scenario

    def landing(cast):
        along, across = reference_model().predict(cast.to_array()[np.newaxis])[0, :2]
        off = 0.05 + 0.2 * (cast.distance - 0.2) - 0.05 * (cast.speed - 0.5), 0.004 - 0.01 * cast.wait
        return from_casting_plane(along + off[0], across + off[1], cast.bearing)

    return SimpleNamespace(model=AdaptiveModel(reference_model(), Affine(Scenario(), scale=4.0)), landing=landing)


@pytest.fixture
def robot_by_formula(monkeypatch, robots_by_formula):
    """Let simulated robots land where a formula says, with 1 mm of noise, and be caught within 15 mm; return the casts made."""
    from wam_cast.adaptation import robot
    from wam_cast.simulation.outcome import Status

    made = []

    def simulate(truth, cast, cup, *, belief, noise_seed):
        made.append(cast)
        landing = robots_by_formula.landing(cast) + 0.001 * np.random.default_rng(noise_seed).standard_normal(2)
        is_caught = math.dist(landing, cup) < 0.015
        status = Status.CAUGHT if is_caught else Status.LONG
        return SimpleNamespace(landing=landing, is_caught=is_caught, status=status, limits_hit=())

    monkeypatch.setattr(robot, "simulate_cast", simulate)
    return made


def ours_in(folder):
    """Return the project's notebooks in a folder, by name: those that git knows, or all where there is no git."""
    listed = subprocess.run(["git", "ls-files", "*.ipynb"], cwd=folder, capture_output=True, text=True, check=False)
    known = listed.stdout.split() if listed.returncode == 0 and listed.stdout else None
    return {path.stem: path for path in sorted(folder.glob("*.ipynb")) if known is None or path.name in known}


@pytest.fixture(scope="session")
def notebook_paths():
    return ours_in(NOTEBOOKS)


@pytest.fixture(scope="session")
def exercise_paths():
    return ours_in(NOTEBOOKS / "exercises")


@pytest.fixture(scope="session")
def committed():
    """Return a function that gives a notebook's text as it is committed, or about to be; a reader may have run the file in place.

    Without git it is the file's, without what running it leaves there.
    """

    def text_of(path):
        command = ["git", "show", f":./{path.name}"]
        shown = subprocess.run(command, cwd=path.parent, capture_output=True, text=True, encoding="utf-8", check=False)
        return shown.stdout if shown.returncode == 0 else not_run(path.read_text(encoding="utf-8"))

    return text_of


def not_run(text):
    """Return a notebook's text without outputs, counts and metadata, as it would be stored."""
    notebook = json.loads(text)
    notebook["metadata"] = {
        "kernelspec": {"display_name": "Python 3", "language": "python", "name": "python3"},
        "language_info": {"name": "python"},
    }
    for cell in notebook["cells"]:
        cell["metadata"] = {key: cell["metadata"][key] for key in ("tags",) if key in cell["metadata"]}
        if cell["cell_type"] == "code":
            cell |= {"outputs": [], "execution_count": None}
    return json.dumps(notebook, indent=1, ensure_ascii=False) + "\n"


@pytest.fixture(scope="session")
def browser():
    """Return a headless Chromium, driven by Playwright; without one the test is skipped."""
    executable = next(filter(None, map(shutil.which, BROWSERS)), None)
    if executable is None:
        pytest.skip(f"no browser: none of {', '.join(BROWSERS)} is on the PATH (Debian: apt-get install chromium)")
    # Few tests need it, and it starts a process.
    from playwright.sync_api import sync_playwright

    with sync_playwright() as playwright:
        # Containers often forbid the sandbox; the pages are our own.
        options = ["--no-sandbox", "--disable-background-networking", *SOFTWARE_GRAPHICS]
        chromium = playwright.chromium.launch(executable_path=executable, args=options)
        yield chromium
        chromium.close()


@pytest.fixture(scope="session")
def once(tmp_path_factory):
    """Return a function that makes what has a name, in the first process of pytest that asks; the others read what it made."""
    own = tmp_path_factory.getbasetemp()
    folder = own.parent if "PYTEST_XDIST_WORKER" in os.environ else own

    def read_or_make(name, make):
        path = folder / f"{name}.pickle"
        with FileLock(folder / f"{name}.lock"):
            if not path.exists():
                path.write_bytes(pickle.dumps(make()))
        return pickle.loads(path.read_bytes())

    return read_or_make


@pytest.fixture(scope="session")
def simulator():
    """Return the reference scenario's simulator; outcomes do not depend on who used it before."""
    # Most tests need none of what this imports.
    from wam_cast.scenario import Scenario
    from wam_cast.simulation.simulator import CastSimulator

    return CastSimulator(Scenario())


@pytest.fixture(scope="session")
def limp():
    """Return the class of a controller that is told the cast alone, and lets the arm hang."""

    from pydrake.systems.framework import LeafSystem

    class Limp(LeafSystem):
        def __init__(self, _scenario=None):
            super().__init__()
            self.DeclareVectorInputPort("arm_state", 14)
            for name, size in (("actuation", 7), ("hand", 6), ("hand_desired", 6), ("stage", 1)):
                self.DeclareVectorOutputPort(name, size, lambda context, output: output.SetZero())

        def set_cast(self, context, cast):
            pass

        def hand_desired(self, time, motion):
            return np.zeros(3), np.zeros(3)

    return Limp
