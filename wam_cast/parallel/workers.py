"""Run a function over many rows in parallel, and survive the death of worker processes.

By hand, since each of the packages lacks a part of it. Joblib's loky loses the whole pool with a worker, as the standard pool
does, and its workers outlive a parent that was killed, while they have work. Pebble loses the one row alone, but its workers
outlive their parent too, and answer Ctrl-C with tracebacks while they start.
"""

from __future__ import annotations

import multiprocessing
import os
import pickle
import signal
import threading
import warnings
from collections import deque
from collections.abc import Callable, Generator, Sequence
from concurrent.futures import BrokenExecutor, CancelledError, Executor, Future, ProcessPoolExecutor
from concurrent.futures.process import BrokenProcessPool
from contextlib import closing, nullcontext
from functools import lru_cache, partial
from multiprocessing.connection import Connection
from typing import Any, Self, TypeVar

from wam_cast.errors import InputError, MachineError, checked_integer, quoted
from wam_cast.parallel import main_module

T = TypeVar("T")

LOOKAHEAD = 1000
"""Rows that are handed out before the first of them is back: enough for hundreds of workers, little enough to cancel."""

MOST_WORKERS = 1000
"""On this machine: as many as rows that are handed out."""

ATTEMPTS = 4
"""At a row alone, in a new process each time, before its process's death is taken for more than chance."""


class Workers:
    """Processes on this machine that run functions over rows, one batch of rows after the other; a context manager.

    They start with the first batch and end with the context: at once if it, or a batch, ends by an exception.

    Parameters
    ----------
    n_workers
        How many at most, see `checked_n_workers`; there are never more than rows.

    Raises
    ------
    InputError
        If it is no such number.
    """

    def __init__(self, n_workers: int | None = None) -> None:
        self._n_workers = checked_n_workers(n_workers)
        self._pool: _WorkerPool | None = None

    def __enter__(self) -> Self:
        return self

    def __exit__(self, kind: type[BaseException] | None, *details: Any) -> None:
        if self._pool is not None:
            pool, self._pool = self._pool, None
            pool.__exit__(kind, *details)

    def run(self, function: Callable[[int], T], rows: Sequence[int]) -> Generator[T]:
        """Yield `function(row)` for each row, in their order; raises, and warns, as `run_rows` does."""
        done = 0
        try:
            with closing(self._run(function, rows)) as results:
                for result in results:
                    yield result
                    done += 1
        except _CannotStartError as reason:
            line = (
                f"worker processes cannot start here ({reason}): this process does their work, one row after the other"
            )
            warnings.warn(line, RuntimeWarning, stacklevel=2)
            yield from map(function, rows[done:])

    def _run(self, function: Callable[[int], T], rows: Sequence[int]) -> Generator[T]:
        """Do so in processes. Raises `_CannotStartError` if there can be none."""
        done, data = 0, pickle.dumps(function)
        while done < len(rows):
            try:
                pool = self._pool_for(data)
                for result in _results(pool, partial(_call, data), rows[done:], deque()):
                    done += 1
                    yield result
            except BaseException as error:
                # What was handed out and is not wanted any more must not keep the next batch waiting.
                if done < len(rows):
                    self.__exit__(type(error), error, error.__traceback__)
                if not isinstance(error, BrokenProcessPool):
                    raise
            else:
                return
            # A dead process takes the whole pool with it. The guilty row is among the oldest unfinished ones, or soon will be.
            for row in rows[done : done + self._n_workers]:
                yield _run_alone(function, row, _needs_main(data))
                done += 1

    def _pool_for(self, data: bytes) -> _WorkerPool:
        """Return a pool whose processes can load a pickled function."""
        needs_main = _needs_main(data)
        if self._pool is not None and needs_main and not self._pool.imports_main:
            self.__exit__(None, None, None)
        if self._pool is None:
            self._pool = _WorkerPool(self._n_workers, imports_main=needs_main)
            if needs_main:
                self._pool.check_main(data)
        return self._pool


def run_rows(
    function: Callable[[int], T],
    rows: Sequence[int],
    executor: Executor | Workers | None = None,
    n_workers: int | None = None,
) -> Generator[T]:
    """Yield `function(row)` for each row, in their order; what is not finished is dropped when the generator is closed.

    Parameters
    ----------
    function
        Must pickle.
    rows
        What it is called with.
    executor
        Runs the calls, and is left running: what it has started it may finish. With `Workers`, which are the default for this
        call alone, a row whose process died is tried again, a few times alone, and no other row suffers.
    n_workers
        Without an executor: the number of processes at most, see `checked_n_workers`.

    Raises
    ------
    InputError
        If that is no such number.
    MachineError
        If a row's process dies again and again, or the executor breaks.
    Exception
        Whatever `function` raises.

    Warns
    -----
    RuntimeWarning
        If no processes can start, as in a daemonic process: then this one does the work.
    """
    if isinstance(executor, Executor):
        pending: deque[Future[T]] = deque()
        try:
            yield from _results(executor, function, rows, pending)
        except Exception as error:
            if not _is_of_the_executor(error):
                raise
            raise MachineError(
                f"the executor {type(executor).__name__} lost its workers ({str(error) or type(error).__name__}); see what ended "
                "them, and start again with a new one"
            ) from None
        finally:
            for future in pending:
                future.cancel()
    elif executor is not None:
        yield from executor.run(function, rows)
    else:
        with Workers(n_workers) as workers:
            yield from workers.run(function, rows)


