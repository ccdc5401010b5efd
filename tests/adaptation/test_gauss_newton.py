"""Most probable parameters are those of closed forms, and of scipy where there are none."""

import numpy as np
import pytest
from scipy.optimize import least_squares

from wam_cast.adaptation.gauss_newton import CONVERGED, most_probable

TIMES = np.linspace(0.0, 2.0, 12)


def decay(z):
    """Return the residuals, in deviations of 0.05, of a decay whose size and rate are exp(z), and their Jacobian."""
    size, rate = np.exp(z)
    values = size * np.exp(-rate * TIMES)
    observed = 1.8 * np.exp(-0.6 * TIMES) + 0.05 * np.sin(7 * TIMES)
    return (values - observed) / 0.05, np.column_stack([values, -rate * TIMES * values]) / 0.05


def steep(z):
    """Return a residual whose whole steps from afar lead farther away: arctan's."""
    return 20 * np.arctan(z - 0.5), np.diag(20 / (1 + (z - 0.5) ** 2))


def scipys(residuals, start):
    return least_squares(lambda z: np.concatenate([residuals(z)[0], z]), start, xtol=1e-12, ftol=1e-12, gtol=1e-12).x


def test_linear_residuals_give_bayesian_linear_regression():
    rng = np.random.default_rng(0)
    A, y = rng.standard_normal((5, 8)), rng.standard_normal(5)
    mean, covariance = most_probable(lambda z: (A @ z - y, A), np.zeros(8))
    # The other way round, by the observations' covariance (Rasmussen and Williams, Eq. 2.12).
    gain = A.T @ np.linalg.inv(A @ A.T + np.eye(5))
    np.testing.assert_allclose(mean, gain @ y, atol=1e-12)
    np.testing.assert_allclose(covariance, np.eye(8) - gain @ A, atol=1e-12)


@pytest.mark.parametrize("start", [[0.0, 0.0], [1.0, 1.0], [-1.0, 1.0]])
def test_it_finds_what_scipy_finds(start):
    mean, covariance = most_probable(decay, np.array(start))
    off = mean - scipys(decay, start)
    # The last step is not checked: what is left is a small part of a deviation.
    assert off @ np.linalg.solve(covariance, off) < (CONVERGED / 5) ** 2
    jacobian = decay(mean)[1]
    np.testing.assert_allclose(covariance, np.linalg.inv(np.eye(2) + jacobian.T @ jacobian), rtol=0.05)


def test_steps_that_overshoot_are_halved():
    start = np.array([4.0, -4.0])
    r, J = steep(start)
    whole = start - np.linalg.solve(np.eye(2) + J.T @ J, J.T @ r + start)
    assert np.linalg.norm(steep(whole)[0]) > np.linalg.norm(r)
    mean, _ = most_probable(steep, start)
    np.testing.assert_allclose(mean, scipys(steep, [0.0, 0.0]), atol=0.3 / 20)


def test_each_call_counts():
    calls = []

    def counted(z):
        calls.append(z)
        return decay(z)

    mean, _ = most_probable(counted, scipys(decay, [0.0, 0.0]))
    assert len(calls) == 1
    np.testing.assert_allclose(mean, calls[0], atol=1e-6)


def test_without_residuals_it_is_what_was_believed():
    mean, covariance = most_probable(lambda z: (np.empty(0), np.empty((0, 3))), np.array([1.0, 0.0, -1.0]))
    np.testing.assert_allclose(mean, 0.0, atol=1e-12)
    np.testing.assert_allclose(covariance, np.eye(3))
