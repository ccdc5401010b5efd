"""A run's directory: phases that are finished are kept, and no other run's are taken for them."""

import json
import re
import time
from contextlib import suppress
from dataclasses import replace
from pathlib import Path

import pytest

import wam_cast as wc
from wam_cast.experiments.frames import Result
from wam_cast.experiments.paper.settings import Settings
from wam_cast.scenario import Noise
from wam_cast.storage.run_directory import RunDirectory


class Found(Result):
    n: int
    mean: float
    p95: float | None


FOUND = Found(n=3, mean=1 / 3, p95=None)


@pytest.fixture
def settings():
    return Settings.of(wc.Scenario(), seed=0, quick=True)


def never():
    raise AssertionError("computed again")


def test_a_finished_phase_comes_back_as_it_was(tmp_path, settings):
    RunDirectory(tmp_path, settings).phase("a", Found, lambda: FOUND)
    assert RunDirectory(tmp_path, settings).phase("a", Found, never) == FOUND


def test_a_phase_that_failed_leaves_nothing(tmp_path, settings):
    directory = RunDirectory(tmp_path, settings)

    def interrupted():
        raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        directory.phase("a", Found, interrupted)
    assert directory.phase("a", Found, lambda: FOUND) == FOUND


@pytest.mark.parametrize("content", ["", "{", "{}", '{"mean": 1}', "[]"])
def test_a_broken_file_is_computed_again(tmp_path, settings, content):
    directory = RunDirectory(tmp_path, settings)
    directory.phase("a", Found, lambda: FOUND)
    (tmp_path / "phases" / "a.json").write_text(content)
    assert directory.phase("a", Found, lambda: FOUND) == FOUND


@pytest.mark.parametrize(
    ("other", "difference"),
    [
        (Settings.of(wc.Scenario(), seed=1, quick=True), "seed (0, not 1)"),
        (Settings.of(wc.Scenario(), seed=0, quick=False), "n_casts (170, not 1700)"),
        (
            Settings.of(wc.Scenario(ball={"mass": 0.04}), seed=0, quick=True),
            "scenario.ball.mass (0.03, not 0.04)",
        ),
        (
            Settings.of(wc.Scenario(noise=Noise(wait=0.01)), seed=0, quick=True),
            "noise.distance (0.003, not 0.0)",
        ),
        (replace(Settings.of(wc.Scenario(), seed=0, quick=True), n_repeats=4), "n_repeats (3, not 4)"),
    ],
)
def test_another_run_is_refused(tmp_path, settings, other, difference):
    RunDirectory(tmp_path, settings)
    with pytest.raises(wc.InputError, match=re.escape(f"another {difference}")):
        RunDirectory(tmp_path, other)


@pytest.mark.parametrize(
    ("value", "other", "name"),
    [
        ('"drake": "', '"drake": "0.', r"versions\.drake"),
        ('"wam_cast": "', '"wam_cast": "0', r"versions\.wam_cast"),
        ('"fingerprint": "', '"fingerprint": "0', "fingerprint"),
    ],
)
def test_a_run_with_other_software_or_another_arm_is_refused(tmp_path, settings, value, other, name):
    RunDirectory(tmp_path, settings)
    path = tmp_path / "settings.json"
    path.write_text(path.read_text().replace(value, other))
    with pytest.raises(wc.InputError, match=f"another {name}"):
        RunDirectory(tmp_path, settings)


def test_a_run_that_stopped_while_it_began_goes_on(tmp_path, settings):
    RunDirectory(tmp_path, settings)
    (tmp_path / "scenario.yaml").unlink()
    RunDirectory(tmp_path, settings)
    assert wc.Scenario.from_yaml(tmp_path / "scenario.yaml") == wc.Scenario()


def test_two_runs_keep_out_of_each_others_way(tmp_path, settings):
    with RunDirectory(tmp_path, settings), pytest.raises(wc.InputError, match="another run is at work"):
        RunDirectory(tmp_path, settings).__enter__()
    with RunDirectory(tmp_path, settings):
        pass  # the first one has gone


def test_time_of_interrupted_attempts_counts(tmp_path, settings):
    directory = RunDirectory(tmp_path, settings)
    for end in (KeyboardInterrupt, ValueError, None):
        with suppress(KeyboardInterrupt, ValueError), directory.timed("a"):
            time.sleep(0.02)
            if end is not None:
                raise end
    assert 0.06 <= directory.wall_seconds()["a"] < 1


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
    assert f"--scenario {tmp_path / 'scenario.yaml'}" in settings.command(tmp_path)


def test_the_reference_needs_no_scenario_file(settings):
    assert settings.command(Path("my run")) == "wam-cast reproduce --seed 0 --out 'my run' --quick"


@pytest.mark.parametrize("seed", [-1, 0.5, "one"])
def test_a_seed_that_is_none_is_refused_before_anything_is_written(tmp_path, seed):
    with pytest.raises(wc.InputError, match=r"seed = .* must be a whole number, 0 or more"):
        wc.reproduce(wc.Scenario(), tmp_path / "run", seed=seed)
    assert not (tmp_path / "run").exists()


def test_settings_keep_noise_out_of_the_main_part():
    settings = Settings.of(wc.Scenario(noise=Noise(wait=0.01)), seed=0, quick=True)
    assert not settings.scenario.noise.is_on
    assert settings.noisy_scenario.noise.wait == 0.01
    assert json.dumps(settings.identity)
