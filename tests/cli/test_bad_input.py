"""Input that cannot be used: one line on standard error that says how to fix it, exit code 2, nothing left behind."""

import shutil

import pytest

import wam_cast as wc
from wam_cast.arm.arm_model import models_directory
from wam_cast.cli import commands

SCENARIOS = {
    "unknown_key.yaml": ("string: {lenght: 0.5}", ["string.lenght", "unknown key", "length, n_links"]),
    "unknown_part.yaml": ("strng: {}", ["strng", "unknown key", "arm, string"]),
    "negative_mass.yaml": ("ball: {mass: -0.03}", ["ball.mass", "-0.03", "greater than or equal to 0.0005"]),
    "long_string.yaml": ("string: {length: 2.0}", ["string.length = 2 m", "allow less than", "start_height"]),
    "empty_bounds.yaml": ("bounds: {wait: [0.3, 0.1]}", ["bounds.wait = [0.3, 0.1]", "below the second"]),
    "negative_noise.yaml": ("noise: {distance: -0.003}", ["noise.distance", "-0.003", "or equal to 0"]),
    "no_yaml.yaml": ("ball: [", ["not a YAML file", "line 1, column 8"]),
    "list.yaml": ("- 1\n- 2\n", ["top level", "arm, string"]),
}

# Words of the command line, and what the one line must hold.
WORDS = {
    "plan --cup 5": ["cup = (5, 0)", "5 m", "out of reach", "choose a distance from"],
    "throw --cup 0.1,0.1": ["cup = (0.1, 0.1)", "out of reach", "choose a distance from"],
    "plan --cup 0.7 --cup 9": ["cup = (9, 0)"],
    "plan --cup -0.7": ["bearing of 180 degrees", "joint 1", "choose one from"],
    "plan --cup nan": ["--cup 'nan'", "not finite", "--cup 0.75"],
    "throw --cup 0.7,inf": ["--cup '0.7,inf'", "not finite"],
    "plan --cup abc": ["--cup 'abc'", "X or X,Y in metres", "--cup 0.60,-0.25"],
    "throw --cup 1,2,3": ["--cup '1,2,3'", "X or X,Y in metres"],
    "plan --cup=": ["--cup ''", "X or X,Y in metres"],
    "plan --cup 0.6,": ["--cup '0.6,'", "X or X,Y in metres"],
    "plan --cup 0.6 0.2": ["0.2", "wam-cast plan --help"],
    "plan --cup 0.6 -0.2": ["-0", "a cup is one word", "--cup 0.60,-0.25"],
    "plan --cup 0.7 --cup": ["--cup", "--help"],
    "plan": ["--cup", "wam-cast plan --help"],
    "throw": ["--cup", "wam-cast throw --help"],
    "plan --cup 0.7 --solver gurobi": ["--solver", "gurobi", "snopt", "ipopt", "nlopt"],
    "plan --cup 0.7 --planner gradient --solver snopt": ["solver 'snopt'", "'gradient' has none"],
    "plan --cup 0.7 --planner newton": ["'--planner': 'newton'", "program", "gradient"],
    "plan --cup 0.7 --color": ["--color", "wam-cast plan --help"],
    "cast --cup 0.7": ["cast", "wam-cast --help"],
    "--json plan": ["--json", "wam-cast --help"],
    "plan --cup 0.7 --scenario missing.yaml": ["missing.yaml", "name a readable YAML file"],
    "plan --cup 0.7 --scenario .": ["scenario .", "name a readable YAML file"],
    "plan --cup 0.7 --model missing.model": ["missing.model", "wam-cast fit"],
    "plan --cup 0.7 --model text.txt": ["text.txt", "not a model file", "wam-cast fit"],
    "throw --cup 0.7 --model .": ["model .", "wam-cast fit"],
    "throw --cup 0.7 --replay missing/a.html": ["missing/a.html", "existing folder"],
    "throw --cup 0.7 --replay text.txt": ["text.txt", ".html"],
    "throw --cup 0.7 --replay .": ["cannot write", "is a directory"],
    "throw --cup 0.7 --recording missing/a.mcap": ["missing/a.mcap", "existing folder"],
    "throw --cup 0.7 --recording a.bag": ["a.bag", ".mcap"],
    "throw --cup 0.7 --picture missing/a.png": ["missing/a.png", "existing folder"],
    "throw --cup 0.7 --picture a.jpg": ["a.jpg", ".pdf, .png, .svg"],
    "throw --cup 0.7 --picture a": ["suffix is missing", ".pdf, .png, .svg"],
    "throw --cup 0.7 --replay a.html --picture missing/a.png": ["missing/a.png"],
    "throw --cup 0.7 --replay a.html --picture a.jpg": ["a.jpg", ".pdf, .png, .svg"],
    "throw --cup 0.7 --cup 0.8 --picture a.png": ["--picture", "give one --cup, not 2"],
    "throw --cup 0.7 --cup 0.8 --animation a.gif": ["--animation", "give one --cup, not 2"],
    "throw --cup 0.7 --animation a.png": ["a.png", ".gif, .mp4"],
    "throw --cup 0.7 --animation missing/a.gif": ["missing/a.gif", "existing folder"],
    "throw --cup 0.7 --picture a.png --animation a": ["suffix is missing", ".gif, .mp4"],
    "throw --cup 0.7 --seed -1": ["--seed", "0"],
    "throw --cup 0.7 --seed 0.5": ["--seed", "integer"],
    "generate --casts 40": ["--out", "wam-cast generate --help"],
    "generate --casts 0 --out d": ["--casts", "1"],
    "generate --casts many --out d": ["--casts", "integer"],
    "generate --casts 40 --seed -1 --out d": ["--seed", "0"],
    "generate --casts 40 --out text.txt": ["text.txt", "--out"],
    "generate --casts 40 --out text.txt/d": ["text.txt/d", "--out"],
    "generate --casts 40 --out .": ["holds", "empty or a new directory"],
    "generate --casts 40 --out d --workers 0": ["--workers", "1"],
    "generate --casts 40 --out d --workers 2 --scheduler tcp://x:1": ["--workers and --scheduler"],
    "fit": ["DIR", "wam-cast fit --help"],
    "fit missing --out a.model": ["missing", "wam-cast generate --out"],
    "fit text.txt --out a.model": ["text.txt", "wam-cast generate --out"],
    "crosscheck --casts 0": ["--casts", "1"],
    "crosscheck --casts 1000000": ["--casts", "10000"],
    "crosscheck --scenario missing.yaml": ["missing.yaml", "name a readable YAML file"],
    "show --graph a.jpg": ["a.jpg", ".svg, .png, .pdf, .dot"],
    "show --graph missing/a.dot": ["missing/a.dot", "existing folder"],
    "show --scenario missing.yaml": ["missing.yaml", "name a readable YAML file"],
}


