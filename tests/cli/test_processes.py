"""The command line as a process: exit codes, signals, pipes."""

import json
import os
import re
import shlex
import signal
import subprocess
import sys
import time
import urllib.request
from pathlib import Path

import pandas as pd
import psutil
import pytest

import wam_cast as wc

pytestmark = pytest.mark.skipif(os.name != "posix", reason="signals and pipes of POSIX")


ENVIRONMENT = {**os.environ, "PYTHONPATH": str(Path(wc.__file__).parents[1])}
"""With which other processes find the package."""


def ctrl_c(process):
    """Interrupt a process as a terminal does: with all that it has started."""
    os.killpg(process.pid, signal.SIGINT)
    out, err = process.communicate(timeout=60)
    check_quiet(err)
    return out, err


def check_quiet(err):
    """Say that an interruption has shown nothing of the program's inside."""
    assert "Traceback" not in err
    assert "Exception in thread" not in err


def wait_for(condition, process, seconds=120):
    deadline = time.monotonic() + seconds
    while not condition():
        assert process.poll() is None, process.communicate()
        assert time.monotonic() < deadline
        time.sleep(0.05)


@pytest.mark.parametrize(
    ("words", "code"),
    [
        (["--version"], 0),
        (["plan", "--cup", "-0.2,0.5", "--json"], 0),
        pytest.param(["plan", "--cup", "5"], 2, marks=pytest.mark.slow),
        (["plan"], 2),
    ],
)
def test_exit_codes_and_streams(process, words, code):
    result = process(*words)
    assert result.code == code
    assert bool(result.out) is (code == 0)
    assert result.err.count("\n") == (code == 2)
    if "--json" in words:
        assert json.loads(result.out)["is_feasible"]


PRINTING = """
from wam_cast.cli import main
from wam_cast.cli.commands import app
from wam_cast.cli.results import print_json
from wam_cast.cli.terminal import out

@app.command()
def line():
    out.print("the diagram is in a.dot")

@app.command()
def numbers():
    print_json({"cup": [0.75, 0.0]})

main()
"""
"""The command line with what prints as commands do, without their work."""


@pytest.mark.parametrize(
    ("program", "words"),
    [
        (["-m", "wam_cast"], "--help"),
        pytest.param(["-m", "wam_cast"], "plan --cup 0.75", marks=pytest.mark.slow),
        pytest.param(["-c", PRINTING], "numbers", marks=pytest.mark.slow),
        pytest.param(["-c", PRINTING], "line", marks=pytest.mark.slow),
    ],
    ids=["help", "table", "json", "line"],
)
def test_a_reader_that_has_left_gets_no_traceback(process, program, words):
    reader, writer = os.pipe()
    os.close(reader)
    try:
        result = process(*words.split(), program=program, stdout=writer)
    finally:
        os.close(writer)
    assert (result.code, result.err) == (141, "")


@pytest.fixture(params=["", "1"], ids=["buffered", "unbuffered"])
def full_disk(request, monkeypatch):
    """Give a device that is always full, written to at once or not."""
    monkeypatch.setenv("PYTHONUNBUFFERED", request.param)
    full = Path("/dev/full")
    if not full.exists():
        pytest.skip("this system has no device that is always full")
    with full.open("w") as device:
        yield device


@pytest.mark.parametrize(
    ("program", "word"),
    [
        (["-m", "wam_cast"], "--version"),
        pytest.param(["-m", "wam_cast"], "--help", marks=pytest.mark.slow),
        pytest.param(["-c", PRINTING], "numbers", marks=pytest.mark.slow),
    ],
    ids=["version", "help", "json"],
)
def test_output_without_room_is_one_line(process, full_disk, program, word):
    result = process(word, program=program, stdout=full_disk)
    assert result.code == 2
    assert result.err.count("\n") == 1
    assert "no space left on device" in result.err
    assert process(word, program=program, stdout=full_disk, stderr=full_disk).code == 2


def test_errors_without_room_keep_their_exit_code(process, full_disk):
    assert process("plan", "--cup", "up", stderr=full_disk).code == 2


