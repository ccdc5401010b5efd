"""One thread for the numerical libraries."""

from __future__ import annotations

from contextlib import AbstractContextManager
from functools import lru_cache
from typing import Any

from threadpoolctl import ThreadpoolController


def one_thread() -> AbstractContextManager[Any]:
    """Return a context in which matrix products and factorizations run on one thread.

    Those of a plan are small: several threads wait for each other longer than they work, most of all where other processes work
    too, and their results depend on how many there are.
    """
    limits: AbstractContextManager[Any] = _controller().limit(limits=1)
    return limits


@lru_cache(maxsize=1)
def _controller() -> ThreadpoolController:
    """Return what knows the libraries' pools; to look for them takes milliseconds."""
    import scipy.linalg  # noqa: F401 - brings its own library

    return ThreadpoolController()
