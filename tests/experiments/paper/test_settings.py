"""What a run depends on: its seed, its scenario and the software's versions, not the text of the sources."""

import json
import os
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

import wam_cast as wc
from wam_cast.errors import InputError
from wam_cast.experiments.paper import settings
from wam_cast.experiments.paper.settings import Settings
from wam_cast.storage import dataset_directory
from wam_cast.storage.run_directory import RunDirectory

IDENTITY = """
import json
from wam_cast.experiments.paper.settings import Settings
from wam_cast.scenario import Scenario
print(json.dumps(Settings.of(Scenario(), 0, True).identity))
"""


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
    RunDirectory(tmp_path, Settings.of(wc.Scenario(), 0, True))
    monkeypatch.setattr(dataset_directory, "__version__", "99.0")
    with pytest.raises(InputError, match=r"another versions\.wam_cast \('.*', not '99\.0'\)"):
        RunDirectory(tmp_path, Settings.of(wc.Scenario(), 0, True))


def test_another_version_of_a_library_forbids_it(tmp_path, monkeypatch):
    RunDirectory(tmp_path, Settings.of(wc.Scenario(), 0, True))
    monkeypatch.setattr(settings, "version", lambda package: f"99.0 of {package}")
    with pytest.raises(InputError, match=r"another versions\.scipy"):
        RunDirectory(tmp_path, Settings.of(wc.Scenario(), 0, True))
