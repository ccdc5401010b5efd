"""A dataset's three parts as arrays, the test part under seal, and what of it is not learned from."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from wam_cast.cast import PARAMETERS
from wam_cast.errors import InputError, quoted
from wam_cast.planning.prediction import OUTPUTS
from wam_cast.storage.cast_values import STATUSES, first_wrong
from wam_cast.types import Array

if TYPE_CHECKING:
    import pandas as pd

    from wam_cast.learning.dataset import CastDataset

COLUMNS = (*PARAMETERS, *OUTPUTS, "status", "is_slack")
"""What is learned from."""

WORDS = {"status": STATUSES, "is_slack": (True, False)}
"""What columns that hold no numbers can hold."""

REMEDIES = {
    "diverged": "the simulation diverged; choose lower controller.kp and kd, or a shorter simulation.max_step",
    "never_crossed": (
        "the ball never came down to the rim; choose a longer motion.drop_distance or string.length, or a lower "
        "cup.rim_height"
    ),
    "limit_hit": (
        "the arm met a limit; choose a longer motion.drop_duration, a lower bounds.speed, or lower controller.kp and kd"
    ),
}
"""What mends casts that end so, by status."""


class Part(NamedTuple):
    """Casts and what became of them."""

    X: Array
    """Parameters `[distance, speed, wait]` [m, m/s, s], shape (n, 3)."""
    y: Array
    """`.OUTPUTS`, shape (n, 7)."""
    is_clean: NDArray[np.bool_]
    """Whether the arm kept its limits and the string was slack at the landing, shape (n,)."""

    @property
    def landing(self) -> Array:
        """Landing along the casting plane [m], shape (n,): the paper's target."""
        return self.y[:, 0]


class Parts:
    """Training, validation and test casts of a dataset, without those that never came down to the rim plane.

    The test casts measure a choice that was made without them. They are handed out once, after all choices: to measure several
    models, choose all of them first. Models are fitted to `train` and chosen by `validation`; `n_test` is the number of test casts.
    """

    def __init__(self, train: Part, validation: Part, test: Part) -> None:
        self.train, self.validation = train, validation
        self.n_test = len(test.X)
        self._sealed: Part | None = test

    def open_test(self) -> Part:
        """Return the test casts. Raises `RuntimeError` from the second time on."""
        if self._sealed is None:
            raise RuntimeError("the test casts were opened already: what is chosen after that is not measured by them")
        test, self._sealed = self._sealed, None
        return test


def split_casts(data: CastDataset) -> Parts:
    """Split a dataset by index into training, validation and test casts as 1300 : 300 : 100.

    Raises
    ------
    InputError
        If it is no dataset, it lacks a column, a column holds what it cannot, there are fewer than 34 casts, or fewer than 2 casts
        of a part came down to the rim plane.
    """
    # Whoever has a dataset has loaded pandas; a model that was fitted before does without.
    from wam_cast.learning.dataset import CastDataset

    if not isinstance(data, CastDataset):
        raise InputError(f"data = {quoted(data)} must be a CastDataset")
    _check_frame(data.frame)
    train, validation, test = (_usable(data, rows) for rows in data.split())
    for name, part in (("training", train), ("validation", validation), ("test", test)):
        if len(part.X) < 2:
            raise InputError(
                f"dataset: {len(part.X)} {name} casts came down to the rim plane, at least 2 are needed; generate more "
                + "; ".join(["casts, or change the scenario's motion or bounds", *describe_failed_casts(data)])
            )
    return Parts(train, validation, test)


def _check_frame(frame: pd.DataFrame) -> None:
    """Raise `.InputError` unless all that is learned from is there: a frame may be anybody's."""
    missing = [name for name in COLUMNS if name not in frame]
    if missing:
        raise InputError(
            f"dataset: its frame has no column {', '.join(missing)}; give it what `.CastDataset.frame` lists"
        )
    numbers: dict[str, Array] = {}
    for name in COLUMNS:
        column = frame[name]
        if column.ndim > 1:
            raise InputError(f"dataset: its frame has {column.shape[1]} columns {name}; keep one of them")
        if name in WORDS:
            is_allowed = column.isin(list(WORDS[name])).to_numpy(dtype=bool)
            if not is_allowed.all():
                row = int(np.argmin(is_allowed))
                raise _wrong_value(name, column.iloc[row], row, f"one of {', '.join(map(str, WORDS[name]))}")
        else:
            numbers[name] = _numbers(column)
    wrong = first_wrong(numbers, frame["status"].to_numpy(dtype=object))
    if wrong is not None:
        value = float(numbers[wrong.column][wrong.row])
        raise _wrong_value(wrong.column, value, wrong.row, wrong.rule)


def _numbers(column: pd.Series[Any]) -> Array:
    """Return a column as numbers, nan what is missing, shape (n,)."""
    try:
        return column.to_numpy(dtype=float, na_value=np.nan)
    except (TypeError, ValueError):
        raise InputError(f"dataset: column {column.name} of its frame is of type {column.dtype}, no number") from None


def _wrong_value(name: str, value: object, row: int, rule: str) -> InputError:
    return InputError(f"dataset: column {name} of its frame is {quoted(value)} in row {row}; it must be {rule}")


def _usable(data: CastDataset, rows: NDArray[np.intp]) -> Part:
    """Return those of the rows whose casts crossed the rim plane."""
    frame = data.frame.iloc[rows].dropna(subset=list(OUTPUTS))
    return Part(
        frame[list(PARAMETERS)].to_numpy(dtype=float),
        frame[list(OUTPUTS)].to_numpy(dtype=float),
        (frame["status"] == "landed").to_numpy() & frame["is_slack"].to_numpy(dtype=bool),
    )


def failed_casts(data: CastDataset) -> dict[str, dict[str, int]]:
    """Return, by the status of casts that failed, how many there are (`casts`) and how many of them are learned from (`learned`).

    Whatever landed is learned from; a cast that met a limit counts as one that the arm cannot do. Raises `.InputError` as
    `split_casts` does of a frame.
    """
    frame = data.frame
    _check_frame(frame)
    is_learned = frame[list(OUTPUTS)].notna().all(axis=1)
    failed = {status: (frame["status"] == status).to_numpy() for status in REMEDIES}
    return {
        status: {"casts": int(rows.sum()), "learned": int(is_learned[rows].sum())}
        for status, rows in failed.items()
        if rows.any()
    }


def describe_failed_casts(data: CastDataset) -> list[str]:
    """Return a line for each kind of failed casts: how many, whether they are learned from, and what would mend them."""
    lines = []
    for status, counts in failed_casts(data).items():
        n, n_learned = counts["casts"], counts["learned"]
        learned = f"{n_learned} of them landed and are learned from" if n_learned else "not learned from"
        lines.append(f"{n} of {len(data)} casts {status} ({learned}): {REMEDIES[status]}")
    return lines