def contents(folder):
    return {path: path.is_file() and path.read_bytes() for path in folder.rglob("*")}


@pytest.fixture
def refused(cli, folder):
    """Return a function that runs a command line that must be refused, and returns the line that says why."""

    def run(*words):
        before = contents(folder)
        result = cli(*words)
        assert result.code == 2
        assert result.out == ""
        assert result.err.startswith("error: ")
        assert result.err.endswith("\n")
        assert result.err.count("\n") == 1
        assert contents(folder) == before
        return result.err

    return run


@pytest.mark.parametrize("words", WORDS)
def test_one_line_says_what_is_wrong_and_how_to_fix_it(refused, folder, words):
    (folder / "text.txt").write_text("no model")
    line = refused(*words.split())
    for part in WORDS[words]:
        assert part in line


@pytest.mark.parametrize("name", SCENARIOS)
@pytest.mark.parametrize("command", ["plan --cup 0.7", "throw --cup 0.7", "generate --out d", "show"])
def test_a_scenario_that_cannot_be_used_is_named_with_the_value(refused, folder, command, name):
    text, parts = SCENARIOS[name]
    (folder / name).write_text(text, encoding="utf-8")
    line = refused(*command.split(), "--scenario", name)
    for part in [name, *parts]:
        assert part in line


def test_what_a_name_holds_is_not_taken_for_markup_or_a_line_of_its_own(refused):
    assert "[red]no\\nsuch[/red]" in refused("plan", "--cup", "[red]no\nsuch[/red]")
    line = refused("plan", "--cup", "0.7", "--scenario", "[bold]no\nsuch.yaml")  # `refused` counts the lines
    assert "[bold]no such.yaml" in line


@pytest.mark.usefixtures("no_physics", "scenarios")
def test_a_dataset_of_another_scenario_is_refused(cli, refused):
    assert cli("generate", "--casts", "60", "--out", "d").code == 0
    assert "of the scenario" in refused("fit", "d", "--out", "a.model", "--scenario", "heavy.yaml")
    line = refused("generate", "--casts", "60", "--out", "d", "--scenario", "heavy.yaml")
    assert "another scenario" in line
    assert "choose another directory (--out)" in line
    assert "another seed (0, not 1)" in refused("generate", "--casts", "60", "--seed", "1", "--out", "d")
    assert "60 casts" in refused("generate", "--casts", "50", "--out", "d")


@pytest.mark.usefixtures("no_physics", "scenarios")
def test_a_model_of_another_scenario_is_refused(cli, refused):
    assert cli("generate", "--casts", "60", "--out", "d", "--scenario", "heavy.yaml").code == 0
    assert cli("fit", "d", "--out", "heavy.model").code == 0
    for path in ("heavy.yaml", "lively.yaml"):
        code = cli("plan", "--cup", "0.7", "--model", "heavy.model", "--scenario", path).code
        assert code == {"heavy.yaml": 0, "lively.yaml": 2}[path]
    line = refused("plan", "--cup", "0.7", "--model", "heavy.model", "--scenario", "lively.yaml")
    assert "made for another scenario" in line


@pytest.mark.usefixtures("no_physics")
@pytest.mark.parametrize("path", ["missing/a.model", ".", "d/manifest.json/a.model"])
def test_an_unwritable_model_is_refused_before_the_fit(cli, refused, monkeypatch, path):
    assert cli("generate", "--casts", "60", "--out", "d").code == 0
    monkeypatch.setattr("wam_cast.learning.kernel_fit.tune_by_lbfgs", None)  # not to be called
    assert "existing folder" in refused("fit", "d", "--out", path)