def checked_n_workers(n_workers: int | None) -> int:
    """Return a number of processes, by default one for each processor that this process may use.

    Raises `.InputError` if it is no integer from 1 to `MOST_WORKERS`.
    """
    if n_workers is None:
        return min(available_processors(), MOST_WORKERS)
    number = checked_integer("n_workers", n_workers, 1)
    if number > MOST_WORKERS:
        raise InputError(
            f"n_workers = {quoted(number)} must be {MOST_WORKERS} at most; one for each processor does best"
        )
    return number


def available_processors() -> int:
    """Return the number of processors that this process may use."""
    return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1


def _results(
    executor: Executor, function: Callable[[int], T], rows: Sequence[int], pending: deque[Future[T]]
) -> Generator[T]:
    """Yield the results in order; `pending` holds what was handed out and is not back yet."""
    for row in rows:
        pending.append(executor.submit(function, row))
        if len(pending) == LOOKAHEAD:
            yield pending.popleft().result()
    while pending:
        yield pending.popleft().result()


def _call(data: bytes, row: int) -> Any:
    """Return what a pickled function gives for a row; what workers run. Each loads it once, however many rows it has."""
    return _loaded(data)(row)


@lru_cache(maxsize=1)
def _loaded(data: bytes) -> Any:
    return pickle.loads(data)


def _needs_main(data: bytes) -> bool:
    """Return whether a pickled function refers to the script, or the module, that runs here as `__main__`."""
    return b"__main__" in data


def _is_of_the_executor(error: Exception) -> bool:
    """Return whether an executor's own fault was raised, and not one of the function that it ran; Dask has errors of its own."""
    return isinstance(error, BrokenExecutor | CancelledError) or type(error).__module__.startswith("distributed.")


def _run_alone(function: Callable[[int], T], row: int, needs_main: bool) -> T:
    """Return `function(row)` from a process of its own, which may die a few times; raises `.MachineError` after that."""
    for _ in range(ATTEMPTS):
        has_started = False
        with _WorkerPool(1, imports_main=needs_main) as pool:
            try:
                pool.submit(os.getpid).result()
                has_started = True
                future: Future[T] = pool.submit(function, row)
                return future.result()
            except BrokenProcessPool:
                pass
        code = pool.exit_code
        if not has_started and code > 0:  # it was not killed, it gave up
            raise _CannotStartError(f"one ended {_describe(code)} before its work")
    raise MachineError(
        f"row {row}: its process died {ATTEMPTS} times, at last {_describe(code)}; see what ends processes here (too little "
        "memory?), then start again"
    )


def _describe(exit_code: int) -> str:
    return f"by {signal.Signals(-exit_code).name}" if exit_code < 0 else f"with exit code {exit_code}"


class _CannotStartError(RuntimeError):
    """Here no worker processes can start, or none that could load what they are to run."""


class _WorkerPool(ProcessPoolExecutor):
    """Spawned processes that leave Ctrl-C to their parent, and end at once when it fails or dies.

    Left to itself the pool would finish the rows at hand first, and a worker whose parent was killed would always wait. They
    import the main module, that of the script, only where it is needed: few scripts bear it, and what was typed cannot be.
    """

    def __init__(self, n_workers: int, *, imports_main: bool) -> None:
        context = multiprocessing.get_context("spawn")
        self.imports_main = imports_main
        try:
            self._far_end, self._lifeline = context.Pipe(duplex=False)
            super().__init__(n_workers, context, initializer=_end_with, initargs=(self._far_end,))
        except OSError as error:  # the system has no pipes or semaphores for it
            raise _CannotStartError(str(error)) from None
        self._started = self._processes  # which the pool forgets when it shuts down

    @property
    def exit_code(self) -> int:
        """Of a process of a pool that was shut down: negative if a signal ended it."""
        return next((process.exitcode or 0 for process in self._started.values()), 0)

    def submit(self, fn: Callable[..., Any], /, *args: Any, **kwargs: Any) -> Future[Any]:
        # Processes start in here, undisturbed, and inherit the mask, so that they are deaf to Ctrl-C from their first moment.
        previous = signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGINT, signal.SIGTERM})
        try:
            with nullcontext() if self.imports_main and main_module.can_be_imported() else main_module.without_main():
                return super().submit(fn, *args, **kwargs)
        except (AssertionError, OSError) as error:  # a daemonic process must not have any, or the system wants no more
            raise _CannotStartError(str(error)) from None
        finally:
            signal.pthread_sigmask(signal.SIG_SETMASK, previous)

    def check_main(self, data: bytes) -> None:
        """Raise `_CannotStartError` if the processes cannot load a pickled function of the main module."""
        try:
            problem = self.submit(_problem_of_loading, data).result()
        except BrokenProcessPool:
            problem = "they import the script, whose work must stand under `if __name__ == '__main__':`"
        if problem:
            raise _CannotStartError(problem)

    def __exit__(self, kind: type[BaseException] | None, *details: Any) -> None:
        if kind is not None:
            self._lifeline.close()
        super().__exit__(kind, *details)
        self._lifeline.close()
        self._far_end.close()


def _end_with(lifeline: Connection) -> None:
    """End this process when the other end of `lifeline` is closed; unlike Ctrl-C, SIGTERM is for it to answer too."""
    signal.pthread_sigmask(signal.SIG_UNBLOCK, {signal.SIGTERM})

    def wait() -> None:
        lifeline.poll(None)
        os._exit(1)

    threading.Thread(target=wait, daemon=True).start()


def _problem_of_loading(data: bytes) -> str:
    try:
        pickle.loads(data)
    except (AttributeError, ImportError) as error:
        return str(error)
    return ""
