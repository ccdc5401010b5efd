"""Kernel ridge regression with the kernel at landmarks: the exact one with all of them, near it with many, in little memory."""

import tracemalloc

import numpy as np
import pytest
from sklearn.kernel_approximation import Nystroem
from sklearn.linear_model import Ridge

from wam_cast.learning.kernel_ridge import KernelRidge

BOUNDS = (0.0, 1.0)
SIGMA = (0.5, 0.9, 0.7)


def inputs(n, seed=0):
    return np.random.default_rng(seed).uniform(size=(n, 3))


def smooth(X):
    return np.column_stack([5 + np.sin(6 * X[:, 0]) * X[:, 1], np.cos(4 * X[:, 2]) + X[:, 0]])


def noisy(X, size=0.02, seed=1):
    return smooth(X) + size * np.random.default_rng(seed).standard_normal((len(X), 2))


def ridge(n_landmarks=None, **options):
    return KernelRidge(
        **{"sigma": SIGMA, "regularization": 1e-4, "input_bounds": BOUNDS, **options}, n_landmarks=n_landmarks
    )


@pytest.fixture(scope="module")
def many():
    X = inputs(600)
    return X, noisy(X)


@pytest.mark.parametrize("n_landmarks", [120, 1000])
@pytest.mark.parametrize("weighted", [False, True])
@pytest.mark.parametrize("center_targets", [True, False])
@pytest.mark.parametrize("n_outputs", [None, 2])
def test_with_all_rows_as_landmarks_it_is_exact(n_landmarks, weighted, center_targets, n_outputs):
    X, query = inputs(120), inputs(40, seed=2)
    y = noisy(X)[:, 0 if n_outputs is None else slice(None)]
    weights = np.resize([0.3, 1.0, 5.0, 0.0], len(X)) if weighted else None
    exact = ridge(center_targets=center_targets).fit(X, y, weights)
    landmarks = ridge(n_landmarks, center_targets=center_targets).fit(X, y, weights)
    for name in ("predict", "predict_std", "linearize"):
        found, expected = (getattr(model, name)(query) for model in (landmarks, exact))
        for one, other in zip(found, expected, strict=True):
            np.testing.assert_allclose(one, other, rtol=0, atol=1e-8)
    for one, other in zip(landmarks.leave_one_out(), exact.leave_one_out(), strict=True):
        assert one.shape == other.shape
        np.testing.assert_allclose(one, other, rtol=1e-8, atol=1e-8)


def test_it_is_the_ridge_on_the_features_of_scikit_learn(many):
    X, y = many
    ours = ridge(50, center_targets=False).fit(X, y)
    assert ours.centers_.shape == (50, 3)
    features = Nystroem(gamma=1.0, n_components=50, random_state=0).fit(ours.centers_ / SIGMA)
    theirs = Ridge(alpha=1e-4, fit_intercept=False).fit(features.transform(X / SIGMA), y)
    query = inputs(40, seed=2)
    expected = theirs.predict(features.transform(query / SIGMA))
    np.testing.assert_allclose(ours.predict(query), expected, rtol=0, atol=1e-6)


def test_landmarks_are_training_rows_from_the_first_to_the_last(many):
    X, y = many
    centers = ridge(50).fit(X, y).centers_
    rows = [int(np.flatnonzero((center == X).all(axis=1))[0]) for center in centers]
    assert (rows[0], rows[-1]) == (0, len(X) - 1)
    assert set(np.diff(rows)) == {12, 13}


def test_standard_deviation_is_that_of_the_projected_process(many):
    X, y = many
    model, query = ridge(50, regularization=1e-2).fit(X, y), inputs(40, seed=2)

    def kernel(A, B):
        return np.exp(-np.sum(((A[:, np.newaxis] - B) / SIGMA) ** 2, axis=2))

    K_mm, K_mn, k = (kernel(model.centers_, other) for other in (model.centers_, X, query))
    prior = 1 - np.sum(k * np.linalg.solve(K_mm + 1e-12 * np.eye(50), k), axis=0)
    posterior = 1e-2 * np.sum(k * np.linalg.solve(1e-2 * K_mm + K_mn @ K_mn.T, k), axis=0)
    residuals, inverse_variance = model.leave_one_out()
    scale = np.sqrt(np.mean(residuals**2 * inverse_variance[:, np.newaxis], axis=0))
    expected = np.sqrt(prior + posterior + 1e-2)[:, np.newaxis] * scale
    np.testing.assert_allclose(model.predict_std(query), expected, rtol=1e-5)


@pytest.mark.parametrize("center_targets", [True, False])
def test_leave_one_out_is_a_fit_in_which_the_row_hardly_counts(center_targets):
    X = inputs(80)
    y, weights = noisy(X), np.resize([0.3, 1.0, 5.0], len(X))
    model = ridge(30, center_targets=center_targets, regularization=1e-3).fit(X, y, weights)
    residuals, inverse_variance = model.leave_one_out()
    one = model.output(1).leave_one_out()[0]
    np.testing.assert_allclose(one, residuals[:, 1], rtol=1e-10)
    for row in (0, 17, 40, 79):  # landmarks and others
        without = np.where(np.arange(len(X)) == row, 1e-12, weights)
        refit = ridge(30, center_targets=center_targets, regularization=1e-3).fit(X, y, without)
        np.testing.assert_allclose(y[row] - refit.predict(X[[row]])[0], residuals[row], rtol=1e-6)
        explained = np.sum(
            (refit.landmarks_.whitening() @ np.exp(-np.sum(((X[row] - refit.centers_) / SIGMA) ** 2, axis=1))) ** 2
        )
        assert 1 / inverse_variance[row] == pytest.approx(1 - explained + 1e-3 / weights[row], rel=1e-6)


