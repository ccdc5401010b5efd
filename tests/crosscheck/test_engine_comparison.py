"""What is made of several engines' casts; the casts themselves are tested with their engines."""

import math
import sys
from types import SimpleNamespace

import numpy as np
import pandas as pd
import pytest

from wam_cast.crosscheck import engine_comparison
from wam_cast.crosscheck.engine_comparison import (
    BATCH,
    DRAKE,
    DRAKE_CONVERGED,
    MUJOCO,
    MUJOCO_CONVERGED,
    EngineComparison,
    batched_engine,
    compare_engines,
    percentiles,
)
from wam_cast.errors import InputError
from wam_cast.scenario import Scenario

COLUMNS = ("landing_across", "entry_speed", "entry_angle", "peak_torque_utilization", "peak_velocity_utilization")


def frame(off=(0.0, 0.0, 0.0), statuses=("landed",) * 3):
    """Return three casts that land at 0.7 m, some farther by so much [m]."""
    own = {"landing_along": 0.7 + np.array(off), "status": list(statuses), "ball_path": np.abs(off)}
    return pd.DataFrame({**own, **{name: np.full(3, 0.1) for name in COLUMNS}})


def comparison(converged, **others):
    frames = {DRAKE: frame(), DRAKE_CONVERGED: converged, MUJOCO_CONVERGED: frame(), **others}
    return EngineComparison(Scenario(), 0, frames)


@pytest.mark.parametrize(
    ("off", "statuses", "agrees"),
    [
        ((0, 1e-6, -2e-6), ("landed",) * 3, True),
        ((0, 0, 9e-5), ("landed",) * 3, True),
        ((0, 0, 2e-4), ("landed",) * 3, False),
        ((2e-5, -2e-5, 2e-5), ("landed",) * 3, False),
        ((0, 0, 0), ("landed", "landed", "limit_hit"), False),
        ((0, 0, 0), ("never_crossed",) * 3, False),
    ],
)
def test_converged_landings_decide(off, statuses, agrees):
    assert comparison(frame(off, statuses)).agrees == agrees
    assert comparison(frame(), **{BATCH: frame(off, statuses)}).agrees == agrees


def test_casts_that_none_lands_are_no_agreement():
    nowhere = frame(statuses=("never_crossed",) * 3)
    frames = dict.fromkeys((DRAKE, DRAKE_CONVERGED, MUJOCO_CONVERGED), nowhere)
    assert not EngineComparison(Scenario(), 0, frames).agrees


def test_differences_are_those_of_casts_that_both_land():
    compared = comparison(frame((1e-3, -2e-3, 5e-3), ("landed", "landed", "limit_hit")))
    off = compared.differences(DRAKE_CONVERGED)
    assert off["landing"].to_list() == pytest.approx([1e-3, 2e-3])
    assert not off["entry_speed"].any()
    assert compared.n_other_statuses(DRAKE_CONVERGED) == 1


def test_percentiles_of_what_there_is():
    assert percentiles(np.array([3.0, 1.0, math.nan, 2.0])) == pytest.approx(
        {"median": 2.0, "p95": 2.9, "largest": 3.0}
    )
    assert all(math.isnan(value) for value in percentiles(np.array([math.nan])).values())


def test_a_record_has_every_engine_and_cast():
    record = comparison(frame((0, 0, 2e-4)), **{BATCH: frame()}).record()
    assert not record["agrees"]
    assert list(record["engines"]) == [DRAKE, DRAKE_CONVERGED, MUJOCO_CONVERGED, BATCH]
    assert record["engines"][DRAKE_CONVERGED]["differences"]["landing"]["largest"] == pytest.approx(2e-4)
    assert [len(engine["casts"]) for engine in record["engines"].values()] == [3] * 4


def test_the_batched_engine_is_optional(monkeypatch):
    monkeypatch.setitem(sys.modules, "wam_cast.batch.engine", None)
    with pytest.raises(InputError):
        batched_engine(Scenario())
    monkeypatch.setitem(sys.modules, "wam_cast.batch.engine", SimpleNamespace(n_steps=len, simulate_batch=sum))
    with pytest.raises(TypeError):  # whether it can is asked beforehand
        batched_engine(Scenario())
    monkeypatch.setitem(sys.modules, "wam_cast.batch.engine", SimpleNamespace(n_steps=str, simulate_batch=sum))
    assert batched_engine(Scenario()) is sum


def test_what_the_batched_engine_refuses_the_others_simulate_all_the_same(monkeypatch):
    pytest.importorskip("mujoco")
    columns = frame().iloc[0].drop("ball_path").to_dict() | {"crossing_time": 0.01}
    for name in ("_drake", "_mujoco"):
        monkeypatch.setattr(engine_comparison, name, lambda _: lambda *_: (columns, np.zeros((9, 3))))
    stiff = Scenario.from_dict({"string": {"n_links": 40}, "simulation": {"max_step": 1e-6}})
    compared = compare_engines(stiff, 2)
    assert BATCH not in compared.frames
    assert "simulation.max_step = 1e-06 s" in compared.left_out
    assert compared.record()["left_out"] == compared.left_out


@pytest.mark.parametrize(("n_casts", "seed"), [(0, 0), (1.5, 0), (1, -1)])
def test_wrong_numbers_are_refused(n_casts, seed):
    with pytest.raises(InputError, match="must be an integer"):
        compare_engines(Scenario(), n_casts, seed)


def test_without_mujoco_a_line_says_how_to_install_it(monkeypatch):
    monkeypatch.setitem(sys.modules, "mujoco", None)
    with pytest.raises(InputError, match=r'pip install "wam_cast\[crosscheck\]"'):
        compare_engines(Scenario(), 1)


def test_every_engine_gets_the_same_casts_and_noise(monkeypatch):
    pytest.importorskip("mujoco")
    asked = {}

    def engine(name):
        def simulate(cast, noise_seed):
            asked.setdefault(name, []).append((cast, noise_seed))
            columns = frame().iloc[0].drop("ball_path").to_dict()
            return {**columns, "crossing_time": 0.01}, np.full((9, 3), len(asked[name]) * (name == "drake"))

        return simulate

    def batch(_, casts, noise_seeds):
        asked[BATCH] = casts, noise_seeds
        return frame().drop(columns="ball_path").iloc[: len(casts)]

    monkeypatch.setattr(engine_comparison, "_drake", lambda _: engine("drake"))
    monkeypatch.setattr(engine_comparison, "_mujoco", lambda _: engine("mujoco"))
    monkeypatch.setattr(engine_comparison, "batched_engine", lambda _: batch)
    told = []
    compared = compare_engines(Scenario(), 2, seed=5, on_progress=lambda *words: told.append(words))
    assert asked["drake"] == asked["mujoco"]
    assert asked["drake"][:2] == asked["drake"][2:]
    casts, noise_seeds = asked[BATCH]
    assert [(tuple(row), seed) for row, seed in zip(casts, noise_seeds, strict=True)] == [
        (tuple(cast.to_array()), seed) for cast, seed in asked["drake"][:2]
    ]
    assert list(compared.frames) == [DRAKE, DRAKE_CONVERGED, BATCH, MUJOCO, MUJOCO_CONVERGED]
    assert compared.frames[DRAKE_CONVERGED]["ball_path"].to_list() == pytest.approx([3**0.5, 2 * 3**0.5])
    assert told[-1] == (BATCH, 2, 2)
