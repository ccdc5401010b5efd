"""Groups of values that go to JSON and come back as they were: pydantic models that may hold pandas frames and arrays.

A number that does not exist (the landing of a ball that never came down) is nan here and null in JSON, which knows no nan.
"""

from __future__ import annotations

import json
import math
from collections.abc import Sequence
from typing import Annotated, Any

import numpy as np
import pandas as pd
import pydantic_core
from pydantic import BaseModel, ConfigDict, PlainSerializer, PlainValidator

from wam_cast.types import Array

Record = dict[str, Any]
"""Values by their names."""


class Result(BaseModel):
    """A frozen group of values."""

    model_config = ConfigDict(frozen=True, extra="forbid")


def records(frame: pd.DataFrame) -> list[Record]:
    """Return the rows of a frame."""
    return [{str(name): value for name, value in row.items()} for row in frame.to_dict("records")]


def _from_rows(rows: pd.DataFrame | Sequence[Record]) -> pd.DataFrame:
    if isinstance(rows, pd.DataFrame):
        return rows
    return pd.DataFrame([{name: _known(value) for name, value in row.items()} for row in rows])


def _from_columns(columns: pd.DataFrame | dict[str, list[Any]]) -> pd.DataFrame:
    if isinstance(columns, pd.DataFrame):
        return columns
    return pd.DataFrame({name: [_known(value) for value in values] for name, values in columns.items()})


def _known(value: Any) -> Any:
    return math.nan if value is None else value


Rows = Annotated[pd.DataFrame, PlainValidator(_from_rows), PlainSerializer(records, return_type=list)]
"""A frame that is a list of its rows in JSON, each with the names of the columns."""

Columns = Annotated[
    pd.DataFrame, PlainValidator(_from_columns), PlainSerializer(lambda frame: frame.to_dict("list"), return_type=dict)
]
"""A frame that is a list for each column in JSON."""

Values = Annotated[
    Array,
    PlainValidator(lambda values: np.array(values, dtype=float)),
    PlainSerializer(lambda array: array.tolist(), return_type=list),
]
"""Numbers, of any shape."""


def to_plain(content: Any) -> Any:
    """Return models, mappings and sequences as what JSON knows, None for a number that does not exist or is not finite."""
    return json.loads(pydantic_core.to_json(content, inf_nan_mode="null"))
