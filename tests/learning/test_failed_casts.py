"""Failed casts: counted, told apart by whether they are learned from, and never dropped without a word."""

import numpy as np
import pandas as pd
import pytest

from wam_cast.errors import InputError
from wam_cast.learning.dataset import CastDataset
from wam_cast.learning.parts import describe_failed_casts, failed_casts, split_casts
from wam_cast.planning.prediction import OUTPUTS
from wam_cast.scenario import Scenario


def dataset(*statuses):
    """Return a dataset of casts that ended so; those that diverged or never crossed have no landing."""
    frame = pd.DataFrame({"cast": range(len(statuses)), "status": statuses, "is_slack": True})
    for name in ("distance", "speed", "wait", *OUTPUTS):
        frame[name] = np.where(frame["status"].isin(["diverged", "never_crossed"]) & (name in OUTPUTS), np.nan, 0.5)
    return CastDataset(Scenario(), 0, frame)


def test_casts_that_landed_are_no_failures():
    assert failed_casts(dataset("landed", "landed")) == {}
    assert describe_failed_casts(dataset("landed", "landed")) == []


def test_failed_casts_are_counted_and_told_what_mends_them():
    data = dataset("landed", "diverged", "never_crossed", "diverged", "limit_hit")
    assert failed_casts(data) == {
        "diverged": {"casts": 2, "learned": 0},
        "never_crossed": {"casts": 1, "learned": 0},
        "limit_hit": {"casts": 1, "learned": 1},
    }
    diverged, never_crossed, limit_hit = describe_failed_casts(data)
    assert diverged.startswith("2 of 5 casts diverged (not learned from)")
    assert "controller.kp" in diverged
    assert "motion.drop_distance" in never_crossed
    assert limit_hit.startswith("1 of 5 casts limit_hit (1 of them landed and are learned from)")


def test_every_cast_that_is_not_learned_from_is_a_failure():
    data = dataset(*["landed"] * 30, *["diverged", "never_crossed", "limit_hit", "landed"] * 10)
    parts = split_casts(data)
    n_learned = len(parts.train.X) + len(parts.validation.X) + parts.n_test
    n_not_learned = sum(counts["casts"] - counts["learned"] for counts in failed_casts(data).values())
    assert n_learned + n_not_learned == len(data)


def test_dataset_of_failures_says_why_nothing_is_learned():
    with pytest.raises(InputError, match=r"40 of 40 casts diverged .*controller\.kp"):
        split_casts(dataset(*["diverged"] * 40))
