"""Learning curves, computed again; and the fit that chooses its own hyperparameters."""

import numpy as np
import pytest
from sklearn.dummy import DummyRegressor

import wam_cast as wc
from wam_cast.cast import cast_bounds
from wam_cast.experiments.paper import learning_curves
from wam_cast.experiments.paper.learning_curves import fit_self_tuned, learn_with_fewer_casts
from wam_cast.learning.hyperparameters import tune_by_lbfgs
from wam_cast.learning.losses import LeaveOneOutLoss
from wam_cast.learning.parts import split_casts
from wam_cast.parallel.seeds import Purpose, derived_seed
from wam_cast.parallel.workers import Workers

BOUNDS = cast_bounds(wc.Scenario())


@pytest.fixture
def parts(casts):
    return split_casts(casts)


def test_bands_are_over_subsets_of_each_size_measured_on_the_validation_casts(no_physics, parts, monkeypatch):
    fitted = []

    class Mean(DummyRegressor):
        def fit(self, X, y):
            fitted.append({tuple(row) for row in X})
            return super().fit(X, y)

    monkeypatch.setattr(learning_curves, "SIZES", (10, 40, 500))
    monkeypatch.setattr(learning_curves, "_FITS", {"mean": lambda X, y, *_: Mean().fit(X, y)})
    found = learn_with_fewer_casts(wc.Scenario(), parts, 3, 4, Workers(), lambda *_: None)
    assert (found.n_train, found.n_repeats) == ((10, 40, 65), 4)
    y = parts.train.landing
    orders = [np.random.default_rng(derived_seed(3, Purpose.SUBSETS, repeat)).permutation(65) for repeat in range(4)]
    errors = np.array(
        [
            [np.sqrt(np.mean((y[order[:size]].mean() - parts.validation.landing) ** 2)) for size in found.n_train]
            for order in orders
        ]
    )
    band = found.curves["mean"]
    for seen, expected in (
        (band["median"], np.median(errors, axis=0)),
        (band["low"], errors.min(axis=0)),
        (band["high"], errors.max(axis=0)),
    ):
        np.testing.assert_allclose(seen, expected, rtol=1e-12)
    assert band["low"][0] < band["median"][0] < band["high"][0]
    # The largest first; a repeat's smaller subset is in its larger one, and no two repeats have the same.
    assert [len(casts) for casts in fitted] == [65] + 4 * [40] + 4 * [10]
    assert all(small < large for small, large in zip(fitted[5:], fitted[1:5], strict=True))
    assert len({frozenset(casts) for casts in fitted}) == 9


@pytest.mark.parametrize("n_sigmas", [1, 3])
def test_what_tunes_itself_does_so_on_its_own_data(parts, n_sigmas):
    X, y = parts.train.X[:30], parts.train.landing[:30]
    model = fit_self_tuned(X, y, BOUNDS, n_sigmas)
    loss = LeaveOneOutLoss(X, y, input_bounds=BOUNDS)
    tuned = tune_by_lbfgs(loss, sigma0=0.5 if n_sigmas == 1 else [0.5] * 3)
    assert np.size(model.sigma) == n_sigmas
    np.testing.assert_array_equal(model.sigma, tuned.sigma)
    assert model.regularization == tuned.regularization
    first = model.predict(parts.validation.X)
    np.testing.assert_array_equal(fit_self_tuned(X, y, BOUNDS, n_sigmas).predict(parts.validation.X), first)
