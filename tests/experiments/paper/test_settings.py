"""What a run depends on: its seed, its scenario and the software's versions, not the text of the sources."""

import json
import os
import re
import shutil
import subprocess
import sys
from dataclasses import replace
from pathlib import Path

import pytest

import wam_cast as wc
from wam_cast.errors import InputError
from wam_cast.experiments.paper import settings as paper_settings
from wam_cast.experiments.paper.settings import Settings
from wam_cast.scenario import Noise
from wam_cast.storage import manifest
from wam_cast.storage.run_directory import RunDirectory

IDENTITY = """
import json
from wam_cast.experiments.paper.settings import Settings
from wam_cast.scenario import Scenario
print(json.dumps(Settings.of(Scenario(), 0, True).identity))
"""


def settings_of(scenario, seed=0, quick=True):
    return Settings.of(scenario, seed=seed, quick=quick)


def begin(path, settings):
    with RunDirectory(path, settings.identity, settings.own_scenario) as directory:
        return directory


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


@pytest.mark.slow
def test_a_changed_docstring_does_not_forbid_to_go_on(tmp_path):
    package = Path(wc.__file__).parent
    copied = Path(shutil.copytree(package, tmp_path / "wam_cast"))
    models = package.parent / "models"
    if models.exists():
        shutil.copytree(models, tmp_path / "models")
    for path in copied.rglob("*.py"):
        path.write_text(f"# another comment\n{path.read_text()}")
    # From where no other copy is found before it.
    result = subprocess.run(
        [sys.executable, "-c", IDENTITY],
        env=os.environ | {"PYTHONPATH": str(tmp_path)},
        cwd=tmp_path,
        capture_output=True,
        text=True,
        check=True,
    )
    ours = json.loads(json.dumps(Settings.of(wc.Scenario(), 0, True).identity))
    assert json.loads(result.stdout) == ours


def test_another_version_of_the_package_forbids_it(tmp_path, monkeypatch):
    begin(tmp_path, settings_of(wc.Scenario()))
    monkeypatch.setattr(manifest, "__version__", "99.0")
    with pytest.raises(InputError, match=r"another versions\.wam_cast \('.*', not '99\.0'\)"):
        begin(tmp_path, settings_of(wc.Scenario()))


def test_another_version_of_a_library_forbids_it(tmp_path, monkeypatch):
    begin(tmp_path, settings_of(wc.Scenario()))
    monkeypatch.setattr(paper_settings, "version", lambda package: f"99.0 of {package}")
    with pytest.raises(InputError, match=r"another versions\.scipy"):
        begin(tmp_path, settings_of(wc.Scenario()))
