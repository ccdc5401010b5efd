"""`wam-cast learn` as its user meets it; what a campaign does is tested with the campaign itself."""

import json
import re
import shlex
from pathlib import Path
from typing import get_args

import pandas as pd
import pytest

import wam_cast as wc
from wam_cast.adaptation import robot
from wam_cast.adaptation.adaptive_model import AdaptiveModel
from wam_cast.adaptation.methods import ADAPTATION_METHODS
from wam_cast.adaptation.priors.feature_priors import Affine
from wam_cast.cli.work import campaigning

WORDS = ("--robot", "robot.yaml", "--cup", "0.75", "--cup", "0.5,0.3", "--out", "my campaign")


@pytest.fixture(autouse=True)
def robots(folder, monkeypatch, robot_by_formula):
    """Write a robot's file; it casts by formula, and what is believed of it needs no simulation. Return the beliefs asked for."""
    asked = []

    def from_prior(robots, believed):
        asked.append(robots.believed)
        return AdaptiveModel(believed, Affine(robots.believed, scale=4.0))

    (folder / "robot.yaml").write_text("string: {length: 0.61}\nnoise: {swing: 0.005}\n", encoding="utf-8")
    (folder / "belief.yaml").write_text("cup: {restitution: 0.6}\n", encoding="utf-8")
    monkeypatch.setattr(AdaptiveModel, "from_prior", from_prior, raising=False)
    return asked


@pytest.fixture
def never_caught(monkeypatch):
    simulate = robot.simulate_cast

    def missed(*given, **options):
        outcome = simulate(*given, **options)
        outcome.is_caught, outcome.status = False, wc.Status.RIM_BOUNCE
        outcome.limits_hit = ("joint 4 speed",)
        return outcome

    monkeypatch.setattr(robot, "simulate_cast", missed)


def interrupt_at(monkeypatch, n_casts, error=KeyboardInterrupt):
    simulate, made = robot.simulate_cast, []

    def interrupted(*given, **options):
        if len(made) == n_casts:
            raise error
        made.append(given)
        return simulate(*given, **options)

    monkeypatch.setattr(robot, "simulate_cast", interrupted)
    return simulate


def test_a_line_a_cast_and_how_many_were_caught(cli, terminal_of):
    terminal_of(80)
    result = cli("learn", *WORDS, "--casts", "4")
    assert (result.code, result.err) == (0, "")
    lines = result.out.splitlines()
    assert max(map(len, lines)) <= 80
    assert lines[0].split() == ["cast", "cup", "predicted", "observed", "miss", "status"]
    assert lines[1].split() == ["[m]", "miss", "[mm]", "landing", "[m]", "[mm]"]
    rows = [line.split() for line in lines[2:6]]
    assert [row[0] for row in rows] == ["1", "2", "3", "4"]
    assert [row[1:3] for row in rows] == [["0.7500,", "0.0000"], ["0.5000,", "0.3000"]] * 2
    assert [row[-1] for row in rows] == ["long", "caught", "caught", "caught"]
    assert all(lines[2:6][i].index(row[1]) == lines[0].index("cup") for i, row in enumerate(rows))
    assert lines[-1] == "3 of 4 caught, the first of them cast 2"


def test_a_narrow_terminal_has_a_line_for_each_value(cli, terminal_of):
    terminal_of(50)
    lines = cli("learn", *WORDS, "--casts", "1").out.splitlines()
    assert lines[:2] == ["cast: 1", "cup [m]: 0.7500, 0.0000"]
    assert lines[5:7] == ["status: long", ""]


def test_the_answer_is_no_if_nothing_was_caught(cli, never_caught):
    result = cli("learn", *WORDS, "--casts", "1")
    assert result.code == 1
    assert "cast 1: the arm met the limit of joint 4 speed\n" in result.out
    assert (
        "cup 0.7500, 0.0000: the last cast was not predicted to end in it for sure (the model does not know"
        in result.out
    )
    assert result.out.endswith("0 of 1 caught\n")


def test_cameras_look_if_they_are_asked_and_what_they_miss_is_told(cli, folder, monkeypatch):
    made = []

    class Seen:
        def __init__(self, truth, belief, *, seed, observe):
            made.append((truth.string.length, seed, observe))

        def cast(self, cast, cup=None):
            landing = [0.7, 0.01] if len(made) == 1 else [float("nan")] * 2
            made.append(cast)
            return wc.Observation(cast, landing, 0.0004 if landing[0] == 0.7 else 1.0, None, "long", ())

    monkeypatch.setattr(robot, "SimulatedRobot", Seen)
    result = cli("learn", *WORDS, "--casts", "2", "--observe", "camera", "--json")
    assert made[0] == (0.61, 0, "camera")
    record = json.loads(result.out)
    assert record["observe"] == "camera"
    assert [one["landing"] for one in record["casts"]] == [[0.7, 0.01], [None, None]]
    assert [one["landing_std"] for one in record["casts"]] == [0.0004, 1.0]
    other = cli("learn", *WORDS, "--casts", "2")
    assert other.code == 2
    assert "another observe ('camera', not 'direct')" in other.err
    assert "no landing was seen" not in cli("learn", *WORDS, "--casts", "2", "--observe", "camera").out
    blind = cli("learn", *WORDS[:-1], "blind", "--casts", "2", "--observe", "camera").out.splitlines()
    words = (
        "no landing was seen in any cast, so that nothing was learned; see that the cameras of robot.yaml look there"
    )
    assert blind[-2:] == [words, "0 of 2 caught"]


