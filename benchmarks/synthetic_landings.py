"""Casts whose landings are a formula: as many as wanted at once, where what is measured is the learning."""

from __future__ import annotations

import numpy as np
import pandas as pd

from wam_cast.cast import PARAMETERS, cast_bounds
from wam_cast.generation.sampling import sample_casts
from wam_cast.learning.dataset import CastDataset
from wam_cast.learning.reference import reference_model
from wam_cast.planning.prediction import ALONG, OUTPUTS
from wam_cast.scenario import Scenario
from wam_cast.types import Array

BATCH = 2000
"""Casts that are predicted at once."""


def synthetic_outputs(casts: Array) -> Array:
    """Return the `OUTPUTS` of casts, shape (n, 7): the reference model's, and a landing that is rougher in one region.

    There it has ripples and a kink of centimetres, so that the error falls with the number of casts as slowly as where the string
    buckles.
    """
    outputs = np.concatenate(
        [reference_model().predict(rows) for rows in np.split(casts, range(BATCH, len(casts), BATCH))]
    )
    lower, upper = cast_bounds(Scenario())
    Z = (casts - lower) / (upper - lower)
    rng = np.random.default_rng(0)
    ripples = np.cos(Z @ rng.normal(scale=8, size=(3, 20)) + rng.uniform(0, 2 * np.pi, 20)).sum(axis=1)
    kink = np.abs(Z @ [1.0, -1.0, 0.7] - 0.2 + 0.2 * np.sin(9 * Z[:, 1]))
    region = np.exp(-np.sum((Z - [0.7, 0.7, 0.3]) ** 2, axis=1) / 0.3**2)
    outputs[:, ALONG] += region * (0.003 * ripples + 0.15 * kink)
    return outputs


def synthetic_dataset(n_casts: int, seed: int = 0) -> CastDataset:
    """Return so many casts of the reference scenario's sampler, all landed with a slack string."""
    casts = sample_casts(Scenario(), n_casts, seed)
    frame = pd.DataFrame(casts, columns=list(PARAMETERS))
    frame[list(OUTPUTS)] = synthetic_outputs(casts)
    return CastDataset(Scenario(), seed, frame.assign(status="landed", is_slack=True))
