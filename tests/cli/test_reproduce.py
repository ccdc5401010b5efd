"""`wam-cast reproduce` as its user meets it; what it computes is tested with the experiment itself."""

import json
import re
from functools import cache
from html.parser import HTMLParser
from pathlib import Path

import numpy as np
import pytest

import wam_cast as wc
from wam_cast.cast import PARAMETERS
from wam_cast.cli import commands
from wam_cast.experiments.paper import reproduce as experiment
from wam_cast.experiments.paper import settings
from wam_cast.experiments.paper.report_figures import CAPTIONS
from wam_cast.experiments.paper.settings import Settings
from wam_cast.generation.sampling import row_noise_seed
from wam_cast.learning import dataset
from wam_cast.learning.reference import reference_dataset, reference_model
from wam_cast.motion.noise_draws import executed_cast
from wam_cast.planning.prediction import OUTPUTS
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


# --- one small run, whose cups are for real casts: it goes on after an interruption, and its report is whole


shipped = cache(lambda: reference_dataset().frame)


def shipped_row(scenario, seed, row):
    """Return a real cast, which is shipped; with noise, it lands as the shipped model predicts of what the arm makes of it.

    That these are what the simulation gives now is tested with what is shipped, and noise in datasets with datasets.
    """
    assert (seed, scenario.without_noise) == (0, wc.Scenario())
    values = shipped().loc[row].to_dict()
    cast = wc.Cast(*(values[name] for name in PARAMETERS))
    executed = executed_cast(scenario.noise, cast, row_noise_seed(seed, row)).to_array()[np.newaxis, :3]
    landing = dict(zip(OUTPUTS, reference_model().predict(executed)[0].tolist(), strict=True))
    return values | (landing if scenario.noise.is_on else {})


@pytest.fixture
def small(monkeypatch, pickling_executor):
    """Make quick runs small, and do their work in this process; what signals and kills do to others is tested in tests/faults."""

    def reproduce(*args, n_workers, **options):
        return experiment.reproduce(*args, executor=pickling_executor, n_workers=n_workers, **options)

    monkeypatch.setattr(wc, "reproduce", reproduce, raising=False)
    monkeypatch.setattr(commands, "require_workable", lambda *_: None)
    monkeypatch.setattr(dataset, "simulate_row", shipped_row)
    monkeypatch.setattr(settings, "QUICK", {"n_casts": 34, "n_cups": 3, "n_repeats": 1})


class Page(HTMLParser):
    """Collects what a page refers to, and its tables."""

    def __init__(self):
        super().__init__()
        self.sources, self.links, self.rows = [], [], []

    def handle_starttag(self, tag, attrs):
        attrs = dict(attrs)
        if tag == "img":
            self.sources.append(attrs["src"])
        if tag == "link" or tag == "script":
            self.links.append(attrs)
        if tag == "tr":
            self.rows.append([])

    def handle_data(self, data):
        if self.rows and data.strip():
            self.rows[-1].append(data.strip())


def check_figures(folder, markdown):
    for name in CAPTIONS:
        for suffix in ("pdf", "png"):
            assert (folder / "figures" / f"{name}.{suffix}").stat().st_size > 2000
        assert f"figures/{name}.png" in markdown


def check_text(results, folder, markdown):
    assert "nan" not in re.findall(r"[a-z]+", markdown.lower())
    assert "{{" not in markdown
    assert "{%" not in markdown
    assert results["wall_s"] == pytest.approx(sum(results["wall_s_by_phase"].values()))
    assert f"{100 * results['test_rmse_m']['isotropic']:.2f} cm" in markdown
    assert results["fingerprint"] in markdown
    assert f"`wam-cast reproduce --seed 0 --out {folder} --quick`" in markdown


def check_tables(markdown):
    tables = re.findall(r"(?:^\|.*\|[ \t]*\n)+", markdown, re.MULTILINE)
    assert len(tables) > 8
    for table in tables:
        assert len({line.count("|") for line in table.splitlines()}) == 1, table


def check_missed_cups_are_explained(results, markdown):
    groups = [*results["executions"], *results["noise"]["executions"]]
    missed = [trial for group in groups for trial in group["trials"] if trial["status"] != "caught"]
    assert missed  # the noise sees to it
    for trial in missed:
        assert f"cup at {100 * trial['cup']:.1f} cm" in markdown


def check_page_needs_nothing_but_itself(folder):
    page = Page()
    page.feed((folder / "report.html").read_text())
    assert len(page.sources) == len(CAPTIONS)
    assert all(source.startswith("data:image/png;base64,") for source in page.sources)
    assert not page.links


@pytest.mark.slow
@pytest.mark.usefixtures("small")
def test_a_run_is_interrupted_goes_on_and_shows_what_it_found(cli, folder, monkeypatch):
    """One test, since its casts and figures take their time."""

    def interrupt(*_):
        raise KeyboardInterrupt

    with monkeypatch.context() as once:
        once.setattr(experiment, "select_models", interrupt)
        interrupted = cli("reproduce", "--quick", "--out", "run", "--workers", "2")
    assert interrupted.code == 130
    assert list(folder.glob("run/phases/casts.json"))
    assert "Go on with: wam-cast reproduce --seed 0 --out run --workers 2 --quick" in interrupted.err

    result = cli("reproduce", "--quick", "--out", "run", "--workers", "2", "--json")
    assert result.code == 0
    assert "casts\n" not in result.err.replace("noisy casts\n", "")  # they were finished
    run = Path("run")
    printed, stored = json.loads(result.out), json.loads((run / "results.json").read_text())
    assert printed["directory"] == "run"
    assert all(stored[key] == value for key, value in printed.items() if key != "directory")
    assert (stored["n_train"], stored["n_validation"], stored["n_test"]) == (26, 6, 2)
    assert stored["fingerprint"] == wc.Scenario().fingerprint
    assert stored["test_rmse_m"]["isotropic"] < 0.2 * stored["test_rmse_m"]["constant"]
    assert stored["hit_rate"] > 0.7

    markdown = (run / "report.md").read_text()
    check_figures(run, markdown)
    check_text(stored, run, markdown)
    check_tables(markdown)
    check_missed_cups_are_explained(stored, markdown)
    check_page_needs_nothing_but_itself(run)
    assert (run / "report.html").stat().st_size > 500_000

    # The figures were drawn a moment ago.
    monkeypatch.setattr(experiment, "write_report", lambda *_: None)
    monkeypatch.setattr(experiment, "draw_figures", lambda *_: iter(CAPTIONS))
    again = cli("reproduce", "--quick", "--out", "run")
    assert again.code == 0
    assert again.err == "figures\n"
    assert "hit rate" in again.out
    assert again.out.startswith("a quick run, with a tenth of a full run's data\n")
