"""The experiment on unknown robots, in the small: what it keeps, and that it comes out the same."""

import json
from dataclasses import replace
from typing import get_type_hints

import numpy as np
import pandas as pd
import pytest

from wam_cast.cli.work import transferring
from wam_cast.errors import InputError
from wam_cast.experiments.transfer import transfer as experiment
from wam_cast.experiments.transfer import transfer_settings
from wam_cast.experiments.transfer.one_robot import UnknownRobot
from wam_cast.experiments.transfer.transfer_settings import MOST_CUPS, MOST_ROBOTS, OUT_OF_RANGE, TransferSettings
from wam_cast.scenario import Scenario

TINY = {"n_robots": 1, "n_cups": 2, "n_compared_cups": 1, "ks": (0, 1), "longest_campaign": 2}
METHODS = ("nominal", "prior")


def test_groups_hold_what_they_say():
    once, twice, beyond = TransferSettings.of(Scenario(), 0, quick=True).groups
    believed = once.draw(0, 5)
    doubled = twice.draw(0, 5)
    assert doubled.string.length - 0.6 == pytest.approx(2 * (believed.string.length - 0.6))
    lengths = [beyond.draw(number, 5).string.length / 0.6 for number in range(2)]
    assert lengths == pytest.approx([0.9, 1.08])
    assert beyond.draw(3, 5).ball.mass == pytest.approx(2 * Scenario().ball.mass)
    assert beyond.expected == once.expected
    assert len(beyond.kinds) == len(OUT_OF_RANGE)


@pytest.mark.parametrize(("name", "most"), [("n_robots", 10_000), ("n_cups", 1000)])
def test_so_many_robots_and_cups_and_no_more(tmp_path, name, most):
    assert getattr(TransferSettings.of(Scenario(), 0, True, **{name: most}), name) == most
    for value in (most + 1, 10**30):
        with pytest.raises(InputError, match=rf"{name} = {value} must be {most} at most"):
            experiment.transfer(Scenario(), tmp_path / "run", **{name: value})
    assert not (tmp_path / "run").exists()


def test_the_most_that_the_command_line_takes_is_what_the_experiment_takes():
    hints = get_type_hints(transferring.transfer, include_extras=True)
    assert hints["robots"].__metadata__[0].max == MOST_ROBOTS
    assert hints["cups"].__metadata__[0].max == MOST_CUPS


def test_no_two_cups_have_the_same_noise():
    last, first = (MOST_ROBOTS - 2, MOST_CUPS - 1), (MOST_ROBOTS - 1, 0)
    numbers = [1_000_003 + 1000 * number + cup for number, cup in (last, first)]
    assert 2 * MOST_ROBOTS < 1_000_003 < numbers[0] < numbers[1]


@pytest.mark.slow
def test_a_run_is_kept_robot_by_robot_and_goes_on_to_the_same_report(tmp_path, monkeypatch, pickling_executor):
    pytest.importorskip("jax", reason="the extra `batch` is not installed")
    monkeypatch.setattr(transfer_settings, "QUICK", TINY)
    monkeypatch.setattr(transfer_settings, "ADAPTATION_METHODS", METHODS)
    monkeypatch.setattr(experiment, "N_RADII", 2)  # a plan for each takes half a second
    known, learn = [], experiment._Knowledge.of

    def remembered(*given):
        known.append(learn(*given))
        return known[-1]

    monkeypatch.setattr(experiment._Knowledge, "of", remembered)
    options = {"quick": True, "engine": "batch", "executor": pickling_executor}  # processes would compile it all anew
    first = experiment.transfer(Scenario(), tmp_path / "run", 3, **options)
    report = (tmp_path / "run" / "report.md").read_bytes()
    results = json.loads((tmp_path / "run" / "results.json").read_text())
    assert len(results["plans"]) == len(first.plans) == 3 * (2 + (2 + 1))
    assert {row["method"] for row in results["bias"]} == set(METHODS)
    assert (tmp_path / "run" / "report.html").stat().st_size > 50_000
    (tmp_path / "run" / "phases" / "x2-000.json").unlink()
    studied = []
    study = UnknownRobot.study
    monkeypatch.setattr(UnknownRobot, "study", lambda robot: studied.append(robot.number) or study(robot))
    again = experiment.transfer(Scenario(), tmp_path / "run", 3, **options)
    assert studied == [0]  # that one alone
    names = [one.group.name for one in known]
    assert names == [
        "x1",
        "x2",
        "x2",
    ]  # and nothing is learned of the others once more, nor out of range what x1 has learned
    pd.testing.assert_frame_equal(again.plans, first.plans, check_dtype=False)
    assert (tmp_path / "run" / "report.md").read_bytes() == report

    # The batched engine has brought casts near their cups, and the same becomes of them as in Drake the whole way.
    settings = replace(TransferSettings.of(Scenario(), 3, quick=True), ks=(0,), longest_campaign=0)
    by_drake = replace(known[0], settings=settings, practice=[]).study(0).plans
    is_compared = (first.plans["group"] == "x1") & (first.plans["k"] == 0)
    by_batch = first.plans.loc[is_compared, by_drake.columns].reset_index(drop=True)
    assert len(by_batch) == 4
    told = [name for name in by_batch if name.startswith("status")]
    pd.testing.assert_frame_equal(by_batch[told], by_drake[told])
    np.testing.assert_allclose(by_batch["bias"], by_drake["bias"], rtol=0, atol=5e-6)
    np.testing.assert_allclose(
        by_batch["miss"], by_drake["miss"], rtol=0, atol=3e-4
    )  # encoders: see docs/howto/batch.md
