"""Numbers that describe many casts."""

import numpy as np
import pytest
from scipy.stats import chi2, norm

from wam_cast.experiments.statistics import describe, rmse, rmse_interval, wilson_interval


def test_wilson_interval_is_the_closed_form():
    n, hits, z = 100, 97, 1.959963984540054
    p = hits / n
    middle = (p + z**2 / (2 * n)) / (1 + z**2 / n)
    half = z / (1 + z**2 / n) * np.sqrt(p * (1 - p) / n + z**2 / (4 * n**2))
    assert wilson_interval(hits, n) == pytest.approx((middle - half, middle + half), abs=1e-12)


def test_wilson_interval_stays_between_0_and_1_and_holds_the_rate():
    for n in (*range(1, 100), 600, 10**9):
        for hits in {0, 1, n // 2, n - 1, n}:
            low, high = wilson_interval(hits, n)
            assert 0 <= low <= hits / n <= high <= 1
            assert low < high


def test_rmse_is_that_of_a_constant_error():
    assert rmse(np.full(7, -0.02)) == pytest.approx(0.02)


def test_bootstrap_interval_covers_the_true_rmse_as_often_as_it_says():
    rng = np.random.default_rng(1)
    covered = 0
    for trial in range(100):
        low, high = rmse_interval(rng.normal(0, 0.01, 200), trial)
        covered += low <= 0.01 <= high
    # 95 of 100 at best; percentiles cover a little less.
    assert 85 <= covered <= 100


def test_bootstrap_interval_depends_on_its_seed_alone():
    residuals = np.random.default_rng(0).normal(size=50)
    assert rmse_interval(residuals, 3) == rmse_interval(residuals, 3)
    assert rmse_interval(residuals, 3) != rmse_interval(residuals, 4)


def test_statistics_leave_out_what_never_landed():
    found = describe(np.array([1.0, np.nan, 3.0, 2.0]))
    assert (found["mean"], found["median"], found["max"]) == (2.0, 2.0, 3.0)
    assert found["p95"] == pytest.approx(2.9)


def test_statistics_of_nothing_are_none():
    found = describe(np.array([np.nan]))
    assert found["mean"] is None
    assert found["max"] is None


def test_bootstrap_interval_of_a_normal_sample_is_the_one_of_chi_square():
    n = 1000
    residuals = 0.01 * norm.ppf((np.arange(n) + 0.5) / n)
    intervals = np.array([rmse_interval(residuals, seed) for seed in range(8)])
    low, high = 0.01 * np.sqrt(chi2.ppf([0.025, 0.975], n) / n)
    # Its width is random by 1 %; that of a 94 % interval is less by 4 %.
    assert np.mean(intervals[:, 1] - intervals[:, 0]) == pytest.approx(high - low, rel=0.03)
    np.testing.assert_allclose(intervals.mean(axis=0), (low, high), rtol=0.003)
