"""A callback that raises ends the work by what it raised, and leaves no process behind."""

import multiprocessing
import sys
from pathlib import Path

import pytest

from wam_cast.experiments import trials
from wam_cast.experiments.floor_map import MapSize, map_floor
from wam_cast.experiments.paper.reproduce import reproduce
from wam_cast.learning import dataset
from wam_cast.learning.reference import reference_model
from wam_cast.parallel.workers import Workers
from wam_cast.scenario import Scenario


class MyError(Exception):
    pass


def after(n_done):
    """Return a callback that raises when so much is done."""

    def tell(*progress):
        if progress[-2] >= n_done and progress[0] != "planning":
            raise MyError

    return tell


@pytest.mark.parametrize("n_done", [0, pytest.param(1, marks=pytest.mark.slow), 3])
def test_of_a_dataset(helper, monkeypatch, n_done):
    monkeypatch.setattr(dataset, "simulate_row", helper.dead_row)
    with pytest.raises(MyError):
        dataset.generate_dataset(Scenario(), 20, n_workers=2, on_progress=after(n_done))
    assert multiprocessing.active_children() == []


@pytest.mark.slow
def test_of_a_dataset_by_workers_that_are_kept(helper, monkeypatch):
    monkeypatch.setattr(dataset, "simulate_row", helper.dead_row)
    with Workers(2) as workers:
        with pytest.raises(MyError):
            dataset.generate_dataset(Scenario(), 20, executor=workers, on_progress=after(1))
        assert len(dataset.generate_dataset(Scenario(), 20, executor=workers)) == 20
    assert multiprocessing.active_children() == []


@pytest.fixture
def closed_forms(monkeypatch):
    """What casts without physics, in any process."""
    monkeypatch.syspath_prepend(Path(__file__).parents[1] / "faults")
    import closed_forms

    yield closed_forms
    del sys.modules["closed_forms"]


@pytest.mark.slow
def test_of_a_map(closed_forms, monkeypatch):
    monkeypatch.setattr(trials, "_execute", closed_forms.execute)
    with pytest.raises(MyError):
        map_floor(reference_model(), MapSize(2, 2), n_workers=2, on_progress=after(1))
    assert multiprocessing.active_children() == []


@pytest.mark.slow
def test_of_the_experiment(tmp_path, closed_forms, monkeypatch):
    monkeypatch.setattr(dataset, "simulate_row", closed_forms.row)
    with pytest.raises(MyError):
        reproduce(Scenario(), tmp_path, quick=True, n_workers=2, on_progress=after(1))
    assert multiprocessing.active_children() == []
