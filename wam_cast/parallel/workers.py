"""Run a function over many rows in parallel, and survive the death of worker processes.

By hand, since each of the packages lacks a part of it. Joblib's loky loses the whole pool with a worker, as the standard pool
does, and its workers outlive a parent that was killed, while they have work. Pebble loses the one row alone, but its workers
outlive their parent too, and answer Ctrl-C with tracebacks while they start.
"""

from __future__ import annotations

import multiprocessing
import os
import signal
import threading
from collections import deque
from collections.abc import Callable, Generator, Sequence
from concurrent.futures import BrokenExecutor, CancelledError, Executor, Future, ProcessPoolExecutor
from concurrent.futures.process import BrokenProcessPool
from multiprocessing.connection import Connection
from typing import Any, Self, TypeVar

from wam_cast.errors import InputError, MachineError

T = TypeVar("T")

LOOKAHEAD = 1000
"""Rows that are handed out before the first of them is back: enough for hundreds of workers, little enough to cancel."""


ATTEMPTS = 4
"""At a row alone, in a new process each time, before its process's death is taken for more than chance."""


class Workers:
    """Processes on this machine that run functions over rows, one batch of rows after the other; a context manager.

    They start with the first batch and end with the context: at once if it, or a batch, ends by an exception.

    Parameters
    ----------
    n_workers
        How many, by default one for each processor that this process may use.
    """

    def __init__(self, n_workers: int | None = None) -> None:
        self._n_workers = n_workers or available_processors()
        self._pool: _WorkerPool | None = None

    def __enter__(self) -> Self:
        return self

    def __exit__(self, kind: type[BaseException] | None, *details: Any) -> None:
        if self._pool is not None:
            pool, self._pool = self._pool, None
            pool.__exit__(kind, *details)

    def run(self, function: Callable[[int], T], rows: Sequence[int]) -> Generator[T]:
        """Yield `function(row)` for each row, in their order; raises as `run_rows` does."""
        done = 0
        while done < len(rows):
            pool = self._pool = self._pool or _WorkerPool(self._n_workers)
            try:
                for result in _results(pool, function, rows[done:], deque()):
                    yield result
                    done += 1
            except BaseException as error:
                # What was handed out and is not wanted any more must not keep the next batch waiting.
                self.__exit__(type(error), error, error.__traceback__)
                if not isinstance(error, BrokenProcessPool):
                    raise
            else:
                return
            # A dead process takes the whole pool with it. The guilty row is among the oldest unfinished ones, or soon will be.
            for row in rows[done : done + self._n_workers]:
                yield _run_alone(function, row)
                done += 1


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
        Without an executor: the number of processes, by default one for each processor that this process may use.

    Raises
    ------
    InputError
        If worker processes cannot start at all.
    MachineError
        If a row's process dies again and again, or the executor breaks.
    Exception
        Whatever `function` raises.
    """
    if isinstance(executor, Executor):
        pending: deque[Future[T]] = deque()
        try:
            yield from _results(executor, function, rows, pending)
        except (BrokenExecutor, CancelledError) as error:
            raise MachineError(
                f"the executor {type(executor).__name__} lost its workers ({error or type(error).__name__}); make a new one, and "
                "start again"
            ) from None
        finally:
            for future in pending:
                future.cancel()
    elif executor is not None:
        yield from executor.run(function, rows)
    else:
        with Workers(n_workers) as workers:
            yield from workers.run(function, rows)


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


def _run_alone(function: Callable[[int], T], row: int) -> T:
    """Return `function(row)` from a process of its own, which may die a few times; raises `.MachineError` after that."""
    for _ in range(ATTEMPTS):
        has_started = False
        with _WorkerPool(1) as pool:
            try:
                pool.submit(os.getpid).result()
                has_started = True
                future: Future[T] = pool.submit(function, row)
                return future.result()
            except BrokenProcessPool:
                pass
        code = pool.exit_code
        if not has_started and code > 0:  # it was not killed, it gave up
            raise InputError(
                "worker processes cannot start: a script must generate datasets under `if __name__ == '__main__':`, "
                "since each worker imports it"
            )
    raise MachineError(
        f"row {row}: its process died {ATTEMPTS} times, at last {_describe(code)}; see what ends processes here (too little "
        "memory?), then start again"
    )


def _describe(exit_code: int) -> str:
    return f"by {signal.Signals(-exit_code).name}" if exit_code < 0 else f"with exit code {exit_code}"


class _WorkerPool(ProcessPoolExecutor):
    """Spawned processes that leave Ctrl-C to their parent, and end at once when it fails or dies.

    Left to itself the pool would finish the rows at hand first, and a worker whose parent was killed would always wait.
    """

    def __init__(self, n_workers: int) -> None:
        context = multiprocessing.get_context("spawn")
        self._far_end, self._lifeline = context.Pipe(duplex=False)
        super().__init__(n_workers, context, initializer=_end_with, initargs=(self._far_end,))
        self._started = self._processes  # which the pool forgets when it shuts down

    @property
    def exit_code(self) -> int:
        """Of a process of a pool that was shut down: negative if a signal ended it."""
        return next((process.exitcode or 0 for process in self._started.values()), 0)

    def submit(self, fn: Callable[..., Any], /, *args: Any, **kwargs: Any) -> Future[Any]:
        # Processes start in here and inherit the mask, so that they are deaf to Ctrl-C from their first moment.
        previous = signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGINT})
        try:
            return super().submit(fn, *args, **kwargs)
        finally:
            signal.pthread_sigmask(signal.SIG_SETMASK, previous)

    def __exit__(self, kind: type[BaseException] | None, *details: Any) -> None:
        if kind is not None:
            self._lifeline.close()
        super().__exit__(kind, *details)
        self._lifeline.close()
        self._far_end.close()


def _end_with(lifeline: Connection) -> None:
    """End this process when the other end of `lifeline` is closed."""

    def wait() -> None:
        lifeline.poll(None)
        os._exit(1)

    threading.Thread(target=wait, daemon=True).start()
