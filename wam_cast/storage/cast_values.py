"""What a dataset's casts can be: which values a status must have and must not have, and how large they are.

No simulation and no laboratory gives others; a number beyond would be learned from, and take every other cast's place in a fit.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from wam_cast.cast import LARGEST, LONGEST_CAST, PARAMETERS
from wam_cast.types import Array

STATUSES = ("landed", "never_crossed", "limit_hit", "diverged")
"""How a cast without a cup can end."""

LANDED = ("landing_along", "landing_across", "crossing_time", "entry_speed", "entry_angle", "slack")
"""What a cast that landed has: all of status "landed", some of "limit_hit", no others."""

PEAKS = ("peak_torque_utilization", "peak_velocity_utilization", "peak_tracking_error")
"""Largest values on the way, of any size where the simulation diverged."""

LEARNED_PEAKS = PEAKS[:2]
"""Those that a cast that landed has, too; the hand's error is known only where the controller says what it wants."""

LARGEST_NUMBER, LARGEST_PEAK = 1e4, 1e6

RANGES = {
    "distance": (0.0, LARGEST["distance"]),
    "speed": (0.0, LARGEST["speed"]),
    "wait": (0.0, LONGEST_CAST),
    "landing_along": (-LARGEST_NUMBER, LARGEST_NUMBER),
    "landing_across": (-LARGEST_NUMBER, LARGEST_NUMBER),
    "crossing_time": (-LARGEST_NUMBER, LARGEST_NUMBER),
    "entry_speed": (0.0, LARGEST_NUMBER),
    "entry_angle": (0.0, 3.15),
    "slack": (-LARGEST_NUMBER, LARGEST_NUMBER),
    "peak_torque_utilization": (0.0, LARGEST_PEAK),
    "peak_velocity_utilization": (0.0, LARGEST_PEAK),
    "peak_tracking_error": (0.0, LARGEST_PEAK),
}
"""Least and largest value of a column, in SI units: far beyond what any arm does."""


class Wrong(NamedTuple):
    """A value that no cast has."""

    column: str
    row: int
    rule: str
    """What it must be, in words."""


def first_wrong(columns: Mapping[str, Array], status: NDArray[np.object_]) -> Wrong | None:
    """Return the first value that no cast has, column by column; None if there is none.

    `columns` are those of `RANGES` that are there, nan what is missing, each of shape (n,), as is `status`, of `STATUSES`.
    """
    has_some = ~np.all([np.isnan(columns[name]) for name in LANDED if name in columns], axis=0)
    has_diverged = status == "diverged"
    has_landed = (status == "landed") | ((status == "limit_hit") & has_some)
    never_lands = has_diverged | (status == "never_crossed")
    for name, values in columns.items():
        lower, upper = RANGES[name]
        is_missing = np.isnan(values)
        is_outside = ~is_missing & ~((values >= lower) & (values <= upper))
        if name in PEAKS:
            is_outside &= ~has_diverged | np.isinf(values)
        must_be = np.full(len(values), name in PARAMETERS) | (has_landed & (name in LANDED + LEARNED_PEAKS))
        must_miss = never_lands & (name in LANDED)
        number = f"a number from {lower:g} to {upper:g}"
        for is_wrong, rule in (
            (must_miss & ~is_missing, "nan, of a cast that did not land"),
            (is_outside, number),
            (must_be & is_missing, number if name in PARAMETERS else f"{number}, of a cast that landed"),
        ):
            if is_wrong.any():
                return Wrong(name, int(np.argmax(is_wrong)), rule)
    return None
