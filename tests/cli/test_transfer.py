"""`wam-cast transfer` as its user meets it; what the experiment does is tested with the experiment itself."""

import json
import shlex

import pandas as pd
import pytest

from wam_cast.experiments.transfer import transfer as experiment
from wam_cast.experiments.transfer.one_robot import RobotStudy, UnknownRobot
from wam_cast.experiments.transfer.transfer_report import write_report
from wam_cast.experiments.transfer.transfer_settings import CUPS

WORDS = ("transfer", "--quick", "--out", "robots")


def plan(k):
    return {
        "method": "prior",
        "k": k,
        "cup": 0,
        "radius": 0.6,
        "distance": 0.2,
        "speed": 0.5,
        "wait": 0.4,
        "cast_bearing": 0.0,
        "is_feasible": True,
        "error_along": 0.004,
        "error_across": 0.001,
        "std_along": 0.004,
        "std_across": 0.002,
        "bias": 0.0042 + 0.001 * k,
        "miss": 0.005,
        **dict.fromkeys((f"status: {name}" for name in CUPS), "caught"),
    }


@pytest.fixture(autouse=True)
def robots(monkeypatch):
    """Study robots in no time and in this process, and return which; what is known of them is nothing, and nothing is drawn."""
    studied = []
    monkeypatch.setattr(experiment, "write_report", lambda *_: None)

    def study(robot):
        studied.append(robot.number)
        return RobotStudy(plans=pd.DataFrame([plan(0), plan(5)]), first_catch=1, streak_end=10, n_casts=10)

    monkeypatch.setattr(UnknownRobot, "study", study)
    monkeypatch.setattr(experiment, "adaptive_model", lambda *_: None)
    monkeypatch.setattr(experiment, "choose_practice", lambda *_: [])
    monkeypatch.setattr(experiment._Knowledge, "of", lambda *given: experiment._Knowledge(*given[:2], {}, []))
    monkeypatch.setattr(experiment, "run_rows", lambda function, rows, _executor: (function(row) for row in rows))
    return studied


@pytest.mark.slow
def test_it_prints_a_line_for_each_group_and_practice_and_writes_a_report(cli, folder, monkeypatch):
    monkeypatch.setattr(experiment, "write_report", write_report)
    result = cli(*WORDS)
    assert (result.code, result.err.splitlines()) == (0, ["what is known", "robots"])
    assert "x2" in result.out
    assert "4.2" in result.out
    assert "2 of 2" in result.out
    for name in ("report.md", "report.html", "results.json", "figures/bias.png", "figures/hit-rates.pdf"):
        assert (folder / "robots" / name).stat().st_size > 0
    monkeypatch.setattr(experiment, "write_report", lambda *_: None)
    tables = json.loads(cli(*WORDS, "--json").out)
    assert len(tables["campaigns"]) == 6
    assert {row["p95"] for row in tables["bias"]} == {0.0042, 0.0092}


def test_an_interrupted_run_keeps_the_robots_that_are_done_and_says_how_to_go_on(cli, monkeypatch, robots):
    study = UnknownRobot.study

    def interrupted(robot):
        if len(robots) == 4:
            raise KeyboardInterrupt
        return study(robot)

    monkeypatch.setattr(UnknownRobot, "study", interrupted)
    result = cli(*WORDS)
    assert result.code == 130
    command = result.err.split("Go on with: ")[1].splitlines()[0]
    monkeypatch.setattr(UnknownRobot, "study", study)
    assert cli(*shlex.split(command)[1:]).code == 0
    assert len(robots) == 6


def test_it_goes_on_to_more_robots_but_not_to_other_cups(cli, robots):
    assert cli(*WORDS, "--robots", "1").code == 0
    assert len(robots) == 3
    assert cli(*WORDS).code == 0
    assert sorted(robots) == [0, 0, 0, 1, 1, 1]
    assert "n_cups" in cli(*WORDS, "--cups", "3").err


@pytest.mark.parametrize(
    ("words", "line"),
    [
        (("--engine", "bullet"), "engine"),
        (("--seed", "-1"), "--seed"),
        (("--scenario", "none.yaml"), "none.yaml"),
        (("--workers", "0"), "--workers"),
        (("--workers", "1" + "0" * 30), "to 1000;"),
        (("--robots", "100000000"), "to 10000;"),
        (("--cups", "100000000"), "to 1000;"),
    ],
)
def test_what_cannot_be_is_one_line(cli, folder, words, line):
    result = cli(*WORDS, *words)
    assert result.code == 2
    assert line in result.err
    assert not (folder / "robots").exists()


def test_a_folder_of_something_else_is_left_alone(cli, folder):
    (folder / "robots").mkdir()
    (folder / "robots" / "mine.txt").write_text("mine")
    result = cli(*WORDS)
    assert result.code == 2
    assert "robots" in result.err
    assert [path.name for path in (folder / "robots").iterdir()] == ["mine.txt"]
    assert cli(*WORDS[:2], "--out", "others").code == 0
    assert "seed" in cli(*WORDS[:2], "--out", "others", "--seed", "4").err
