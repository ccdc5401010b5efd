"""A dataset's parts: what is in them, and the seal on the test part."""

import numpy as np
import pandas as pd
import pytest

from wam_cast.cast import PARAMETERS
from wam_cast.errors import InputError
from wam_cast.learning.dataset import CastDataset
from wam_cast.learning.forward_model import ForwardModel
from wam_cast.learning.parts import describe_failed_casts, failed_casts, split_casts
from wam_cast.planning.prediction import OUTPUTS
from wam_cast.scenario import Scenario

N_CASTS = 340  # split into 260, 60 and 20
COLUMNS = [*PARAMETERS, *OUTPUTS]


def dataset(n_casts=N_CASTS, lost=()):
    values = np.random.default_rng(0).uniform(size=(n_casts, len(COLUMNS)))
    frame = pd.DataFrame(values, columns=COLUMNS).assign(status="landed", is_slack=True)
    frame.loc[list(lost), list(OUTPUTS)] = np.nan
    frame.loc[list(lost), "status"] = "never_crossed"
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


READERS = [split_casts, failed_casts, describe_failed_casts, ForwardModel.fit]


@pytest.mark.parametrize("read", READERS)
def test_a_frame_without_a_column_is_one_line(read):
    frame = pd.DataFrame({name: np.zeros(40) for name in (*PARAMETERS, "landing_along")})
    with pytest.raises(InputError, match=r"its frame has no column landing_across, entry_angle, .*status, is_slack"):
        read(CastDataset(Scenario(), 0, frame))


@pytest.mark.parametrize("read", READERS)
@pytest.mark.parametrize(
    ("column", "value", "said"),
    [
        ("distance", np.nan, "column distance of its frame is .*nan.* in row 3; it must be a number from 0 to 100"),
        ("wait", -np.inf, "column wait of its frame is .*-inf.* in row 3"),
        ("slack", np.inf, "column slack of its frame is .*inf.* in row 3; it must be a number from -10000 to 10000"),
        ("speed", "fast", "column speed of its frame is of type .*, no number"),
        ("landing_along", [1, 2], "column landing_along of its frame is of type object, no number"),
        (
            "status",
            "Landed",
            "column status of its frame is 'Landed' in row 3; it must be one of landed, never_crossed, ",
        ),
        ("status", None, "column status of its frame is .* in row 3"),
        ("is_slack", np.nan, "column is_slack of its frame is nan in row 3; it must be one of True, False"),
        ("landing_along", 1e300, r"column landing_along of its frame is .*1e\+300.* in row 3"),
        ("distance", 1e200, "column distance of its frame is .* in row 3; it must be a number from 0 to 100"),
        ("wait", -0.1, "column wait of its frame is .*-0.1.* in row 3; it must be a number from 0 to 300"),
        ("entry_angle", 90.0, "column entry_angle of its frame is .*90.* in row 3; it must be a number from 0 to 3.15"),
        ("peak_torque_utilization", -5.0, "column peak_torque_utilization of its frame is .*-5.* in row 3"),
        ("peak_torque_utilization", np.nan, "column peak_torque_utilization .* in row 3; .*, of a cast that landed"),
        ("slack", np.nan, "column slack of its frame is .*nan.* in row 3; .*, of a cast that landed"),
        ("status", "diverged", "column landing_along of its frame is .* in row 3; it must be nan, of a cast that did"),
        ("status", "never_crossed", "column landing_along of its frame is .* in row 3; it must be nan"),
        ("is_slack", "yes", "column is_slack of its frame is 'yes' in row 3"),
    ],
)
def test_a_value_that_cannot_be_learned_from_is_one_line(read, column, value, said):
    data = dataset()
    data.frame[column] = data.frame[column].astype(object)
    data.frame.at[3, column] = value
    with pytest.raises(InputError, match=said) as caught:
        read(data)
    assert "\n" not in str(caught.value)


def test_a_column_that_is_there_twice_is_one_line():
    frame = dataset().frame
    with pytest.raises(InputError, match="its frame has 2 columns slack; keep one of them"):
        split_casts(CastDataset(Scenario(), 0, pd.concat([frame, frame[["slack"]]], axis=1)))


def test_columns_of_other_types_with_the_same_values_are_the_same_parts():
    data = dataset(lost=[2, 300])
    same = data.frame.convert_dtypes().astype({"status": "category", "is_slack": float})
    one, other = split_casts(data), split_casts(CastDataset(Scenario(), 0, same))
    for name in ("train", "validation"):
        for left, right in zip(getattr(one, name), getattr(other, name), strict=True):
            np.testing.assert_array_equal(left, right)