@pytest.mark.usefixtures("no_physics")
def test_too_small_a_dataset_is_refused(cli, refused):
    assert cli("generate", "--casts", "33", "--out", "d").code == 0
    assert "at least 34" in refused("fit", "d", "--out", "a.model")


@pytest.mark.usefixtures("no_physics")
def test_an_unfinished_dataset_is_refused_with_the_command_that_finishes_it(cli, refused, folder):
    assert cli("generate", "--casts", "120", "--out", "d").code == 0
    (folder / "d" / "casts" / "part-00001.parquet").unlink()
    line = refused("fit", "d", "--out", "a.model")
    command = line.split("`wam-cast ")[1].split("`")[0]
    assert cli(*command.split()).code == 0
    assert cli("fit", "d", "--out", "a.model").code == 0


def test_a_scenario_that_the_arm_cannot_reach_is_refused(refused, folder):
    (folder / "far.yaml").write_text("motion: {start_radius: 3}")
    assert "motion.start_radius = 3 m" in refused("show", "--scenario", "far.yaml")


@pytest.mark.slow
def test_a_missing_dask_is_named(refused, monkeypatch):
    monkeypatch.setitem(__import__("sys").modules, "distributed", None)
    line = refused("generate", "--casts", "40", "--out", "d", "--scheduler", "tcp://localhost:1")
    assert "pip install 'wam-cast[distributed]'" in line


@pytest.mark.usefixtures("scenarios")
@pytest.mark.parametrize("command", ["plan", "throw"])
def test_a_scenario_without_a_model_names_the_commands_that_make_one(refused, command):
    line = refused(command, "--cup", "0.7", "--scenario", "heavy.yaml")
    assert "`wam-cast generate --scenario heavy.yaml --casts 1700 --out heavy-" in line
    assert "`wam-cast fit heavy-" in line
    assert "--train" in line


@pytest.mark.parametrize("cup", ["1.2,0.3", "-0.7", "0"])
def test_the_nearest_cup_that_an_error_names_can_be_pasted(cli, refused, cup):
    token = refused("plan", "--cup", cup).split("the nearest is ")[1].strip()
    assert cli("plan", "--planner", "gradient", "--cup", token).code == 0


def test_an_error_of_the_packages_own_is_not_dressed_up(cli, monkeypatch):
    def broken(*_):
        raise RuntimeError("a bug")

    monkeypatch.setattr("wam_cast.plan_cast", broken, raising=False)
    monkeypatch.setattr("sys.argv", ["wam-cast", "plan", "--cup", "0.7"])
    from wam_cast.cli import main

    with pytest.raises(RuntimeError, match="a bug"):
        main()


@pytest.mark.usefixtures("no_physics")
@pytest.mark.parametrize(
    "file", ["d/manifest.json", "d/scenario.yaml", "d/casts/part-00000.parquet", "d/casts/a.model"]
)
def test_a_model_takes_the_place_of_nothing_that_its_dataset_needs(cli, refused, folder, file):
    assert cli("generate", "--casts", "60", "--out", "d").code == 0
    before = {path: path.read_bytes() for path in folder.rglob("*") if path.is_file()}
    assert "it belongs to the dataset d; name another file" in refused("fit", "d", "--out", file)
    assert {path: path.read_bytes() for path in folder.rglob("*") if path.is_file()} == before


def test_a_scenario_whose_own_model_could_have_no_name_is_one_line(refused, folder):
    name = f"{'x' * 245}.yaml"
    (folder / name).write_text("ball: {mass: 0.05}")
    assert "has no model yet" in refused("plan", "--cup", "0.7", "--scenario", name)


@pytest.mark.parametrize(
    "words",
    [
        *(
            f"throw --cup 0.75 --cast 0.30,0.60,0.45 --{what}"
            for what in ("picture a.png", "animation a.gif", "replay a.html")
        ),
        "reproduce --quick --out report",
    ],
)
def test_a_mesh_that_cannot_be_drawn_is_refused_before_the_work(cli, folder, monkeypatch, words):
    shutil.copy(models_directory() / "wam7.urdf", folder)
    shutil.copytree(models_directory() / "meshes", folder / "meshes")
    (folder / "meshes" / "base_aluminium.obj").write_text("")
    (folder / "s.yaml").write_text("arm: {urdf: wam7.urdf}")
    monkeypatch.setattr(wc, "CastSimulator", None)
    monkeypatch.setattr(commands, "require_workable", lambda *_: None)
    result = cli(*words.split(), "--scenario", "s.yaml")
    assert result.code == 2
    assert result.err.startswith("error: arm.urdf: the mesh ")
    assert "base_aluminium.obj cannot be drawn: it is empty; mend the file" in result.err
    assert result.err.count("\n") == 1
    assert result.out == ""
    assert sorted(path.name for path in folder.iterdir()) == ["meshes", "s.yaml", "wam7.urdf"]
