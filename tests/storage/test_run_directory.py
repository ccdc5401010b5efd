"""A run's directory: phases that are finished are kept, and no other run's are taken for them."""

import re
import subprocess
import sys
import time
from contextlib import suppress
from dataclasses import dataclass

import pytest
from pydantic import BaseModel

from wam_cast.errors import InputError
from wam_cast.scenario import Scenario
from wam_cast.storage.run_directory import RunDirectory

IDENTITY = {"scenario": {"ball": {"mass": 0.03}}, "seed": 0, "n_casts": 170, "versions": {"drake": "1"}}


class Statistics(BaseModel):
    n: int
    mean: float
    p95: float | None


@dataclass
class Count:
    n: int


FOUND = Statistics(n=3, mean=1 / 3, p95=None)


def begin(path, **changes):
    """Return the directory of a run that has begun, and that nobody is at work in."""
    directory = RunDirectory(path, IDENTITY | changes, Scenario())
    with directory:
        pass
    return directory


def never():
    raise AssertionError("computed again")


@pytest.mark.parametrize(
    ("kind", "found"), [(Statistics, FOUND), (Count, Count(3)), (dict[str, float], {"mean": 1 / 3})]
)
def test_a_finished_phase_comes_back_as_it_was(tmp_path, kind, found):
    assert begin(tmp_path).phase("a", kind, lambda: found) is found
    assert begin(tmp_path).phase("a", kind, never) == found


def test_a_phase_that_failed_leaves_nothing(tmp_path):
    directory = begin(tmp_path)

    def interrupted():
        raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        directory.phase("a", Statistics, interrupted)
    assert directory.phase("a", Statistics, lambda: FOUND) == FOUND


@pytest.mark.parametrize("content", ["", "{", "{}", '{"mean": 1}', "[]"])
def test_a_broken_file_is_computed_again(tmp_path, content):
    directory = begin(tmp_path)
    directory.phase("a", Statistics, lambda: FOUND)
    (tmp_path / "phases" / "a.json").write_text(content)
    assert directory.phase("a", Statistics, lambda: FOUND) == FOUND


@pytest.mark.parametrize(
    ("other", "difference"),
    [
        ({"seed": 1}, "seed (0, not 1)"),
        ({"n_casts": 1700}, "n_casts (170, not 1700)"),
        ({"scenario": {"ball": {"mass": 0.04}}}, "scenario.ball.mass (0.03, not 0.04)"),
        ({"versions": {"drake": "1", "numpy": "2"}}, "versions.numpy (None, not '2')"),
        ({"versions": {}}, "versions.drake ('1', not None)"),
    ],
)
def test_another_run_is_refused(tmp_path, other, difference):
    begin(tmp_path)
    with pytest.raises(InputError, match=re.escape(f"a run of the experiment with another {difference};")):
        begin(tmp_path, **other)


def test_a_run_that_stopped_while_it_began_goes_on(tmp_path):
    begin(tmp_path)
    (tmp_path / "scenario.yaml").unlink()
    begin(tmp_path)
    assert Scenario.from_yaml(tmp_path / "scenario.yaml") == Scenario()


def test_two_runs_keep_out_of_each_others_way(tmp_path):
    with begin(tmp_path), pytest.raises(InputError, match="another run is at work"):
        begin(tmp_path).__enter__()
    with begin(tmp_path):
        pass  # the first one has gone


HOLD = """
import sys
from wam_cast.scenario import Scenario
from wam_cast.storage.run_directory import RunDirectory

with RunDirectory(sys.argv[1], {}, Scenario()):
    print("at work", flush=True)
    sys.stdin.read()
"""


def test_a_run_that_was_killed_keeps_nobody_out(tmp_path):
    pipes = {"stdin": subprocess.PIPE, "stdout": subprocess.PIPE}
    with subprocess.Popen([sys.executable, "-c", HOLD, tmp_path], text=True, **pipes) as other:
        assert other.stdout.readline() == "at work\n"
        with pytest.raises(InputError, match="another run is at work"):
            RunDirectory(tmp_path, {}, Scenario()).__enter__()
        other.kill()
        other.wait()
        with RunDirectory(tmp_path, {}, Scenario()):
            pass


def test_time_of_interrupted_attempts_counts(tmp_path):
    directory = begin(tmp_path)
    for end in (KeyboardInterrupt, ValueError, None):
        with suppress(KeyboardInterrupt, ValueError), directory.timed("a"):
            time.sleep(0.02)
            if end is not None:
                raise end
    assert 0.06 <= directory.wall_seconds()["a"] < 1


def test_something_else_is_left_alone(tmp_path):
    (tmp_path / "thesis.tex").write_text("mine")
    with pytest.raises(InputError, match=r"holds thesis\.tex and no run"):
        begin(tmp_path)
    assert [path.name for path in tmp_path.iterdir()] == ["thesis.tex"]


def test_what_cannot_be_written_says_so(tmp_path):
    (tmp_path / "file").write_text("")
    for path in (tmp_path / "file", tmp_path / "file" / "run"):
        with pytest.raises(InputError, match="cannot be written"):
            begin(path)


@pytest.mark.parametrize("content", ["[", "[]"])
def test_settings_that_cannot_be_read_say_so(tmp_path, content):
    begin(tmp_path)
    (tmp_path / "settings.json").write_text(content)
    with pytest.raises(InputError, match="cannot be read"):
        begin(tmp_path)
