"""What the project's tools say of each other holds: tasks by their names, README's commands, the versions that CI installs."""

import re
import tomllib
from pathlib import Path

import pytest
import yaml

ROOT = Path(__file__).parents[2]
PROJECT = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))
TASKS = PROJECT["tool"]["poe"]["tasks"]
CALLERS = [
    ROOT / ".ci" / "run",
    ROOT / ".pre-commit-config.yaml",
    ROOT / "CONTRIBUTING.md",
    *(ROOT / ".github").rglob("*.yml"),
]
CONSTRAINTS = sorted((ROOT / "constraints").glob("*.txt"))


@pytest.mark.parametrize("path", CALLERS, ids=lambda path: path.relative_to(ROOT).as_posix())
def test_every_task_that_is_called_exists(path):
    called = re.findall(r"(?:^|`|/bin/)poe (?:-q )?(\w+)", path.read_text(encoding="utf-8"), re.MULTILINE)
    assert set(called) <= set(TASKS)


def test_readme_runs_the_tests_as_the_task_does():
    assert f".venv/bin/python -m {TASKS['test']['cmd']}\n" in (ROOT / "README.md").read_text(encoding="utf-8")


def test_commits_are_checked_as_ci_checks_them():
    (repository,) = yaml.safe_load((ROOT / ".pre-commit-config.yaml").read_text(encoding="utf-8"))["repos"]
    called = [hook["entry"].split()[-1] for hook in repository["hooks"]]
    assert called == ["lint", "types"]
    ci = (ROOT / ".ci" / "run").read_text(encoding="utf-8")
    assert all(f".venv/bin/poe {task}\n" in ci for task in called)


@pytest.mark.parametrize("path", CONSTRAINTS, ids=lambda path: path.name)
def test_constraints_hold_one_version_of_all_that_is_installed(path):
    lines = path.read_text(encoding="utf-8").splitlines()
    assert [line for line in lines if not re.fullmatch(r"[\w.-]+==[\w.+!]+", line)] == []
    pinned = {re.sub(r"[-_.]+", "-", line.split("==")[0]).lower() for line in lines}
    extras = PROJECT["project"]["optional-dependencies"]
    wanted = [*PROJECT["project"]["dependencies"], *extras["test"], *extras["docs"], *extras["dev"][1:]]
    assert {re.match(r"[\w-]+", each)[0].lower() for each in wanted} <= pinned


def test_ci_sets_up_the_pythons_that_have_constraints():
    for workflow in ("ci.yml", "constraints.yml"):
        text = (ROOT / ".github" / "workflows" / workflow).read_text(encoding="utf-8")
        versions = re.findall(r'python-version: "(3)\.(\d+)"', text)
        assert sorted(f"py{major}{minor}.txt" for major, minor in versions) == [path.name for path in CONSTRAINTS]


def test_readme_promises_the_pythons_that_the_package_declares():
    declared = re.findall(r"Python :: (3\.\d+)", "\n".join(PROJECT["project"]["classifiers"]))
    oldest = declared[0]
    assert PROJECT["project"]["requires-python"] == f">={oldest}"
    readme = " ".join((ROOT / "README.md").read_text(encoding="utf-8").split())
    assert f"Python {oldest} or newer on x86-64" in readme
    tested = {f"3.{path.stem.removeprefix('py3')}" for path in CONSTRAINTS}
    assert tested <= set(declared)
    assert f"CI runs {' and '.join(sorted(tested))}" in readme
