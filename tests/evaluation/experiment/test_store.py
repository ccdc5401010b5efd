"""A run's directory: phases that are finished are kept, and no other run's are taken for them."""

import json

import pytest

import wam_cast as wc
from wam_cast.evaluation.experiment.results import Statistics
from wam_cast.evaluation.experiment.settings import Settings
from wam_cast.evaluation.experiment.store import RunDirectory
from wam_cast.scenario import Noise

FOUND = Statistics(mean=0.1, median=0.2, p95=None, max=1 / 3)


@pytest.fixture
def settings():
    return Settings.of(wc.Scenario(), seed=0, quick=True)


def never():
    raise AssertionError("computed again")


def test_a_finished_phase_comes_back_as_it_was(tmp_path, settings):
    RunDirectory(tmp_path, settings).phase("a", Statistics, lambda: FOUND)
    assert RunDirectory(tmp_path, settings).phase("a", Statistics, never) == FOUND


def test_a_phase_that_failed_leaves_nothing(tmp_path, settings):
    directory = RunDirectory(tmp_path, settings)

    def interrupted():
        raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        directory.phase("a", Statistics, interrupted)
    assert directory.phase("a", Statistics, lambda: FOUND) == FOUND


@pytest.mark.parametrize("content", ["", "{", '{"wall_s": 1}', '{"wall_s": 1, "result": {"mean": 1}}', "[]"])
def test_a_broken_file_is_computed_again(tmp_path, settings, content):
    directory = RunDirectory(tmp_path, settings)
    directory.phase("a", Statistics, lambda: FOUND)
    (tmp_path / "phases" / "a.json").write_text(content)
    assert directory.phase("a", Statistics, lambda: FOUND) == FOUND
    assert directory.wall_seconds()["a"] >= 0


@pytest.mark.parametrize(
    ("other", "key"),
    [
        (Settings.of(wc.Scenario(), seed=1, quick=True), "seed"),
        (Settings.of(wc.Scenario(), seed=0, quick=False), "n_casts"),
        (Settings.of(wc.Scenario(ball={"mass": 0.04}), seed=0, quick=True), "scenario"),
        (Settings.of(wc.Scenario(noise=Noise(wait=0.01)), seed=0, quick=True), "noise"),
    ],
)
def test_another_run_is_refused(tmp_path, settings, other, key):
    RunDirectory(tmp_path, settings)
    with pytest.raises(wc.InputError, match=f"another {key}.*choose another directory"):
        RunDirectory(tmp_path, other)


def test_a_run_with_other_versions_is_refused(tmp_path, settings):
    RunDirectory(tmp_path, settings)
    path = tmp_path / "settings.json"
    path.write_text(path.read_text().replace('"drake": "', '"drake": "0.'))
    with pytest.raises(wc.InputError, match="versions"):
        RunDirectory(tmp_path, settings)


def test_something_else_is_left_alone(tmp_path, settings):
    (tmp_path / "thesis.tex").write_text("mine")
    with pytest.raises(wc.InputError, match=r"holds thesis\.tex"):
        RunDirectory(tmp_path, settings)
    assert [path.name for path in tmp_path.iterdir()] == ["thesis.tex"]


def test_what_cannot_be_written_says_so(tmp_path, settings):
    (tmp_path / "file").write_text("")
    with pytest.raises(wc.InputError, match="cannot be written"):
        RunDirectory(tmp_path / "file" / "run", settings)


def test_settings_that_cannot_be_read_say_so(tmp_path, settings):
    RunDirectory(tmp_path, settings)
    (tmp_path / "settings.json").write_text("[")
    with pytest.raises(wc.InputError, match="cannot be read"):
        RunDirectory(tmp_path, settings)


def test_the_scenario_beside_the_report_repeats_the_run(tmp_path):
    asked = wc.Scenario(ball={"mass": 0.04}, noise=Noise(wait=0.01))
    settings = Settings.of(asked, seed=3, quick=True)
    RunDirectory(tmp_path, settings)
    stored = wc.Scenario.from_yaml(tmp_path / "scenario.yaml")
    assert Settings.of(stored, seed=3, quick=True).identity == settings.identity
    assert "--scenario scenario.yaml" in settings.command


def test_the_reference_needs_no_scenario_file(settings):
    assert settings.command == "wam-cast reproduce --seed 0 --quick --out DIR"


def test_settings_keep_noise_out_of_the_main_part():
    settings = Settings.of(wc.Scenario(noise=Noise(wait=0.01)), seed=0, quick=True)
    assert not settings.scenario.noise.is_on
    assert settings.noisy_scenario.noise.wait == 0.01
    assert json.dumps(settings.identity)
