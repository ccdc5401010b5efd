"""Data to learn from that the tests of the losses and of the searches share."""

import numpy as np
import pytest

from wam_cast.learning.kernel_ridge import KernelRidge


@pytest.fixture(scope="session")
def sample():
    """Return a function that draws inputs, and targets that depend most on the first input and not on the second."""
    lower, upper = np.array([0.1, -2.0, 0.0]), np.array([0.4, 3.0, 700.0])

    def draw(n, noise=0.02, n_outputs=None, seed=0):
        rng = np.random.default_rng(seed)
        Z = rng.uniform(size=(n, 3))
        y = np.column_stack([5.0 + np.sin(6 * Z[:, 0]) + np.cos(2 * Z[:, 2]), Z[:, 0] * Z[:, 2]])
        y += noise * rng.normal(size=y.shape)
        return lower + Z * (upper - lower), y[:, 0] if n_outputs is None else y[:, :n_outputs]

    return draw


@pytest.fixture(params=[None, 1, 2])
def data(request, sample):
    return sample(60, n_outputs=request.param)


@pytest.fixture(params=[None, 1, 2])
def validation_data(request, sample):
    return *sample(80, n_outputs=request.param), *sample(40, n_outputs=request.param, seed=1)


@pytest.fixture(scope="session")
def validation_error():
    """Return the loss on validation data by its definition: refit and predict."""

    def error(data, **parameters):
        X, y, X_validation, y_validation = data
        residuals = KernelRidge(**parameters).fit(X, y).predict(X_validation) - y_validation
        return np.sum(residuals**2) / len(residuals)

    return error
