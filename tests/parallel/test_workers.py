"""Worker processes over one batch and several: kept while they are whole, replaced when they are not."""

import multiprocessing
import os
import time
from concurrent.futures import ProcessPoolExecutor, ThreadPoolExecutor
from multiprocessing import get_context

import pytest

from wam_cast.cli import options
from wam_cast.errors import InputError, MachineError
from wam_cast.experiments.floor_map import map_floor
from wam_cast.experiments.paper.reproduce import reproduce
from wam_cast.experiments.transfer.transfer import transfer
from wam_cast.learning.dataset import generate_dataset
from wam_cast.learning.reference import reference_model
from wam_cast.parallel.workers import ATTEMPTS, MOST_WORKERS, Workers, run_rows
from wam_cast.scenario import Scenario


def test_processes_serve_all_batches_and_end_with_the_context(helper):
    with Workers(1) as workers:
        (process, *others) = set(workers.run(helper.process, range(5)))
        assert others == []
        assert process != os.getpid()
        assert set(run_rows(helper.process, range(5), workers)) == {process}
        rows = workers.run(helper.process, range(3))
        assert [next(rows) for _ in range(3)] == [process] * 3
        rows.close()  # by one who knows how many there are: nobody is at work
        assert set(workers.run(helper.process, range(2))) == {process}
    with pytest.raises(ProcessLookupError):
        os.kill(process, 0)


@pytest.mark.parametrize("run", [lambda n: Workers(n), lambda n: next(run_rows(abs, [1], n_workers=n))])
def test_more_processes_than_any_machine_serves_are_refused(run):
    for n_workers in (MOST_WORKERS + 1, 10**30, 10**10_000):
        with pytest.raises(InputError, match=rf"n_workers = .* must be {MOST_WORKERS} at most"):
            run(n_workers)
    with pytest.raises(InputError, match="n_workers = 0 must be an integer, 1 or more"):
        run(0)


def test_the_command_line_takes_as_many_and_no_more():
    assert options.Workers.__metadata__[0].max == MOST_WORKERS


@pytest.mark.parametrize("function", [generate_dataset, map_floor, reproduce, transfer])
def test_they_are_refused_before_anything_is_written(tmp_path, function):
    subject = reference_model() if function is map_floor else Scenario()
    with pytest.raises(InputError, match="n_workers"):
        function(subject, directory=tmp_path / "run", n_workers=10**30)
    assert not list(tmp_path.iterdir())


def test_there_are_never_more_processes_than_rows(helper):
    with Workers(MOST_WORKERS) as workers:
        assert list(workers.run(helper.square, [2, 3])) == [4, 9]
        assert len(multiprocessing.active_children()) <= 2


@pytest.mark.slow
def test_a_row_whose_process_dies_in_a_later_batch_is_tried_again_alone(helper):
    with Workers(1) as workers:
        (first,) = set(workers.run(helper.process, range(3)))
        *found, alone, after, last = workers.run(helper.process_or_death, [0, 1, -1, 2, 3])
        assert set(found) == {first}
        assert alone not in (first, after)
        # The broken pool is not asked again: what follows has one process, and not one for each row.
        (new,) = {after, last, *workers.run(helper.process, range(4))}
        assert new != first
        assert list(workers.run(helper.square, range(6))) == [0, 1, 4, 9, 16, 25]


def test_a_batch_that_was_left_early_keeps_nobody_waiting(helper):
    with Workers(1) as workers:
        results = workers.run(helper.sleep, [0, 40, 40])
        next(results)
        start = time.perf_counter()
        results.close()
        assert list(workers.run(helper.square, [2])) == [4]
        assert time.perf_counter() - start < 20


def test_what_the_rows_have_in_common_is_loaded_once(helper):
    with Workers(1) as workers:
        assert list(workers.run(helper.Loads(), range(100))) == [1] * 100


def test_a_batch_that_failed_keeps_nobody_waiting(helper):
    with Workers(2) as workers:
        with pytest.raises(ZeroDivisionError, match="row 100"):
            list(workers.run(helper.square, [0, 100, 2]))
        assert list(workers.run(helper.square, [2, 4])) == [4, 16]
        assert list(workers.run(helper.square, [])) == []


def test_no_row_is_lost_with_the_process_that_computes_it(helper):
    assert list(run_rows(helper.square, range(13), n_workers=2)) == [row * row for row in range(13)]


def test_a_row_that_always_kills_its_process_ends_the_work_with_what_happened(helper):
    with pytest.raises(
        MachineError, match=rf"row 5: its process died {ATTEMPTS} times, at last by SIGKILL; .*start again"
    ):
        list(run_rows(helper.death, [5], n_workers=1))


def test_an_executor_that_breaks_says_so(helper):
    broken = pytest.raises(MachineError, match=r"ProcessPoolExecutor lost its workers .* start again with a new one")
    with ProcessPoolExecutor(1, get_context("spawn")) as executor, broken:
        list(run_rows(helper.death, [5], executor))


@pytest.mark.parametrize("name", ["KilledWorker", "CommClosedError"])
def test_the_faults_of_a_dask_cluster_are_those_of_an_executor(inline_executor, name):
    fault = type(name, (Exception,), {"__module__": "distributed.scheduler"})

    def fail(row):
        raise fault(f"row {row} is lost")

    with pytest.raises(MachineError, match=r"lost its workers \(row 7 is lost\); .* start again"):
        list(run_rows(fail, [7], inline_executor))


def test_an_exception_of_the_function_is_raised(helper):
    with pytest.raises(ZeroDivisionError, match="row 100"):
        list(run_rows(helper.square, [0, 1, 100, 2], n_workers=1))


def test_rows_at_hand_are_dropped_when_the_caller_stops(helper):
    results = run_rows(helper.sleep, [0, 60, 60, 60], n_workers=2)
    next(results)
    start = time.perf_counter()
    results.close()
    assert time.perf_counter() - start < 5


def test_rows_that_have_not_started_are_cancelled_when_the_caller_stops():
    started = []

    def slow(row):
        started.append(row)
        time.sleep(0.02)

    with ThreadPoolExecutor(1) as executor:
        results = run_rows(slow, range(500), executor)
        next(results)
        results.close()
    assert len(started) < 10