OPEN_A_FILE = """
import os, sys
from wam_cast.cli.terminal import prepare_streams
prepare_streams()
print("nobody hears this")
sys.exit(os.open("file", os.O_CREAT | os.O_WRONLY))
"""


@pytest.mark.parametrize("closed", ["1>&-", "2>&-", "0<&- 1>&- 2>&-"])
def test_no_file_takes_the_place_of_a_closed_stream(closed):
    # What Drake's solvers print would go into it.
    ended = subprocess.run(f"{shlex.join([sys.executable, '-c', OPEN_A_FILE])} {closed}", shell=True, env=ENVIRONMENT)
    assert ended.returncode > 2


@pytest.mark.slow
def test_letters_that_the_terminal_does_not_have_are_done_without(process, monkeypatch):
    monkeypatch.setenv("PYTHONIOENCODING", "ascii")
    result = process("plan", "--cup", "0.75")
    assert (result.code, result.err) == (0, "")
    assert result.out.isascii()
    assert "0.7500, 0.0000" in result.out


@pytest.mark.slow
def test_show_serves_a_page_until_it_is_interrupted(start):
    process = start("show", "--json")
    text = ""
    while not text.endswith("}\n"):
        line = process.stdout.readline()
        assert line, process.stderr.read()
        text += line
    with urllib.request.urlopen(json.loads(text)["url"], timeout=30) as page:
        assert page.status == 200
        assert b"<html" in page.read().lower()
    out, err = ctrl_c(process)
    assert (process.returncode, out, err) == (130, "", "interrupted\n")


@pytest.mark.slow
def test_an_interrupted_generation_goes_on_to_the_same_dataset(start, process, folder, small_program, closed_form_row):
    # That a row of real casts is the same in any process, tests of datasets and maps show.
    words = ("generate", "--casts", "320", "--seed", "5", "--workers", "2")
    running = start(*words, "--out", "a b", program=small_program)
    casts = folder / "a b" / "casts"
    wait_for(lambda: (casts / "part-00000.parquet").exists(), running)
    out, err = ctrl_c(running)
    assert (running.returncode, out) == (130, "ready\n")
    kept = {path.name: path.read_bytes() for path in casts.iterdir()}
    assert "part-00000.parquet" in kept
    assert len(kept) < 7
    first, *_, last = err.splitlines()
    assert last == "interrupted"
    number, total = re.match(r"(\d+) of (\d+) casts were simulated", first).groups()
    assert 50 * len(kept) <= int(number) < int(total) == 320
    command = first.split("Go on with: wam-cast ")[1]
    assert process(*shlex.split(command), program=small_program).code == 0
    for name, content in kept.items():
        assert (casts / name).read_bytes() == content
    frame = wc.CastDataset.load("a b").frame
    undisturbed = pd.DataFrame([closed_form_row(wc.Scenario(), 5, row) for row in range(320)])[frame.columns]
    pd.testing.assert_frame_equal(frame, undisturbed, check_dtype=False, rtol=0, atol=0)


@pytest.mark.slow
@pytest.mark.parametrize("end", [os.kill, os.killpg], ids=["parent", "group"])
def test_a_terminated_generation_says_how_to_go_on_and_leaves_nothing_running_or_leaked(
    start, folder, small_program, end
):
    words = ("generate", "--casts", "320", "--seed", "5", "--workers", "2", "--out", "made")
    running = start(*words, program=small_program)
    wait_for(lambda: (folder / "made" / "casts" / "part-00000.parquet").exists(), running)
    others = psutil.Process(running.pid).children(recursive=True)
    end(running.pid, signal.SIGTERM)
    _, err = running.communicate(timeout=60)
    assert running.returncode == -signal.SIGTERM
    first, last = err.splitlines()  # no warning of leaked semaphores
    assert "finished parts are kept in made. Go on with: wam-cast generate" in first
    assert last == "terminated"
    assert len(others) >= 2
    assert psutil.wait_procs(others, timeout=30)[1] == []


@pytest.mark.slow
def test_an_interruption_amid_the_casts_shows_nothing_of_the_inside(start, folder, small_program):
    running = start("reproduce", "--quick", "--out", "run", "--workers", "2", program=small_program)
    wait_for(lambda: list(folder.rglob("part-00000.parquet")), running)
    _, err = ctrl_c(running)
    assert running.returncode == 130
    assert "Go on with: wam-cast" in err
    assert not list(folder.rglob("report.md"))
    assert err.endswith("interrupted\n")


