"""`wam-cast crosscheck` as its user meets it."""

import json
import sys

import numpy as np
import pandas as pd
import pytest

from wam_cast.crosscheck import engine_comparison, verdict_comparison
from wam_cast.crosscheck.engine_comparison import DRAKE, DRAKE_CONVERGED, MUJOCO, MUJOCO_CONVERGED, EngineComparison
from wam_cast.crosscheck.verdict_comparison import Verdicts
from wam_cast.simulation.outcome import Status

COLUMNS = ("landing_across", "entry_speed", "entry_angle", "peak_torque_utilization", "peak_velocity_utilization")
VERDICTS = [
    Verdicts(0, 0.0, (0.7, 0.0), Status.CAUGHT, Status.CAUGHT, Status.CAUGHT, False),
    Verdicts(0, 0.025, (0.7, 0.02), Status.CAUGHT, Status.CAUGHT, Status.RIM_BOUNCE, True),
]


@pytest.fixture
def found(monkeypatch):
    """Return a function that says by how much converged landings are off [m]; nothing is simulated."""

    def be(off):
        def frame(by=0.0):
            own = {"landing_along": [0.7 + by, 0.8], "status": ["landed"] * 2, "ball_path": [0.0, np.nan]}
            return pd.DataFrame({**own, **{name: [0.1, 0.2] for name in COLUMNS}})

        frames = {DRAKE: frame(1e-3), DRAKE_CONVERGED: frame(off), MUJOCO: frame(), MUJOCO_CONVERGED: frame()}

        def compare(scenario, n_casts, seed, on_progress):
            on_progress(DRAKE, n_casts, n_casts)
            return EngineComparison(scenario, seed, frames, "it is not installed")

        monkeypatch.setattr(engine_comparison, "compare_engines", compare)
        monkeypatch.setattr(verdict_comparison, "compare_verdicts", lambda *_, **__: VERDICTS)

    return be


def test_a_table_tells_how_far_engines_are_apart(cli, found):
    found(0.0)
    result = cli("crosscheck", "--casts", "2", "--cups")
    assert result.code == 0
    assert "the landings of 2 casts agree between Drake and MuJoCo\n" in result.out
    assert "cast 0, 25 mm off: caught in Drake, caught in MuJoCo, rim_bounce by its own contact" in result.out
    assert "the batched engine is left out: it is not installed\n" in result.err


def test_the_answer_is_no_where_landings_differ(cli, found):
    found(2e-4)
    result = cli("crosscheck", "--casts", "2", "--json")
    assert result.code == 1
    record = json.loads(result.out)
    assert not record["agrees"]
    assert record["engines"][DRAKE]["differences"]["landing"]["largest"] == pytest.approx(1e-3)
    assert record["engines"][DRAKE]["casts"][1]["ball_path"] is None
    assert "cups" not in record


def test_json_has_the_verdicts(cli, found):
    found(0.0)
    record = json.loads(cli("crosscheck", "--cups", "--json").out)
    assert [one["is_same"] for one in record["cups"]] == [True, False]
    assert record["cups"][1]["mujoco_own"] == "rim_bounce"


def test_without_mujoco_a_line_says_how_to_install_it(cli, monkeypatch):
    monkeypatch.setitem(sys.modules, "mujoco", None)
    result = cli("crosscheck", "--casts", "1")
    assert result.code == 2
    assert result.out == ""
    assert result.err == 'error: MuJoCo is not installed; pip install "wam_cast[crosscheck]"\n'


@pytest.mark.slow
def test_a_cast_through_drake_and_mujoco(cli, monkeypatch):
    pytest.importorskip("mujoco")
    monkeypatch.setitem(sys.modules, "wam_cast.batch.engine", None)
    result = cli("crosscheck", "--casts", "1", "--json")
    assert result.code == 0
    engines = json.loads(result.out)["engines"]
    assert engines[DRAKE_CONVERGED]["differences"]["landing"]["largest"] < 1e-6
    assert engines[DRAKE]["differences"]["ball_path"]["largest"] < 1e-3
