"""A dataset's parts: what is in them, and the seal on the test part."""

import numpy as np
import pandas as pd
import pytest

from wam_cast.cast import PARAMETERS
from wam_cast.errors import InputError
from wam_cast.learning.dataset import CastDataset
from wam_cast.learning.parts import split_casts
from wam_cast.planning.prediction import OUTPUTS
from wam_cast.scenario import Scenario

N_CASTS = 340  # split into 260, 60 and 20
COLUMNS = [*PARAMETERS, *OUTPUTS]


def dataset(n_casts=N_CASTS, lost=()):
    values = np.random.default_rng(0).uniform(size=(n_casts, len(COLUMNS)))
    frame = pd.DataFrame(values, columns=COLUMNS).assign(status="landed", is_slack=True)
    frame.loc[list(lost), list(OUTPUTS)] = np.nan
    return CastDataset(Scenario(), 0, frame)


def rows_of(part):
    return np.column_stack([part.X, part.y])


def test_parts_are_the_rows_of_the_dataset_in_order():
    data = dataset()
    parts = split_casts(data)
    assert parts.n_test == 20
    together = np.vstack([rows_of(part) for part in (parts.train, parts.validation, parts.open_test())])
    np.testing.assert_array_equal(together, data.frame[COLUMNS])
    assert (len(parts.train.X), len(parts.validation.X)) == (260, 60)


def test_casts_that_never_came_down_are_left_out_of_their_part():
    lost = [0, 259, 260, 339]
    parts = split_casts(dataset(lost=lost))
    test = parts.open_test()
    assert (len(parts.train.X), len(parts.validation.X), parts.n_test, len(test.y)) == (258, 59, 19, 19)
    together = np.vstack([rows_of(part) for part in (parts.train, parts.validation, test)])
    np.testing.assert_array_equal(together, dataset().frame[COLUMNS].drop(lost))


def test_the_test_part_is_opened_once():
    data = dataset()
    parts = split_casts(data)
    test = parts.open_test()
    with pytest.raises(RuntimeError, match="opened already"):
        parts.open_test()
    # Nothing of it is left to look at.
    kept = [value for value in vars(parts).values() if isinstance(value, tuple)]
    assert len(kept) == 2
    assert not any(np.shares_memory(array, other) for part in kept for array in part for other in test)


@pytest.mark.parametrize(
    ("lost", "said"), [(range(259), "1 training"), (range(260, 320), "0 validation"), (range(321, 340), "1 test")]
)
def test_a_part_with_nothing_to_learn_from_is_refused(lost, said):
    with pytest.raises(InputError, match=said):
        split_casts(dataset(lost=lost))
    with pytest.raises(InputError, match="at least 34"):
        split_casts(dataset(33))


def test_clean_casts_kept_the_limits_and_landed_with_a_slack_string():
    data = dataset()
    data.frame.loc[[3, 261], "status"] = "limit_hit"
    data.frame.loc[[3, 5], "is_slack"] = False
    parts = split_casts(data)
    for part, others in ((parts.train, [3, 5]), (parts.validation, [1]), (parts.open_test(), [])):
        assert part.is_clean.dtype == bool
        np.testing.assert_array_equal(np.flatnonzero(~part.is_clean), others)


def test_a_frame_without_a_column_is_one_line():
    frame = pd.DataFrame({name: np.zeros(40) for name in (*PARAMETERS, "landing_along")})
    with pytest.raises(InputError, match=r"its frame has no column landing_across, entry_angle, .*status, is_slack"):
        split_casts(CastDataset(Scenario(), 0, frame))
