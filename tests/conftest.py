"""What tests of several layers share."""

import pytest


@pytest.fixture(scope="session")
def lively_cup():
    """Return the part of a scenario that makes a ball bounce in its cup; the reference cup hardly lets it."""
    return {"restitution": 0.7}
