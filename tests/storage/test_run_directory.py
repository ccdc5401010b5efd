"""A run's directory: phases that are finished are kept, and no other run's are taken for them."""

import os
import re
import subprocess
import sys
import time
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path

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


@pytest.mark.parametrize(
    "spoil",
    [
        lambda text: "",
        lambda text: "{",
        lambda text: "[]",
        lambda text: "[" * 100_000,
        lambda text: text[: len(text) // 2],
        lambda text: text.replace('"n":3', '"n":4'),
        lambda text: text.replace("0.3333", "0.4333"),
        lambda text: text.rstrip(),
        lambda text: '{"n":3,"mean":0.5,"p95":null}',
    ],
)
def test_a_phase_that_was_damaged_or_edited_is_set_aside_and_computed_again(tmp_path, caplog, spoil):
    directory, file = begin(tmp_path), tmp_path / "phases" / "a.json"
    directory.phase("a", Statistics, lambda: FOUND)
    assert not caplog.messages
    whole = file.read_text()
    for aside in ("a.json", "a-1.json"):
        file.write_text(spoil(whole))
        assert directory.phase("a", Statistics, lambda: FOUND) is FOUND
        assert file.read_text() == whole
        assert (tmp_path / "set_aside" / aside).read_text() == spoil(whole)
    assert directory.phase("a", Statistics, never) == FOUND
    first, _ = caplog.messages
    assert first.endswith(
        "a.json is not what was written there; it is now {}, and is computed again".format(
            tmp_path / "set_aside" / "a.json"
        )
    )


def test_a_flipped_bit_of_a_phase_is_noticed(tmp_path):
    directory, file = begin(tmp_path), tmp_path / "phases" / "a.json"
    directory.phase("a", Statistics, lambda: FOUND)
    whole = file.read_bytes()
    for position in range(len(whole)):
        flipped = bytearray(whole)
        flipped[position] ^= 1 << position % 8
        file.write_bytes(flipped)
        assert directory.phase("a", Statistics, lambda: FOUND) is FOUND


@pytest.mark.skipif(not hasattr(os, "mkfifo"), reason="named pipes")
def test_what_is_no_file_in_the_place_of_a_phase_is_set_aside(tmp_path):
    directory, file = begin(tmp_path), tmp_path / "phases" / "a.json"
    for make in (os.mkdir, os.mkfifo):
        make(file)
        assert directory.phase("a", Statistics, lambda: FOUND) is FOUND
        file.unlink()
    assert len(list((tmp_path / "set_aside").iterdir())) == 2


@pytest.mark.parametrize(
    "make", [os.mkdir, lambda lock: lock.symlink_to(lock), lambda lock: lock.symlink_to("/none/there")]
)
def test_a_lock_that_cannot_be_opened_is_one_line(tmp_path, make):
    make(tmp_path / ".lock")
    with pytest.raises(
        InputError, match=r"its \.lock cannot be opened \(.*\); move it away, or choose another"
    ) as caught:
        begin(tmp_path)
    assert "\n" not in str(caught.value)


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


@pytest.mark.parametrize(
    "spoil", [Path.mkdir, lambda path: path.write_text("ball: {mass: 0.05}")], ids=["folder", "edit"]
)
def test_a_scenario_that_was_edited_is_set_aside(tmp_path, caplog, spoil):
    begin(tmp_path)
    begin(tmp_path)
    assert not caplog.messages
    path = tmp_path / "scenario.yaml"
    path.unlink()
    spoil(path)
    begin(tmp_path)
    assert Scenario.from_yaml(path) == Scenario()
    assert (tmp_path / "set_aside" / "scenario.yaml").exists()
    assert f"scenario.yaml is not what was written there; it is now {tmp_path / 'set_aside'}" in caplog.text


def test_a_file_in_the_place_of_a_folder_is_named(tmp_path):
    begin(tmp_path)
    (tmp_path / "phases").rmdir()
    (tmp_path / "phases").touch()
    with pytest.raises(InputError, match="phases is in the way of a folder; move it away, or choose another directory"):
        begin(tmp_path)


def test_what_cannot_be_written_says_so(tmp_path):
    (tmp_path / "file").write_text("")
    for path in (tmp_path / "file", tmp_path / "file" / "run"):
        with pytest.raises(InputError, match="cannot be written"):
            begin(path)


@pytest.mark.parametrize("content", ["[", "[]", "[" * 100_000, '{"a":' * 100_000])
def test_settings_that_cannot_be_read_say_so(tmp_path, content):
    begin(tmp_path)
    (tmp_path / "settings.json").write_text(content)
    with pytest.raises(InputError, match="cannot be read"):
        begin(tmp_path)


def test_a_message_repeats_no_more_of_a_value_than_one_reads(tmp_path):
    begin(tmp_path)
    for settings in ('{"seed":' + '{"a":' * 150 + "1" + "}" * 151, '{"seed": "%s"}' % ("x" * 5000)):
        (tmp_path / "settings.json").write_text(settings)
        with pytest.raises(InputError, match="another ") as caught:
            begin(tmp_path)
        assert len(str(caught.value)) < 400 + len(str(tmp_path))
