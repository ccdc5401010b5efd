"""One thread for the numerical libraries."""

from __future__ import annotations

import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from functools import lru_cache
from typing import Literal

from threadpoolctl import OpenBLASController, ThreadpoolController


@contextmanager
def one_thread() -> Iterator[None]:
    """Give a context in which matrix products and factorizations run on one thread.

    Those of a plan are small: several threads wait for each other longer than they work, most of all where other processes work
    too, and their results depend on how many there are. Python threads may be in such contexts at once.
    """
    with _blas_limit, _controller("openmp").limit(limits=1):  # OpenMP's is each Python thread's own
        yield


class _BlasLimit:
    """The limit of BLAS, one for the whole process: it holds from the first thread that comes until the last has left."""

    def __init__(self) -> None:
        self._lock, self._n_inside = threading.Lock(), 0
        self._restore: Callable[[], None]

    def __enter__(self) -> None:
        with self._lock:
            if self._n_inside == 0:
                with _in_control():
                    self._restore = _controller("blas").limit(limits=1).restore_original_limits
            self._n_inside += 1

    def __exit__(self, *_: object) -> None:
        with self._lock:
            self._n_inside -= 1
            if self._n_inside == 0:
                with _in_control():
                    self._restore()


@contextmanager
def _in_control() -> Iterator[None]:
    """Let this thread set the limit: threadpoolctl leaves it to the first that did, and ignores all others."""
    OpenBLASController.clear_controlling_thread(force=True)
    yield
    OpenBLASController.clear_controlling_thread(force=True)


_blas_limit = _BlasLimit()


@lru_cache
def _controller(user_api: Literal["blas", "openmp"]) -> ThreadpoolController:
    """Return what knows the pools of some libraries; to look for them takes milliseconds."""
    import scipy.linalg  # noqa: F401 - brings its own library

    return ThreadpoolController().select(user_api=user_api)
