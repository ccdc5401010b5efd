"""What tests of worker processes share."""

import sys

import pytest

HELPER = """
import os
import time

def process(row):
    return os.getpid()

def process_or_death(row):
    if row < 0:
        os._exit(7)
    return os.getpid()

def sleep(row):
    time.sleep(row)

def square(row):
    if row in (3, 11):
        os._exit(7)
    if row == 100:
        raise ZeroDivisionError("row 100")
    return row * row

def row_or_death(scenario, seed, row):
    if row == 1:
        os._exit(7)
    return {"cast": row, "status": "landed"}
"""


@pytest.fixture
def helper(tmp_path, monkeypatch):
    """A module that worker processes can import."""
    (tmp_path / "worker_test_helper.py").write_text(HELPER)
    monkeypatch.syspath_prepend(tmp_path)
    import worker_test_helper

    yield worker_test_helper
    del sys.modules["worker_test_helper"]
