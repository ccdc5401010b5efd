"""`wam-cast reproduce` as its user meets it; what it computes is tested with the experiment itself."""

import json

import pytest

import wam_cast as wc
from wam_cast.experiments.paper import reproduce as experiment
from wam_cast.experiments.paper import settings
from wam_cast.experiments.paper.report_figures import CAPTIONS
from wam_cast.experiments.paper.settings import Settings
from wam_cast.storage.run_directory import RunDirectory


@pytest.fixture
def run_of_seed_3(folder):
    """Return the folder of a run that has just begun."""
    begun = Settings.of(wc.Scenario(), seed=3, quick=True)
    with RunDirectory(folder / "run", begun.identity, begun.own_scenario):
        return folder / "run"


def test_another_seed_in_the_same_folder_is_refused(cli, run_of_seed_3):
    result = cli("reproduce", "--out", run_of_seed_3, "--quick", "--seed", "4")
    assert result.code == 2
    assert "another seed (3, not 4)" in result.err
    assert result.err.count("\n") == 1


def test_another_engine_in_the_same_folder_is_refused(cli, run_of_seed_3):
    pytest.importorskip("jax")
    result = cli("reproduce", "--out", run_of_seed_3, "--quick", "--seed", "3", "--engine", "batch")
    assert result.code == 2
    assert "another engine ('drake', not 'batch')" in result.err


def test_a_full_run_does_not_go_on_with_a_quick_one(cli, run_of_seed_3):
    result = cli("reproduce", "--out", run_of_seed_3, "--seed", "3")
    assert result.code == 2
    assert "another n_casts (170, not 1700)" in result.err


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ((), "missing option '--out'"),
        (("--out", "run", "--seed", "-1"), "--seed"),
        (("--out", "run", "--workers", "0"), "--workers"),
        (("--out", "run", "--scenario", "none.yaml"), "scenario none.yaml: No such file or directory"),
    ],
)
def test_wrong_input_gets_one_line(cli, options, message):
    result = cli("reproduce", *options)
    assert result.code == 2
    assert message in result.err
    assert result.err.count("\n") == 1


def test_a_folder_with_something_else_is_left_alone(cli, folder):
    (folder / "mine").mkdir()
    (folder / "mine" / "thesis.tex").write_text("")
    result = cli("reproduce", "--out", "mine")
    assert result.code == 2
    assert "holds thesis.tex" in result.err


@pytest.mark.slow
def test_a_run_is_interrupted_goes_on_and_shows_what_it_found(cli, folder, monkeypatch):
    """With few casts, but real ones. What signals and kills do to its processes is tested in tests/faults."""

    def interrupt(*_):
        raise KeyboardInterrupt

    monkeypatch.setattr(settings, "QUICK", {"n_casts": 102, "n_cups": 6, "n_repeats": 2})
    with monkeypatch.context() as once:
        once.setattr(experiment, "select_models", interrupt)
        interrupted = cli("reproduce", "--quick", "--out", "run", "--workers", "2")
    assert interrupted.code == 130
    assert list(folder.glob("run/phases/casts.json"))
    assert "Go on with: wam-cast reproduce --seed 0 --out run --workers 2 --quick" in interrupted.err

    result = cli("reproduce", "--quick", "--out", "run", "--workers", "2", "--json")
    assert result.code == 0
    assert "casts\n" not in result.err.replace("noisy casts\n", "")  # they were finished
    printed, stored = json.loads(result.out), json.loads((folder / "run" / "results.json").read_text())
    assert printed["directory"] == "run"
    assert all(stored[key] == value for key, value in printed.items() if key != "directory")
    assert (stored["n_train"], stored["n_validation"], stored["n_test"]) == (78, 18, 6)
    assert stored["fingerprint"] == wc.Scenario().fingerprint
    assert stored["test_rmse_m"]["isotropic"] < 0.2 * stored["test_rmse_m"]["constant"]
    assert stored["hit_rate"] > 0.7
    assert (folder / "run" / "report.html").stat().st_size > 500_000

    # The figures were drawn a moment ago.
    monkeypatch.setattr(experiment, "write_report", lambda *_: None)
    monkeypatch.setattr(experiment, "draw_figures", lambda *_: iter(CAPTIONS))
    again = cli("reproduce", "--quick", "--out", "run")
    assert again.code == 0
    assert again.err == "figures\n"
    assert "hit rate" in again.out
    assert again.out.startswith("a quick run, with a tenth of a full run's data\n")
