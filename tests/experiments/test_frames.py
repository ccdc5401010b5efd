"""Frames: to JSON and back as they were."""

import math

import pandas as pd
import pytest
from pydantic import TypeAdapter, ValidationError

from wam_cast.experiments.frames import Columns, Rows

FRAME = pd.DataFrame(
    {
        "name": ["a", "b"],
        "n": [1, 2],
        "is_caught": [True, False],
        "miss": [0.5, math.nan],
        "nothing": math.nan,
        "limits": [["joint 4"], []],
    }
)


@pytest.mark.parametrize(("kind", "other"), [(Rows, Columns), (Columns, Rows)])
def test_a_frame_comes_back_as_it_was_and_from_its_own_kind_of_json_only(kind, other):
    text = TypeAdapter(kind).dump_json(FRAME)
    assert b"NaN" not in text
    pd.testing.assert_frame_equal(TypeAdapter(kind).validate_json(text), FRAME)
    with pytest.raises(ValidationError, match="neither a frame nor a"):
        TypeAdapter(other).validate_json(text)