def test_the_more_landmarks_the_nearer_to_the_exact_one(many):
    X, y = many
    query = inputs(300, seed=2)
    exact = ridge().fit(X, y)
    errors = []
    for n_landmarks in (20, 60, 180, 540):
        model = ridge(n_landmarks).fit(X, y)
        errors.append(
            [
                np.sqrt(np.mean((getattr(model, name)(query) - getattr(exact, name)(query)) ** 2))
                for name in ("predict", "predict_std")
            ]
        )
    assert np.all(np.array(errors[1:]) < 0.5 * np.array(errors[:-1]))


def test_it_learns_from_the_rows_that_are_no_landmarks(many):
    X, y = many
    query = inputs(300, seed=2)
    error = {
        n: np.sqrt(np.mean((model.predict(query) - smooth(query)) ** 2))
        for n, model in (
            ("all", ridge(200, regularization=1e-2).fit(X, y)),
            ("landmarks", ridge(regularization=1e-2).fit(X[::3], y[::3])),
        )
    }
    assert error["all"] < 0.75 * error["landmarks"]


def test_standard_deviation_is_as_large_as_the_errors(many):
    X, y = many
    model = ridge(150, regularization=1e-3).fit(X, y)
    query = inputs(2000, seed=2)
    standardized = (model.predict(query) - noisy(query, seed=3)) / model.predict_std(query)
    np.testing.assert_allclose(np.sqrt(np.mean(standardized**2, axis=0)), 1, atol=0.1)
    far = model.predict_std(np.full((1, 3), 50.0))
    assert np.all(far > 3 * model.predict_std(query).max(axis=0))


def test_fitting_again_gives_the_same(many):
    X, y = many
    one, other = (ridge(50).fit(X, y) for _ in range(2))
    query = inputs(40, seed=2)
    np.testing.assert_array_equal(one.predict(query), other.predict(query))
    np.testing.assert_array_equal(one.predict_std(query), other.predict_std(query))


def test_rows_beyond_a_block_count_as_well(many, monkeypatch):
    from wam_cast.learning.kernel import landmarks

    X, y = many
    whole = ridge(50).fit(X, y)
    monkeypatch.setattr(landmarks, "BLOCK", 7)
    query = inputs(40, seed=2)
    blocks = ridge(50).fit(X, y)
    np.testing.assert_allclose(blocks.predict(query), whole.predict(query), rtol=0, atol=1e-9)
    np.testing.assert_allclose(blocks.leave_one_out()[0], whole.leave_one_out()[0], rtol=0, atol=1e-9)


def test_an_exact_fit_after_one_with_landmarks_is_exact(many):
    X, y = many
    model = ridge(50).fit(X, y).set_params(n_landmarks=None).fit(X, y)
    query = inputs(40, seed=2)
    np.testing.assert_array_equal(model.predict_std(query), ridge().fit(X, y).predict_std(query))
    model.set_params(n_landmarks=50)  # counts from the next fit on
    np.testing.assert_array_equal(model.leave_one_out()[0], ridge().fit(X, y).leave_one_out()[0])


def test_duplicates_among_the_landmarks_do_no_harm(many):
    X, y = many
    twice = ridge(300).fit(np.repeat(X[:200], 2, axis=0), np.repeat(y[:200], 2, axis=0))
    weighted = ridge(200).fit(X[:200], y[:200], np.full(200, 2.0))
    query = inputs(40, seed=2)
    assert np.all(np.isfinite(twice.predict_std(query)))
    np.testing.assert_allclose(twice.predict(query), weighted.predict(query), atol=0.02)


@pytest.mark.parametrize("n_landmarks", [0, -3, 2.0, True, "many", np.nan, [5]])
def test_a_number_of_landmarks_that_is_none_is_refused(many, n_landmarks):
    with pytest.raises(ValueError, match=r"n_landmarks=.* is not allowed: it must be None or an integer >= 1"):
        ridge(n_landmarks).fit(*many)


def test_landmarks_need_regularization(many):
    with pytest.raises(ValueError, match="regularization=0 is not allowed with n_landmarks"):
        ridge(20, regularization=0.0).fit(*many)


def test_memory_does_not_grow_as_the_square_of_the_rows():
    X = inputs(20_000)
    y, query = noisy(X), inputs(100, seed=2)
    tracemalloc.start()
    try:
        model = ridge(100).fit(X, y)
        model.predict_std(query)
        _, peak = tracemalloc.get_traced_memory()
    finally:
        tracemalloc.stop()
    assert peak < 20_000_000  # a matrix of all rows has 3.2 GB
