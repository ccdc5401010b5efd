"""Learning curves, computed again; and the estimator that chooses its own hyperparameters."""

from copy import deepcopy

import numpy as np
import pytest
from sklearn.base import clone
from sklearn.dummy import DummyRegressor

import wam_cast as wc
from wam_cast.cast import cast_bounds
from wam_cast.experiments.paper import learning_curves
from wam_cast.experiments.paper.learning_curves import SelfTunedKernelRidge, learn_with_fewer_casts
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
    monkeypatch.setattr(learning_curves, "_ESTIMATORS", {"mean": lambda *_: Mean()})
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
def test_what_tunes_itself_is_an_estimator(parts, n_sigmas):
    X, y = parts.train.X[:30], parts.train.landing[:30]
    original = SelfTunedKernelRidge(BOUNDS, n_sigmas)
    before = deepcopy(original.get_params())
    assert before.keys() == {"bounds", "n_sigmas"}
    model = clone(original)
    assert not hasattr(model, "model_")
    assert model.fit(X, y) is model
    for one in (original, model):
        after = one.get_params()
        assert after["n_sigmas"] == n_sigmas
        np.testing.assert_array_equal(after["bounds"], before["bounds"])
    loss = LeaveOneOutLoss(X, y, input_bounds=BOUNDS)
    tuned = tune_by_lbfgs(loss, sigma0=0.5 if n_sigmas == 1 else [0.5] * 3)
    assert np.size(model.model_.sigma) == n_sigmas
    np.testing.assert_array_equal(model.model_.sigma, tuned.sigma)
    assert model.model_.regularization == tuned.regularization
    first = model.predict(parts.validation.X)
    np.testing.assert_array_equal(model.fit(X, y).predict(parts.validation.X), first)
    np.testing.assert_array_equal(clone(model).fit(X, y).predict(parts.validation.X), first)
    # The second fit of another set knows nothing of the first.
    np.testing.assert_array_equal(model.fit(X[:20], y[:20]).predict(X), clone(original).fit(X[:20], y[:20]).predict(X))