@pytest.mark.slow
@pytest.mark.usefixtures("scenarios", "without_workers")
def test_the_commands_that_an_error_names_work_as_printed(cli):
    throw = ("throw", "--cup", "0.65", "--scenario", "heavy.yaml", "--json")
    commands = re.findall(r"`wam-cast (.*?)`", cli(*throw).err)
    assert len(commands) == 2
    for command in commands:
        result = cli(*shlex.split(command.replace("--casts 1700", "--casts 34")))
        assert (result.code, result.err) == (0, "")
    result = cli(*throw)
    assert json.loads(result.out)["status"]
    assert result.code == (0 if json.loads(result.out)["is_caught"] else 1)


UNHEARD = """
import os, signal, sys

class Interrupts:
    def __del__(self):
        os.kill(os.getpid(), signal.SIGINT)

class Loading:
    def find_spec(name, *_):
        if name == "functools":
            Interrupts()

for name in ("functools", "contextlib", "re"):
    sys.modules.pop(name, None)
sys.meta_path.insert(0, Loading)
sys.argv = ["wam-cast", "--version"]
from wam_cast.cli import main
main()
"""
"""Interrupts itself while the command line is loaded, where Python ignores exceptions."""


AMID_EXEC = """
import sys
from wam_cast.cli import main, running

def interrupted(words):
    exec("raise KeyboardInterrupt")

running.run = interrupted
main()
"""


@pytest.mark.parametrize("code", [UNHEARD, AMID_EXEC], ids=["ignored", "amid exec"])
def test_ctrl_c_is_one_word_where_python_would_ignore_it_or_end_by_a_signal(code):
    ended = subprocess.run([sys.executable, "-c", code], env=ENVIRONMENT, capture_output=True, text=True)
    assert (ended.returncode, ended.stdout, ended.stderr) == (130, "", "interrupted\n")


def test_ctrl_c_while_the_parts_are_loaded_is_no_traceback(cli, monkeypatch):
    class Interruption:
        @staticmethod
        def find_spec(name, *_):
            if name == "wam_cast.cli.running":
                raise KeyboardInterrupt

    monkeypatch.delitem(sys.modules, "wam_cast.cli.running", raising=False)
    monkeypatch.setattr(sys, "meta_path", [Interruption, *sys.meta_path])
    result = cli("plan", "--cup", "0.75")
    assert (result.code, result.out, result.err) == (130, "", "interrupted\n")


AMID_AN_IMPORT = """
import _imp, os, signal
from wam_cast.cli import main, running

def initialize(module, exec_dynamic=_imp.exec_dynamic):
    try:
        os.kill(os.getpid(), signal.SIGINT)
        [0 for _ in range(10_000)]
    except BaseException:
        raise ImportError("what compiled modules make of it")
    exec_dynamic(module)
    print("loaded\\n", end="")

def import_later(words):
    try:
        _imp.exec_dynamic = initialize
        import _lsprof
        while True:
            pass
    finally:
        print("what was finished is told")

running.run = import_later
main()
"""


WHERE_IT_IS_IGNORED = """
import os, signal
from wam_cast.cli import main, running

class Interrupts:
    def __del__(self):
        os.kill(os.getpid(), signal.SIGINT)
        [0 for _ in range(10_000)]

def drop(words):
    try:
        Interrupts()
        print("loaded\\n", end="")
        while True:
            pass
    finally:
        print("what was finished is told")

running.run = drop
main()
"""


@pytest.mark.parametrize("code", [AMID_AN_IMPORT, WHERE_IT_IS_IGNORED], ids=["import", "ignored"])
def test_ctrl_c_where_it_could_get_lost_is_heard_a_moment_later(code):
    command = [sys.executable, "-c", code]
    ended = subprocess.run(command, env=ENVIRONMENT, capture_output=True, text=True, timeout=20)
    assert (ended.returncode, ended.stderr) == (130, "interrupted\n")
    assert ended.stdout == "loaded\nwhat was finished is told\n"
