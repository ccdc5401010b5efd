"""Command lines of generated words: whatever they are, an exit code that is documented, and at most one line of error."""

import functools
import shutil
import sys
from typing import get_args, get_origin, get_type_hints

import hypothesis
import pytest
import typer
from hypothesis import given
from hypothesis import strategies as st

import wam_cast as wc
from wam_cast.cli import commands
from wam_cast.errors import MachineError

pytestmark = pytest.mark.usefixtures("little_memory")

COMMANDS = [command.callback for command in commands.app.registered_commands]
FILES = {
    "good.yaml": b"ball: {mass: 0.04}",
    "wrong.yaml": b"ball: {mass: -1}",
    "text.txt": b"no model\x1b[31m\n\xff",
    "empty.yaml": b"",
}
PATHS = [
    *FILES,
    "casts",
    "made.model",
    "new",
    "new.png",
    "new.gif",
    "new.html",
    "new.dot",
    "missing/new",
    ".",
    "..",
    "",
    "~",
]
PATHS += [
    "/dev/null",
    "/dev/full",
    "/proc/self/mem",
    "casts/manifest.json",
    "x" * 5000,
    "a\nb",
    "\x1b[31mred",
    "[bold]",
    "\udcff",
]
NUMBERS = [
    "0",
    "1",
    "2",
    "3",
    "40",
    "-1",
    "1.5",
    "nan",
    "inf",
    "1e400",
    "9" * 30,
    "9" * 5000,
    "1000000000",
    "",
    "x",
    "0x10",
    "١",
]
CUPS = [
    "0.75",
    "0.6,-0.25",
    "5",
    "-0.7",
    "0",
    "nan",
    "1e400",
    "1e308,0",
    "0.7,inf",
    "1,2,3",
    ",",
    "0.6,",
    "a",
    "",
    "0,0",
    "1_0",
]
CASTS = [
    "0.3,0.6,0.1",
    "0.3,0.6,0.1,45",
    "0.3,0.6,1e9",
    "0,0,0",
    "nan,1,1",
    "1",
    "",
    "0.3,0.6,0.1,1e308",
    "a,b,c",
    "9e9,9e9,9e9",
]
OTHERS = ["--", "--help", "--json", "--cup", "-x", "--out=", "--no-json", "-"]
GOOD = {
    "--scenario": "good.yaml",
    "--belief": "good.yaml",
    "--robot": "good.yaml",
    "--model": "made.model",
    "--picture": "new.png",
    None: "casts",
}
GOOD |= {
    "--replay": "new.html",
    "--animation": "new.gif",
    "--recording": "new.mcap",
    "--graph": "new.dot",
    "--cup": "0.75",
    "--cast": "0.3,0.6,0.1",
}
GOOD |= {"--casts": "40", "--radii": "2", "--bearings": "2", "--scheduler": "tcp://localhost:1"}
ANY = st.sampled_from([*PATHS, *NUMBERS, *CUPS, *OTHERS]) | st.text(max_size=9).filter(lambda word: word[:1] != "/")


def kinds_of(annotation):
    """Return what a value of an option may be: types, and words of a literal."""
    inner = get_args(annotation)
    return {annotation} if not inner or get_origin(annotation) is list else set().union(*map(kinds_of, inner))


def options_of(command):
    """Yield the name of each option of a command, None for an argument, and what may stand behind it, None for a flag."""
    for name, hint in get_type_hints(command, include_extras=True).items():
        if name == "return":
            continue
        kind, info = get_args(hint)
        names = getattr(info, "param_decls", None) or (f"--{name}",)
        kinds = kinds_of(kind)
        values = CUPS if name == "cup" else CASTS if name == "cast" else NUMBERS if int in kinds else PATHS
        words = [word for word in kinds if isinstance(word, str)] or values
        yield None if isinstance(info, typer.models.ArgumentInfo) else names[0], None if bool in kinds else words


@st.composite
def word_lists(draw):
    """Return the words of a command with some of its options, and now and then something else among them."""
    command, is_good = draw(st.sampled_from(COMMANDS)), draw(st.booleans())
    words = [command.__name__.rstrip("_")]
    for name, values in options_of(command):
        if name in ("--out", "--cup", None) or draw(st.integers(0, 3)) == 0:
            words += [] if name is None else [name]
            if values is not None:
                usual = GOOD.get(name, "new.png" if values is PATHS else values[1])
                words.append(usual if is_good else draw(st.sampled_from(values)))
    for _ in range(draw(st.sampled_from([0] if is_good else [0, 0, 1, 2]))):
        words.insert(draw(st.integers(0, len(words))), draw(ANY))
    return [word.replace("\0", "") for word in words]


@pytest.fixture
def without_long_work(monkeypatch, no_physics):
    """Let commands do all but what takes seconds: simulate, look for the shipped model again, plan the same again, show."""

    def nothing(*_, **__):
        raise MachineError("this part is left out")

    reference, plan_cast = wc.reference_model(), wc.plan_cast
    planned = functools.cache(lambda cup, method, solver: plan_cast(reference, cup, method, solver))
    monkeypatch.setattr(
        wc, "plan_cast", lambda _, cup, method="program", solver=None: planned(cup, method, solver), raising=False
    )
    monkeypatch.setattr(wc, "reference_model", lambda: reference, raising=False)
    monkeypatch.setattr(commands, "execute", nothing)
    monkeypatch.setattr(commands, "require_workable", lambda *_, **__: None)
    for name in ("preview_scenario", "reproduce", "CastStation"):
        monkeypatch.setattr(wc, name, nothing, raising=False)
    monkeypatch.setattr("wam_cast.experiments.floor_map.map_floor", nothing)
    monkeypatch.setattr("wam_cast.adaptation.adaptive_model.AdaptiveModel.from_prior", nothing, raising=False)
    monkeypatch.setattr("wam_cast.crosscheck.engine_comparison.compare_engines", nothing)
    monkeypatch.setattr("wam_cast.visualization.interactive.explorer.Explorer", nothing)
    monkeypatch.setitem(sys.modules, "distributed", None)


@pytest.fixture
def made(cli, without_long_work, tmp_path):
    """Return a folder with a dataset, a model and some files, to be copied."""
    folder = tmp_path / "made"
    folder.mkdir()
    assert cli("generate", "--casts", "40", "--out", folder / "casts").code == 0
    assert cli("fit", folder / "casts", "--out", folder / "made.model").code == 0
    for name, content in FILES.items():
        (folder / name).write_bytes(content)
    return folder


@given(words=word_lists() | st.lists(ANY, min_size=1, max_size=5))
def test_whatever_the_words_are_there_is_one_answer(cli, made, folder, answered, words):
    for path in folder.iterdir():
        shutil.rmtree(path) if path.is_dir() and not path.is_symlink() else path.unlink()
    shutil.copytree(made, folder, dirs_exist_ok=True)
    with answered():
        result = cli(*words)
    hypothesis.event(f"exit code {result.code}")
    assert result.code in (0, 1, 2)
    if result.code == 2:
        *told, line = result.err.removesuffix("\n").split("\n")
        assert line.startswith("error: ")
        assert len(line) < 1100
        assert all(letter.isprintable() or letter == "\udcff" for letter in line)
        assert len(told) < 10
