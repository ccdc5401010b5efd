"""Random streams of the experiment and of the map of the floor, each of its own, all from the run's seed."""

from __future__ import annotations

from enum import IntEnum

import numpy as np


class Purpose(IntEnum):
    """What a stream is for; the numbers name the streams and must stay."""

    SUBSETS = 0
    NETWORK = 1
    BOOTSTRAP = 2
    NOISE = 3
    CUPS = 4
    SEARCH = 5
    MAP = 6
    ROBOTS = 7


def derived_seed(seed: int, purpose: Purpose, index: int = 0) -> int:
    """Return a seed below 2^32 that no other purpose, index or seed shares but by chance.

    The key has three parts, where those of a dataset's rows have one or two: no stream is one of theirs.
    """
    return int(np.random.SeedSequence(seed, spawn_key=(0, purpose, index)).generate_state(1)[0])
