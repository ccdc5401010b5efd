"""The experiment without physics: casts land where a closed form says, and nothing leaves this process."""

import math
from contextlib import contextmanager

import numpy as np
import pytest

import wam_cast as wc
from wam_cast.cast import Cast
from wam_cast.experiments import trials
from wam_cast.experiments.paper import learning_curves, settings
from wam_cast.experiments.paper import report_figures as figures
from wam_cast.experiments.paper import reproduce as run
from wam_cast.experiments.paper.report_figures import CAPTIONS
from wam_cast.generation.sampling import sample_cast
from wam_cast.learning import dataset
from wam_cast.simulation.outcome import Outcome, Status

SLACK = 0.05
"""Of the string from the landing on [m], whatever the cast."""


def landing(scenario, cast, noise_seed):
    """Return where a cast lands [m]: smooth in its parameters, and off by 5 mm if the scenario is noisy."""
    clean = 0.2 + cast.distance + 0.4 * cast.speed + 0.02 * math.sin(6 * cast.wait)
    if not scenario.noise.is_on:
        return clean
    return clean + 0.005 * float(np.random.default_rng(noise_seed).standard_normal())


def inline(function, rows, *_):
    """Do as `run_rows` does, in this process."""
    for row in rows:
        yield function(row)


def fake_row(scenario, seed, row):
    cast = sample_cast(scenario, seed, row)
    values = dict.fromkeys(dataset.SCHEMA.names, 0.0)
    parameters = {"distance": cast.distance, "speed": cast.speed, "wait": cast.wait}
    along = {"landing_along": landing(scenario, cast, 10_000 + row)}
    good = {
        "status": "landed",
        "is_slack": True,
        "slack": SLACK,
        "peak_torque_utilization": 0.5,
        "peak_velocity_utilization": 0.5,
    }
    return values | parameters | along | good | {"cast": row}


def fake_outcome(scenario, cast: Cast, cup=None, *, noise_seed=0):
    """Return a cast that is caught if it lands within 1 cm of the cup's middle."""
    along = landing(scenario, cast, noise_seed)
    miss = abs(along - math.hypot(*cup))
    short = Status.SHORT if along < math.hypot(*cup) else Status.LONG
    nothing = np.zeros(7)
    return Outcome(
        status=Status.CAUGHT if miss < 0.01 else short,
        landing=np.array([along, 0.0]),
        landing_along=along,
        landing_across=0.0,
        crossing_time=1.0,
        entry_velocity=np.array([0.5, 0.0, -2.0]),
        entry_angle=0.24,
        is_slack=True,
        slack=SLACK,
        miss=miss,
        peak_torque_utilization=nothing,
        peak_velocity_utilization=nothing,
        peak_tracking_error=0.0,
        limits_hit=(),
        end_time=2.0,
    )


@contextmanager
def without_physics():
    """Replace what simulates and what starts processes, and make runs small."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(dataset, "simulate_row", fake_row)
        patch.setattr(trials, "simulate_cast", fake_outcome)
        for module in (dataset, trials, learning_curves, figures):
            patch.setattr(module, "run_rows", inline)
        patch.setattr(learning_curves, "SIZES", (25,))
        patch.setattr(settings, "QUICK", {"n_casts": 85, "n_cups": 6, "n_repeats": 1})
        yield patch


@pytest.fixture(scope="session", name="without_physics")
def context_without_physics():
    """Return the context manager, for what several tests share."""
    return without_physics


@pytest.fixture
def no_physics():
    """Work without physics and without processes, on small runs."""
    with without_physics():
        yield


@pytest.fixture(scope="session")
def finished(tmp_path_factory):
    """Return the findings of a run without physics, and its folder; there is no report yet."""
    folder = tmp_path_factory.mktemp("finished")
    with without_physics() as patch:
        patch.setattr(run, "write_report", lambda *_: None)
        patch.setattr(run, "draw_figures", lambda *_: iter(CAPTIONS))
        return run.reproduce(wc.Scenario(), folder, quick=True), folder


@pytest.fixture
def casts(finished):
    """Return the casts of the finished run, 65 of them to train, 15 to validate and 5 to test with."""
    return wc.CastDataset.load(finished[1] / "casts")


@pytest.fixture
def noisy_casts(finished):
    """Return the same casts with noise."""
    return wc.CastDataset.load(finished[1] / "noisy_casts")
