"""Recorded casts that the tests of pictures share: simulated once."""

import math

import pytest

from wam_cast.cast import Cast


@pytest.fixture(scope="session")
def caught(simulator, once):
    """Return a cast along x whose ball ends in the cup."""
    cast = Cast(0.3, 0.6, 0.1)
    recording = once("caught", lambda: simulator.record(cast, tuple(simulator.simulate(cast).landing)))
    assert recording.outcome.is_caught
    return recording


@pytest.fixture(scope="session")
def missed(simulator, once):
    """Return a cast at another bearing, whose ball misses a cup that stands beside the casting plane."""
    cast = Cast(0.3, 0.6, 0.1, bearing=math.atan2(-0.4, 0.5))
    recording = once("missed", lambda: simulator.record(cast, (0.5, -0.4)))
    assert not recording.outcome.is_caught
    return recording


@pytest.fixture(scope="session")
def landed(simulator):
    """Return a cast without a cup: its recording ends at the landing."""
    return simulator.record(Cast(0.3, 0.6, 0.1))
