"""What makes two runs the same: settings, the software and the arm; another one's directory is refused by name."""

import json
import re
from dataclasses import replace
from pathlib import Path

import pytest

import wam_cast as wc
from wam_cast.experiments.paper.settings import Settings
from wam_cast.scenario import Noise
from wam_cast.storage.run_directory import RunDirectory


def settings_of(scenario, seed=0, quick=True):
    return Settings.of(scenario, seed=seed, quick=quick)


def begin(path, settings):
    return RunDirectory(path, settings.identity, settings.own_scenario)


@pytest.fixture
def settings():
    return settings_of(wc.Scenario())


@pytest.mark.parametrize(
    ("other", "difference"),
    [
        (settings_of(wc.Scenario(), seed=1), "seed (0, not 1)"),
        (settings_of(wc.Scenario(), quick=False), "n_casts (170, not 1700)"),
        (settings_of(wc.Scenario(ball={"mass": 0.04})), "scenario.ball.mass (0.03, not 0.04)"),
        (settings_of(wc.Scenario(noise=Noise(wait=0.01))), "noise.distance (0.003, not 0.0)"),
        (replace(settings_of(wc.Scenario()), n_repeats=4), "n_repeats (3, not 4)"),
    ],
)
def test_another_run_is_refused(tmp_path, settings, other, difference):
    begin(tmp_path, settings)
    with pytest.raises(wc.InputError, match=re.escape(f"another {difference}")):
        begin(tmp_path, other)


@pytest.mark.parametrize(
    ("value", "other", "name"),
    [
        ('"drake": "', '"drake": "0.', r"versions\.drake"),
        ('"wam_cast": "', '"wam_cast": "0', r"versions\.wam_cast"),
        ('"fingerprint": "', '"fingerprint": "0', "fingerprint"),
    ],
)
def test_a_run_with_other_software_or_another_arm_is_refused(tmp_path, settings, value, other, name):
    begin(tmp_path, settings)
    path = tmp_path / "settings.json"
    path.write_text(path.read_text().replace(value, other))
    with pytest.raises(wc.InputError, match=f"another {name}"):
        begin(tmp_path, settings)


def test_the_scenario_beside_the_report_repeats_the_run(tmp_path):
    settings = settings_of(wc.Scenario(ball={"mass": 0.04}, noise=Noise(wait=0.01)), seed=3)
    begin(tmp_path, settings)
    stored = wc.Scenario.from_yaml(tmp_path / "scenario.yaml")
    assert settings_of(stored, seed=3).identity == settings.identity
    assert f"--scenario {tmp_path / 'scenario.yaml'}" in settings.command(tmp_path)


def test_the_reference_needs_no_scenario_file(settings):
    assert settings.command(Path("my run")) == "wam-cast reproduce --seed 0 --out 'my run' --quick"


@pytest.mark.parametrize("seed", [-1, 0.5, "one"])
def test_a_seed_that_is_none_is_refused_before_anything_is_written(tmp_path, seed):
    with pytest.raises(wc.InputError, match=r"seed = .* must be an integer, 0 or more"):
        wc.reproduce(wc.Scenario(), tmp_path / "run", seed=seed)
    assert not (tmp_path / "run").exists()


def test_settings_keep_noise_out_of_the_main_part():
    settings = settings_of(wc.Scenario(noise=Noise(wait=0.01)))
    assert not settings.scenario.noise.is_on
    assert settings.noisy_scenario.noise.wait == 0.01
    assert json.dumps(settings.identity)
