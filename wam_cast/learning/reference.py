"""What the package ships: the reference dataset, and the forward model that was fitted to it."""

from __future__ import annotations

from functools import lru_cache
from pathlib import Path
from typing import TYPE_CHECKING

from wam_cast.learning.forward_model import ForwardModel

if TYPE_CHECKING:
    from wam_cast.learning.dataset import CastDataset

_DIRECTORY = Path(__file__).parents[1] / "reference"


@lru_cache(maxsize=1)
def reference_model() -> ForwardModel:
    """Return the forward model of the reference scenario, fitted to the dataset that the package ships."""
    return ForwardModel.load(_DIRECTORY / "model.npz")


def reference_dataset() -> CastDataset:
    """Return the dataset that `reference_model` was fitted to: 1,700 casts of the reference scenario, seed 0, without a cup."""
    # A model that was fitted before does without pandas.
    from wam_cast.learning.dataset import CastDataset

    return CastDataset.load(_DIRECTORY / "dataset")
