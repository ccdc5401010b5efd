"""`wam-cast check` as its user meets it, and how other commands ask first; what it computes is tested with the preview itself."""

import json
import math

import numpy as np
import pandas as pd
import pytest

import wam_cast as wc
from wam_cast.cli import check, model_choice
from wam_cast.experiments.preview import Preview
from wam_cast.experiments.preview_verdict import Fate, Verdict
from wam_cast.storage.dataset_directory import DatasetDirectory

GOOD = Verdict(True, "2 of 3 casts could be caught", ("1 of 3 casts diverged: lower bounds.speed",))
BAD = Verdict(
    False, "no cast could be caught; the string is taut at the landing in 3 of 3: shorten motion.drop_duration"
)


def preview_of(scenario, verdict):
    casts = pd.DataFrame(
        {
            "status": ["landed", "landed", "diverged"],
            "fate": [Fate.GOOD, Fate.GOOD, Fate.DIVERGED] if verdict.can_work else [Fate.TAUT] * 3,
            "landing_along": [0.5, 0.8, math.nan],
            "is_slack": [True, True, False],
        }
    )
    peaks = np.array([0.1, 0.6, 0.2, 0.1, 0.0, 0.0, 0.0])
    return Preview(scenario, casts, peaks, peaks / 2, step=0.002, cast_time=0.5, verdict=verdict)


@pytest.fixture
def asked(monkeypatch):
    """Answer without physics: only the reference scenario can work. Returns which scenarios were asked about."""
    scenarios = []

    def preview(scenario, **_):
        scenarios.append(scenario)
        return preview_of(scenario, GOOD if scenario == wc.Scenario() else BAD)

    monkeypatch.setattr(wc, "preview_scenario", preview, raising=False)
    return scenarios


@pytest.fixture
def bad(folder):
    (folder / "bad.yaml").write_text("motion: {drop_duration: 0.8}", encoding="utf-8")
    return ("--scenario", "bad.yaml")


def test_check_prints_what_was_found_with_units_and_a_plain_word(cli, asked):
    result = cli("check")
    assert (result.code, result.err) == (0, "")
    for part in (
        *(
            "0.250 to 0.600",
            "0.800 to 0.350",
            "0.500 to 0.800",
            "2 landed, 1 diverged",
            "60 % (joint 2)",
            "30 % (joint 2)",
        ),
        *("[m]", "[deg]", "[ms]", "[s]", "1700 casts", "about"),
    ):
        assert part in result.out
    *_, verdict, remark = result.out.splitlines()
    assert verdict == "this scenario can work: 2 of 3 casts could be caught"
    assert remark == "but: 1 of 3 casts diverged: lower bounds.speed"


def test_a_scenario_that_cannot_work_gives_1(cli, asked, bad):
    result = cli("check", *bad)
    assert (result.code, result.err) == (1, "")
    assert result.out.splitlines()[-1] == f"this scenario cannot work: {BAD.reason}"
    assert "where a cup can stand [m]" in result.out
    result = cli("check", *bad, "--json")
    assert result.code == 1
    record = json.loads(result.out)
    assert (record["can_work"], record["reason"], record["n_good"]) == (False, BAD.reason, 0)
    assert record["n_training_casts"] == model_choice.TRAINING_CASTS


def test_json_is_the_previews_record(cli, asked):
    record = json.loads(cli("check", "--json").out)
    assert record == preview_of(wc.Scenario(), GOOD).record(model_choice.TRAINING_CASTS)
    assert record["cups"] == [0.5, 0.8]


def test_the_picture_is_written_and_named(cli, folder, asked):
    assert "the picture is in a.png" in cli("check", "--picture", "a.png").out
    assert (folder / "a.png").read_bytes().startswith(b"\x89PNG")
    assert json.loads(cli("check", "--picture", "a.svg", "--json").out)["picture"] == "a.svg"


@pytest.mark.parametrize(
    ("words", "part"),
    [
        (("--picture", "a.jpg"), ".pdf, .png, .svg"),
        (("--picture", "missing/a.png"), "existing folder"),
        (("--scenario", "missing.yaml"), "name a readable YAML file"),
    ],
)
def test_wrong_input_is_refused_before_the_casts(cli, asked, words, part):
    result = cli("check", *words)
    assert (result.code, result.out, asked) == (2, "", [])
    assert result.err.count("\n") == 1
    assert part in result.err


@pytest.mark.parametrize(
    "words",
    ["generate --casts 40 --out d", "reproduce --quick --out d", "throw --cup 0.7 --train", "plan --cup 0.7 --train"],
)
def test_work_on_a_scenario_that_cannot_work_does_not_begin(cli, folder, asked, bad, words, monkeypatch):
    monkeypatch.setattr(
        model_choice, "find", lambda path, _: model_choice.Found(model_choice.load_scenario(path), None)
    )
    result = cli(*words.split(), *bad)
    assert (result.code, result.out) == (2, "")
    expected = f"error: scenario bad.yaml cannot work: {BAD.reason}; see `wam-cast check --scenario bad.yaml`\n"
    assert result.err == expected
    assert [path.name for path in folder.iterdir()] == ["bad.yaml"]


def test_work_that_has_begun_is_not_asked_about_again(asked, folder):
    work = folder / "d"
    check.require_workable(wc.Scenario(), None, DatasetDirectory, work)
    assert len(asked) == 1
    work.mkdir()
    (work / "manifest.json").write_text("{}")
    check.require_workable(wc.Scenario(), None, DatasetDirectory, work)
    assert len(asked) == 1


@pytest.mark.parametrize("command", ["generate --casts 40", "reproduce --quick"])
@pytest.mark.parametrize(
    ("directory", "part"), [("full", "holds thesis.tex and no"), ("full/thesis.tex/d", "directory")]
)
def test_a_directory_that_cannot_serve_is_refused_before_the_casts(
    cli, folder, asked, monkeypatch, command, directory, part
):
    monkeypatch.setattr(model_choice, "require_workable", check.require_workable)
    (folder / "full").mkdir()
    (folder / "full" / "thesis.tex").write_text("")
    result = cli(*command.split(), "--out", directory)
    assert (result.code, result.out, asked) == (2, "", [])
    assert result.err.count("\n") == 1
    assert part in result.err


def test_a_dataset_is_asked_about_once(cli, no_physics, asked, monkeypatch):
    monkeypatch.setattr(model_choice, "require_workable", check.require_workable)
    for n_casts in (40, 40, 60):
        assert cli("generate", "--casts", n_casts, "--out", "d").code == 0
    assert asked == [wc.Scenario()]


@pytest.mark.slow
def test_a_real_check_takes_seconds(cli, folder):
    result = cli("check", "--json", "--picture", "a.png")
    record = json.loads(result.out)
    assert (result.code, record["n_casts"], record["can_work"]) == (0, 30, True)
    assert record["n_good"] >= 25
    assert record["cups"][0] < 0.45 < 0.85 < record["cups"][1]
    assert 30 * record["cast_s"] < 60
