"""A Dask cluster as an executor for the command line: its workers looked at first and waited for aloud, its faults in one line."""

from __future__ import annotations

import logging
import threading
import time
from collections.abc import Callable, Iterator
from concurrent.futures import BrokenExecutor, Executor, Future, InvalidStateError
from contextlib import contextmanager, suppress
from typing import Any
from weakref import WeakSet

from wam_cast.errors import InputError, MachineError

PATIENCE = 5.0
"""Seconds without a worker after which someone is told."""

POLL = 0.5
"""Seconds from one look at the workers to the next."""


@contextmanager
def dask_executor(address: str, tell: Callable[[str], None]) -> Iterator[Executor]:
    """Give an executor on the cluster of the scheduler at `address`, once it has a worker; `tell` takes a line about the waiting.

    From then on Dask's own log is silent in this process.

    Raises
    ------
    InputError
        If Dask is not installed, no scheduler answers, or a worker cannot simulate as this process does.
    MachineError
        If the scheduler is lost.
    """
    try:
        from distributed import Client
        from distributed.comm import CommClosedError
    except ImportError:
        raise InputError("--scheduler needs Dask: pip install 'wam-cast[distributed]'") from None
    for name in logging.root.manager.loggerDict:
        if name.partition(".")[0] in ("distributed", "tornado", "asyncio"):
            logging.getLogger(name).setLevel(logging.CRITICAL)
    try:
        client = Client(address, timeout=10)
    except (OSError, ValueError) as error:  # a timeout is an OSError
        raise InputError(f"--scheduler {address}: no Dask scheduler answers there ({error})") from None
    done = threading.Event()
    executor = _ClusterExecutor(client.get_executor())
    with client:
        threading.Thread(target=_watch, args=(client, address, tell, done, executor.lose), daemon=True).start()
        try:
            _check_workers(client, address)
            yield executor
        except (MachineError, OSError) as error:
            if client.status == "running" and not isinstance(error, CommClosedError):
                raise
            raise MachineError(
                f"the Dask scheduler at {address} is gone; start it and its workers again, and then this"
            ) from None
        finally:
            done.set()


class _ClusterExecutor(Executor):
    """Hands calls to Dask's executor, and knows what it is waiting for: of a scheduler that is gone Dask may wait for ever.

    So it does for a result that a worker had computed and took along when it ended, shortly before the scheduler did.
    """

    def __init__(self, executor: Executor) -> None:
        self._executor, self._futures = executor, WeakSet[Future[Any]]()

    def submit(self, fn: Callable[..., Any], /, *args: Any, **kwargs: Any) -> Future[Any]:
        """Hand over a call."""
        future = self._executor.submit(fn, *args, **kwargs)
        self._futures.add(future)
        return future

    def lose(self) -> None:
        """Let all who wait know that nothing comes any more."""
        for future in tuple(self._futures):
            with suppress(InvalidStateError):  # it has come
                future.set_exception(BrokenExecutor("the scheduler is gone"))


def _watch(
    client: Any, address: str, tell: Callable[[str], None], done: threading.Event, lose: Callable[[], None]
) -> None:
    """Tell when there has been no worker for some seconds, each time anew, and call `lose` when the scheduler is gone."""
    missing, were_there = 0.0, False
    while not done.wait(POLL):
        try:
            n_workers = len(client.nthreads())
        except Exception:
            lose()
            return
        missing, were_there = (0.0, True) if n_workers else (missing + POLL, were_there)
        if missing == PATIENCE:
            known = "all that it had have gone, and their logs say why" if were_there else "none has come yet"
            tell(f"waiting for workers: {known}; `dask worker {address}` starts one")


def _check_workers(client: Any, address: str) -> None:
    """Wait for a worker. Raises `.InputError` if one that is there cannot simulate as this process does."""
    while not client.nthreads():
        time.sleep(POLL)
    versions = _by_value()
    here = versions()
    for worker, there in client.run(versions, on_error="return").items():
        if there != here:
            raise InputError(
                f"--scheduler {address}: the worker {worker} has {there}, this process {here}; install the same there, and start "
                "the worker again"
            )


def _by_value() -> Callable[[], str]:
    """Return a function that Dask carries to workers as it stands, even to those that do not have this package."""

    def versions() -> str:
        from importlib import import_module
        from importlib.metadata import version

        try:
            import_module("wam_cast.simulation.simulator")
            return f"wam_cast {import_module('wam_cast').__version__} with drake {version('drake')}"
        except Exception as error:
            return f"no wam_cast that works ({type(error).__name__}: {error})"

    return versions
