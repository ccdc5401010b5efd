"""What the package ships: the reference dataset, and the forward model that was fitted to it."""

from __future__ import annotations

from functools import lru_cache
from pathlib import Path
from typing import TYPE_CHECKING

from wam_cast.errors import InputError
from wam_cast.learning.forward_model import ForwardModel

if TYPE_CHECKING:
    from wam_cast.learning.dataset import CastDataset
    from wam_cast.scenario import Scenario

_DIRECTORY = Path(__file__).parents[1] / "reference"


@lru_cache(maxsize=1)
def reference_model() -> ForwardModel:
    """Return the forward model of the reference scenario, fitted to the dataset that the package ships."""
    return ForwardModel.load(_DIRECTORY / "model.npz")


def reference_model_for(scenario: Scenario) -> ForwardModel | None:
    """Return `reference_model` for plans in `scenario`, or None if it does not serve: it is a convenience that may be missing.

    It serves no scenario any more once the package's arm is another one than it was fitted for. Raises `.InputError` if it serves,
    but no cup of the scenario can be reached.
    """
    try:
        model = reference_model()
    except InputError:
        return None
    return model.bound_to(scenario) if model.serves(scenario) else None


def reference_dataset() -> CastDataset:
    """Return the dataset that `reference_model` was fitted to: 1,700 casts of the reference scenario, seed 0, without a cup."""
    # A model that was fitted before does without pandas.
    from wam_cast.learning.dataset import CastDataset

    return CastDataset.load(_DIRECTORY / "dataset")
