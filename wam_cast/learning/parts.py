"""A dataset's three parts as arrays, the test part under seal."""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple

import numpy as np
from numpy.typing import NDArray

from wam_cast.cast import PARAMETERS
from wam_cast.errors import InputError
from wam_cast.learning.failed_casts import describe_failed_casts
from wam_cast.planning.prediction import OUTPUTS
from wam_cast.types import Array

if TYPE_CHECKING:
    from wam_cast.learning.dataset import CastDataset


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
        If the dataset has fewer than 34 casts, or fewer than 2 casts of a part came down to the rim plane.
    """
    train, validation, test = (_usable(data, rows) for rows in data.split())
    for name, part in (("training", train), ("validation", validation), ("test", test)):
        if len(part.X) < 2:
            raise InputError(
                f"dataset: {len(part.X)} {name} casts came down to the rim plane, at least 2 are needed; generate more "
                + "; ".join(["casts, or change the scenario's motion or bounds", *describe_failed_casts(data)])
            )
    return Parts(train, validation, test)


def _usable(data: CastDataset, rows: NDArray[np.intp]) -> Part:
    """Return those of the rows whose casts crossed the rim plane."""
    frame = data.frame.iloc[rows].dropna(subset=list(OUTPUTS))
    return Part(
        frame[list(PARAMETERS)].to_numpy(dtype=float),
        frame[list(OUTPUTS)].to_numpy(dtype=float),
        (frame["status"] == "landed").to_numpy() & frame["is_slack"].to_numpy(dtype=bool),
    )
