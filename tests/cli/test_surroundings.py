"""What a user's terminal, files and names are like: nothing of it costs a digit, the work, or more than one line."""

import logging
import os
import re

import pytest

from wam_cast.cli import terminal

BYTES = os.fsdecode(b"\xff\xfe d")
"""A name that is no UTF-8."""

ESCAPES = "a\x1b[31mred\x1b]0;title\x07\u202e"
"""A name that would steer the terminal."""

LONG = "x" * 4000

OUTPUTS = [
    "throw --cup 0.7 --replay {}.html",
    "throw --cup 0.7 --picture {}.png",
    "throw --cup 0.7 --animation {}.gif",
    "map --out {}.png",
    "check --picture {}.png",
    "show --graph {}.dot",
    "fit d --out {}",
    "generate --casts 40 --out {}",
    "reproduce --quick --out {}",
]


def refused(cli, *words):
    result = cli(*words)
    assert (result.code, result.out, result.err.count("\n")) == (2, "", 1), result
    assert len(result.err) < 1500
    assert result.err[:-1].isprintable()
    return result.err


# --- the width of the terminal


@pytest.mark.parametrize("columns", [80, 72, 40, 12])
def test_no_digit_is_lost_on_a_narrow_terminal(cli, terminal_of, columns):
    words = ("plan", "--cup", "-0.2345,-0.5432", "--cup", "0.75")
    terminal_of(200)
    wide = cli(*words).out
    numbers = re.findall(r"-?\d+\.\d+", wide)
    assert len(numbers) == 16
    terminal_of(columns)
    narrow = cli(*words).out
    assert re.findall(r"-?\d+\.\d+", narrow) == numbers
    assert "…" not in narrow
    assert ("┃" in narrow) == (columns == 80)
    assert ("speed [m/s]: " in narrow) == (columns < 80)


def test_a_table_without_headings_is_printed_as_lines_where_it_is_too_wide(terminal_of, capsys):
    terminal_of(30)
    terminal.print_table([("hand at its highest [m]", "1.234 to 5.678"), ("bearings", "-2")])
    assert capsys.readouterr().out == "hand at its highest [m]: 1.234 to 5.678\nbearings: -2\n"


@pytest.mark.parametrize("command", ["throw", "generate"])
def test_no_word_of_the_help_is_cut_off_on_a_narrow_terminal(process, monkeypatch, command):
    monkeypatch.setenv("COLUMNS", "40")
    result = process(command, "--help")
    assert result.code == 0
    assert "…" not in result.out
    assert "--scenario" in result.out


def test_a_terminal_that_does_not_know_its_width_is_told_all_the_same(process, monkeypatch):
    monkeypatch.setenv("COLUMNS", "0")
    assert "--scenario" in process("throw", "--help").out
    assert process("plan").err.count("\n") == 1


# --- names


@pytest.mark.parametrize("name", [BYTES, ESCAPES, LONG], ids=["bytes", "escapes", "long"])
@pytest.mark.parametrize(
    "words",
    [
        "{}",
        "plan --cup {}",
        "plan --cup 0.7 --{}",
        "plan --cup 0.7 --planner {}",
        "plan --cup 0.7 --scenario {}",
        "plan --cup 0.7 --model {}",
        "throw --cup 0.7 --cast {}",
        "throw --cup 0.7 --picture {}",
        "throw --cup 0.7 --picture {}/a.png",
        "fit {} --out a.model",
        "fit d --out {}/a",
        "generate --out text/{}",
        "show --graph {}",
    ],
)
def test_names_that_are_long_or_no_text_are_quoted_in_one_printable_line(cli, folder, words, name):
    (folder / "text").touch()
    refused(cli, *(word.format(name) for word in words.split()))


@pytest.mark.usefixtures("no_physics")
@pytest.mark.skipif(os.name != "posix", reason="names of files are bytes on POSIX")
@pytest.mark.parametrize("name", [BYTES, ESCAPES], ids=["bytes", "escapes"])
def test_files_of_any_name_are_written_and_read(cli, folder, name):
    (folder / name).mkdir()
    (folder / name / "a.yaml").write_text("ball: {mass: 0.04}")
    out = [f"{name}/{path}" for path in ("casts", "a.model", "a.dot")]
    results = [
        cli("generate", "--casts", "60", "--out", out[0], "--scenario", f"{name}/a.yaml"),
        cli("fit", out[0], "--out", out[1]),
        cli("plan", "--cup", "0.7", "--model", out[1], "--scenario", f"{name}/a.yaml"),
        cli("show", "--graph", out[2]),
    ]
    assert [result.code for result in results] == [0] * 4
    printed = "".join(result.out + result.err for result in results)
    assert all(letter.isprintable() or letter == "\n" for letter in printed)
    assert (folder / out[2]).exists()


def test_a_dataset_set_aside_is_told_in_printable_letters(capsys):
    terminal.prepare_streams()
    logging.getLogger("wam_cast.storage").warning("dataset %s", ESCAPES)
    assert capsys.readouterr().err == "dataset a\\x1b[31mred\\x1b]0;title\\x07\\u202e\n"


# --- matplotlib's settings


NO_TEXT = b"\xff\xfe no text"


@pytest.mark.slow
def test_settings_of_matplotlib_that_cannot_be_read_stop_nothing(process, folder, monkeypatch):
    monkeypatch.setenv("MPLBACKEND", "none such")
    monkeypatch.setenv("MATPLOTLIBRC", "named")
    monkeypatch.setenv("XDG_CONFIG_HOME", str(folder))
    monkeypatch.delenv("MPLCONFIGDIR", raising=False)  # fonts are kept there too
    for place in ("matplotlibrc", "named", "matplotlib/matplotlibrc", "matplotlib/stylelib/a.mplstyle"):
        (folder / place).parent.mkdir(parents=True, exist_ok=True)
        (folder / place).write_bytes(NO_TEXT)
    result = process("map", "--out", "a.txt")  # loads matplotlib, and then ends
    assert (result.code, result.out) == (2, "")
    assert result.err == "error: cannot write a.txt: its suffix is .txt; choose one of .pdf, .png, .svg\n"


# --- places


@pytest.fixture
def no_work(monkeypatch):
    """Let nothing begin that takes its time."""
    for name in ("preview_scenario", "generate_dataset", "reproduce", "plan_cast", "CastStation"):
        monkeypatch.setattr(f"wam_cast.{name}", None, raising=False)
    for name in ("ForwardModel", "CastDataset"):
        monkeypatch.setattr(f"wam_cast.{name}.load", None)
    monkeypatch.setattr("wam_cast.learning.reference.reference_model", None)


@pytest.mark.usefixtures("no_work")
@pytest.mark.parametrize("place", ["text/a", LONG[:300]], ids=["below a file", "long"])
@pytest.mark.parametrize("words", OUTPUTS)
def test_a_place_that_cannot_be_written_is_refused_before_the_work(cli, folder, words, place):
    (folder / "text").touch()
    line = refused(cli, *words.format(place).split())
    assert "not a directory" in line.lower() or "name too long" in line.lower()
    assert [path.name for path in folder.iterdir()] == ["text"]
