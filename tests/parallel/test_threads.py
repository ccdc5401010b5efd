"""One thread for the numerical libraries, whoever asks for it at once."""

import threading
from concurrent.futures import ThreadPoolExecutor

import pytest
from threadpoolctl import threadpool_info, threadpool_limits

from wam_cast.learning.reference import reference_model
from wam_cast.parallel.threads import one_thread
from wam_cast.planning.plan import plan_cast


def blas_threads():
    return {one["num_threads"] for one in threadpool_info() if one["user_api"] == "blas"}


@pytest.fixture
def two_threads():
    with threadpool_limits(2, user_api="blas"):
        assert blas_threads() == {2}
        yield


@pytest.mark.usefixtures("two_threads")
def test_the_limit_holds_until_the_last_has_left():
    inside, leave = threading.Event(), threading.Event()

    def stay():
        with one_thread():
            inside.set()
            leave.wait(60)

    with one_thread():
        other = threading.Thread(target=stay)
        other.start()
        assert inside.wait(60)
    assert blas_threads() == {1}
    leave.set()
    other.join()
    assert blas_threads() == {2}


@pytest.mark.usefixtures("two_threads")
def test_the_limit_ends_with_an_error_and_may_be_asked_for_within():
    with pytest.raises(ZeroDivisionError), one_thread(), one_thread():
        assert blas_threads() == {1}
        raise ZeroDivisionError
    assert blas_threads() == {2}


def test_openmp_is_limited_in_each_thread():
    def limit(_):
        with one_thread():
            return {one["num_threads"] for one in threadpool_info() if one["user_api"] == "openmp"} <= {1}

    with one_thread(), ThreadPoolExecutor(1) as pool:
        assert pool.submit(limit, 0).result()


@pytest.mark.usefixtures("two_threads")
def test_plans_made_in_threads_are_those_made_after_each_other():
    model, radii = reference_model(), [0.45, 0.75]
    alone = [plan_cast(model, (radius, 0.0)).cast for radius in radii]
    with ThreadPoolExecutor(3) as pool:
        assert list(pool.map(lambda radius: plan_cast(model, (radius, 0.0)).cast, 2 * radii)) == 2 * alone
    assert blas_threads() == {2}