def test_json_is_the_log(cli, folder):
    result = cli("learn", *WORDS, "--casts", "3", "--seed", "5", "--json")
    assert result.code == 0
    record = json.loads(result.out)
    assert {name: value for name, value in record.items() if name != "casts"} == {
        "directory": "my campaign",
        "method": "prior",
        "observe": "direct",
        "seed": 5,
        "n_caught": 2,
        "first_caught": 2,
    }
    log = pd.read_parquet(folder / "my campaign" / "log.parquet")
    for one, (_, row) in zip(record["casts"], log.iterrows(), strict=True):
        assert one["cast"] == row[["distance", "speed", "wait", "bearing"]].to_dict()
        for name, columns in (
            ("cup", ["cup_x", "cup_y"]),
            ("landing", ["landing_x", "landing_y"]),
            ("predicted_landing", ["predicted_x", "predicted_y"]),
            ("predicted_std", ["predicted_std_along", "predicted_std_across"]),
        ):
            assert one[name] == list(row[columns])
        for name in ("number", "miss", "status", "is_caught", "is_feasible", "reason", "landing_std"):
            assert one[name] == row[name]
        assert one["predicted_miss"] < 1e-3
    page = (Path(wc.__file__).parents[1] / "docs" / "command_line.md").read_text(encoding="utf-8")
    _, section = page.split("`learn --json` prints one object")
    explained = re.findall(r"`(\w+)`", section.split("```")[0])
    assert {*record, *record["casts"][0]} <= set(explained)


@pytest.mark.parametrize("error", [KeyboardInterrupt, OSError("bus off")], ids=["Ctrl-C", "fault"])
def test_an_interrupted_campaign_goes_on_to_the_same_campaign(cli, monkeypatch, error):
    words = (*WORDS, "--casts", "3", "--scenario", "belief.yaml", "--seed", "2")
    whole = cli("learn", *words, "--out", "whole", "--json")
    simulate = interrupt_at(monkeypatch, 2, error)
    result = cli("learn", *words)
    assert result.code == (130 if error is KeyboardInterrupt else 2)
    said, command = result.err.splitlines()[0].split(" Go on with: wam-cast ")
    assert said == "2 of 3 casts are kept in my campaign."
    assert result.out.splitlines()[-1].split()[0] == "2"

    monkeypatch.setattr(robot, "simulate_cast", simulate)
    again = cli(*shlex.split(command), "--json")
    assert (again.code, again.err) == (0, "")
    assert json.loads(again.out) == json.loads(whole.out) | {"directory": "my campaign"}


def test_what_is_believed_is_the_reference_with_the_robots_noise_or_what_is_said(cli, robots):
    cli("learn", *WORDS, "--casts", "1")
    cli("learn", *WORDS[:-1], "other", "--casts", "1", "--scenario", "belief.yaml")
    assert robots == [wc.Scenario(noise={"swing": 0.005}), wc.Scenario.from_yaml("belief.yaml")]


def test_ways_to_learn_are_those_of_the_api():
    (names, _) = get_args(campaigning.Method)
    assert set(get_args(names)) == set(ADAPTATION_METHODS)


def test_whoever_learns_nothing_casts_the_same_again(cli):
    casts = json.loads(cli("learn", *WORDS[:4], *WORDS[-2:], "--casts", "2", "--method", "nominal", "--json").out)[
        "casts"
    ]
    assert casts[0]["cast"] == casts[1]["cast"]


@pytest.mark.parametrize(
    ("words", "parts"),
    [
        (WORDS[2:], ["--robot"]),
        (WORDS[:2] + WORDS[-2:], ["--cup"]),
        (WORDS[:-2], ["--out"]),
        ((*WORDS, "--casts", "0"), ["--casts", "1"]),
        ((*WORDS, "--seed", "-1"), ["--seed", "0"]),
        ((*WORDS, "--method", "magic"), ["--method", "magic", "residual"]),
        ((*WORDS, "--cup", "a"), ["--cup 'a'", "such as --cup 0.75"]),
        ((*WORDS, "--cup", "3"), ["out of reach"]),
        ((*WORDS, "--robot", "none.yaml"), ["scenario none.yaml"]),
        ((*WORDS, "--scenario", "none.yaml"), ["scenario none.yaml"]),
        ((*WORDS, "--scenario", "robot.yaml"), ["scenario robot.yaml has no model yet", "wam-cast generate"]),
        ((*WORDS, "--model", "none.model"), ["none.model", "wam-cast fit"]),
        ((*WORDS, "--out", "robot.yaml"), ["robot.yaml", "choose a directory"]),
        ((*WORDS, "--out", "."), [". holds belief.yaml and no campaign"]),
    ],
)
def test_wrong_input_gets_one_line_before_any_cast(cli, robot_by_formula, words, parts):
    result = cli("learn", *words)
    assert result.code == 2
    (line,) = result.err.splitlines()
    assert line.startswith("error: ")
    for part in parts:
        assert part in line
    assert not robot_by_formula


def test_another_campaign_is_refused(cli):
    assert cli("learn", *WORDS, "--casts", "2").code == 0
    for words, said in (
        (("--seed", "1"), "another seed (0, not 1)"),
        (("--cup", "0.6"), "another cups"),
        (("--method", "affine"), "another method ('prior', not 'affine')"),
        (("--casts", "1"), "a campaign of 2 casts"),
        (("--robot", "belief.yaml"), "another robot.string.length (0.61, not 0.6)"),
    ):
        result = cli("learn", *WORDS, "--casts", "2", *words)
        assert (result.code, result.out, result.err.count("\n")) == (2, "", 1)
        assert f"my campaign holds {said}" in result.err.replace("a campaign with another", "another")
