"""What a status must have and must not have: each value by itself, and whatever a range allows."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from wam_cast.cast import PARAMETERS
from wam_cast.storage.cast_values import LANDED, LEARNED_PEAKS, PEAKS, RANGES, STATUSES, first_wrong
from wam_cast.storage.casts_part import SCHEMA

NAN, N = np.nan, 5


def casts(status, **changes):
    """Return five casts that ended so, with other values in row 3."""
    never_lands = status in ("never_crossed", "diverged")
    columns = {name: np.full(N, NAN if never_lands and name in LANDED else 0.5) for name in RANGES}
    for name, value in changes.items():
        columns[name][3] = value
    return columns, np.full(N, status, dtype=object)


def test_every_number_of_a_dataset_has_a_range():
    assert list(RANGES) == [field.name for field in SCHEMA if field.type == "double"]
    assert {*PARAMETERS, *LANDED, *PEAKS} == set(RANGES)


@given(status=st.sampled_from(STATUSES), data=st.data())
def test_what_a_range_allows_is_a_cast(status, data):
    columns, statuses = casts(status)
    for name, values in columns.items():
        if not np.isnan(values[3]):
            values[3] = data.draw(st.floats(*RANGES[name]))
    assert first_wrong(columns, statuses) is None


@pytest.mark.parametrize("status", STATUSES)
@pytest.mark.parametrize("name", RANGES)
def test_a_value_that_a_status_cannot_have_is_named(status, name):
    never_lands = status in ("never_crossed", "diverged")
    must_be_there = name in PARAMETERS or (not never_lands and name in LANDED + LEARNED_PEAKS)
    beyond = -1.001 * RANGES[name][1]
    for value, is_wrong in {
        np.inf: True,
        -np.inf: True,
        beyond: not (status == "diverged" and name in PEAKS),
        NAN: must_be_there,
        0.25: never_lands and name in LANDED,
    }.items():
        found = first_wrong(*casts(status, **{name: value}))
        assert (found is not None) == is_wrong, value
        if found is not None:
            assert (found.column, found.row) == (name, 3)


def test_a_cast_that_met_a_limit_landed_or_did_not():
    nowhere = dict.fromkeys(LANDED, NAN)
    assert first_wrong(*casts("limit_hit", **nowhere)) is None
    assert first_wrong(*casts("limit_hit", **nowhere, **dict.fromkeys(PEAKS, NAN))) is None
    found = first_wrong(*casts("limit_hit", **nowhere | {"slack": 0.1}))
    assert found.column == "landing_along"
    assert "of a cast that landed" in found.rule
