import inspect
import pickle

import numpy as np
import pytest
from scipy.spatial.distance import cdist
from sklearn import kernel_ridge as sklearn_kernel_ridge
from sklearn.base import clone
from sklearn.exceptions import NotFittedError
from sklearn.gaussian_process import GaussianProcessRegressor
from sklearn.gaussian_process.kernels import RBF, ConstantKernel, WhiteKernel
from sklearn.utils.estimator_checks import parametrize_with_checks

from wam_cast.learning.kernel_ridge import KernelRidge

# Inputs of very different units, as distance [m], speed [m/s] and a wait in milliseconds would be.
LOWER = np.array([0.1, -2.0, 0.0])
UPPER = np.array([0.4, 3.0, 700.0])

ARD = (0.4, 0.9, 0.6)


def smooth_targets(X, n_outputs=None):
    """Smooth functions of the scaled inputs with a mean far from 0; 1-D if n_outputs is None."""
    Z = (X - LOWER) / (UPPER - LOWER)
    columns = [5.0 + np.sin(3 * Z[:, 0]) * Z[:, 1], -2.0 + np.cos(2 * Z[:, 2]) + Z[:, 0], Z[:, 1] * Z[:, 2]]
    return columns[0] if n_outputs is None else np.column_stack(columns[:n_outputs])


def random_inputs(n, seed):
    return np.random.default_rng(seed).uniform(LOWER, UPPER, size=(n, 3))


@pytest.fixture
def X():
    return random_inputs(60, seed=0)


@pytest.fixture
def X_query():
    return random_inputs(9, seed=1)


@parametrize_with_checks(
    [
        KernelRidge(),
        KernelRidge(sigma=3.0, regularization=0.1),
        KernelRidge(input_bounds=(0.0, 1.0), center_targets=False),
        KernelRidge(input_bounds=(-5.0, 5.0), regularization=1e-3),
        KernelRidge(n_landmarks=60),
        KernelRidge(n_landmarks=100, regularization=1e-3, center_targets=False),
    ]
)
def test_follows_the_contract_of_scikit_learn(estimator, check):
    check(estimator)


@pytest.mark.parametrize("n_outputs", [None, 1, 3])
@pytest.mark.parametrize("sigma", [0.3, 1.1, ARD])
def test_equals_kernel_ridge_of_scikit_learn(X, X_query, sigma, n_outputs):
    y = smooth_targets(X, n_outputs)
    ours = KernelRidge(sigma=sigma, regularization=1e-3, center_targets=False).fit(X, y)

    lower, upper = X.min(axis=0), X.max(axis=0)
    # A gamma for each input is a gamma of 1 on inputs divided by their sigma.
    Z, Z_query = ((A - lower) / (upper - lower) / sigma for A in (X, X_query))
    theirs = sklearn_kernel_ridge.KernelRidge(kernel="rbf", gamma=1.0, alpha=1e-3).fit(Z, y)

    np.testing.assert_allclose(ours.predict(X_query), theirs.predict(Z_query), rtol=0, atol=1e-8)
    np.testing.assert_allclose(ours.dual_coef_, theirs.dual_coef_, rtol=1e-8, atol=1e-8)
    assert ours.predict(X_query).shape == theirs.predict(Z_query).shape


@pytest.mark.parametrize("n_outputs", [None, 3])
@pytest.mark.parametrize("weights", [0.3, [0.0, 1.0, 2.5]], ids=["a number", "some of them 0"])
def test_weighted_fits_equal_those_of_kernel_ridge_of_scikit_learn(X, X_query, weights, n_outputs):
    y = smooth_targets(X, n_outputs)
    w = np.resize(weights, len(X))
    ours = KernelRidge(sigma=ARD, regularization=1e-3, input_bounds=(LOWER, UPPER), center_targets=False)
    ours.fit(X, y, sample_weight=weights if np.ndim(weights) == 0 else w)

    Z, Z_query = ((A - LOWER) / (UPPER - LOWER) / ARD for A in (X, X_query))
    theirs = sklearn_kernel_ridge.KernelRidge(kernel="rbf", gamma=1.0, alpha=1e-3).fit(Z, y, sample_weight=w)
    np.testing.assert_allclose(ours.predict(X_query), theirs.predict(Z_query), rtol=0, atol=1e-8)
    np.testing.assert_allclose(ours.dual_coef_, theirs.dual_coef_[w > 0], rtol=1e-7, atol=1e-7)
    # Without weights it is another fit.
    assert np.abs(ours.predict(X_query) - clone(ours).fit(X, y).predict(X_query)).max() > 1e-5


@pytest.mark.parametrize("center_targets", [True, False])
def test_a_weight_counts_how_often_a_sample_is_there(X, X_query, center_targets):
    y = smooth_targets(X, 2)
    w = np.resize([0, 1, 2, 3], len(X))
    model = KernelRidge(sigma=ARD, regularization=1e-3, center_targets=center_targets)
    weighted = clone(model).fit(X, y, sample_weight=w).predict(X_query)
    repeated = clone(model).fit(np.repeat(X, w, axis=0), np.repeat(y, w, axis=0)).predict(X_query)
    np.testing.assert_allclose(weighted, repeated, rtol=0, atol=1e-9)


def test_weights_of_one_are_none(X, X_query):
    y = smooth_targets(X, 2)
    plain, weighted = KernelRidge().fit(X, y), KernelRidge().fit(X, y, sample_weight=np.ones(len(X)))
    np.testing.assert_allclose(weighted.predict(X_query), plain.predict(X_query), rtol=1e-12)
    np.testing.assert_array_equal(plain.sample_weight_, 1.0)


@pytest.mark.parametrize(
    ("weights", "message"),
    [
        (
            -1.0,
            r"sample_weight=-1\.0 is not allowed: it must be a finite number >= 0, or one for each of the 60 samples",
        ),
        (np.nan, "sample_weight=nan is not allowed"),
        ([1.0, 2.0], r"sample_weight=\[1\.0, 2\.0\] is not allowed"),
        ("heavy", "sample_weight='heavy' is not allowed"),
        (np.zeros(60), "at least one non-zero number"),
        (np.ones((60, 1)), "sample_weight=.* is not allowed"),
    ],
    ids=["negative", "nan", "two", "text", "all 0", "two-dimensional"],
)
def test_weights_that_cannot_be_are_refused(X, weights, message):
    with pytest.raises(ValueError, match=message):
        KernelRidge().fit(X, smooth_targets(X), sample_weight=weights)


def test_kernel_has_no_factor_of_two():
    model = KernelRidge(sigma=0.5, regularization=0.0, input_bounds=(0, 1), center_targets=False)
    model.fit([[0.0]], [1.0])
    np.testing.assert_allclose(model.predict([[0.5], [1.0]]), np.exp([-1.0, -4.0]), rtol=1e-14)


def test_centering_is_a_fit_to_targets_without_their_mean(X, X_query):
    y = smooth_targets(X, 2)
    centered = KernelRidge(regularization=0.1).fit(X, y)
    by_hand = KernelRidge(regularization=0.1, center_targets=False).fit(X, y - y.mean(axis=0))
    np.testing.assert_allclose(centered.predict(X_query), by_hand.predict(X_query) + y.mean(axis=0), rtol=1e-12)


@pytest.mark.parametrize("n_outputs", [None, 1, 3])
@pytest.mark.parametrize("center_targets", [True, False])
@pytest.mark.parametrize("sigma", [0.5, ARD])
def test_gradient_equals_central_differences(X, X_query, sigma, center_targets, n_outputs):
    model = KernelRidge(sigma=sigma, regularization=1e-4, center_targets=center_targets)
    model.fit(X, smooth_targets(X, n_outputs))
    _, gradient = model.linearize(X_query)

    differences = np.empty_like(gradient)
    for j, step in enumerate(1e-5 * (UPPER - LOWER)):
        h = step * np.eye(3)[j]
        differences[..., j] = (model.predict(X_query + h) - model.predict(X_query - h)) / (2 * step)
    assert gradient.shape == ((9, 3) if n_outputs is None else (9, n_outputs, 3))
    # In units of the scaled inputs, so that one tolerance is fair to every input.
    np.testing.assert_allclose(gradient * (UPPER - LOWER), differences * (UPPER - LOWER), rtol=1e-6, atol=1e-7)


@pytest.mark.parametrize("n_outputs", [None, 1, 2, 3])
@pytest.mark.parametrize("center_targets", [True, False])
@pytest.mark.parametrize("sigma", [0.5, ARD])
def test_expansion_is_the_prediction_with_its_gradient(X, X_query, sigma, center_targets, n_outputs):
    model = KernelRidge(sigma=sigma, regularization=1e-4, center_targets=center_targets)
    model.fit(X, smooth_targets(X, n_outputs))
    Z, Z_query = (A / model.length_scale_ for A in (X, X_query))
    K, offsets = np.exp(-cdist(Z_query, Z, "sqeuclidean")), Z_query[:, np.newaxis] - Z
    gradient = -2 * np.einsum("qn,n...,qni->q...i", K, model.dual_coef_, offsets) / model.length_scale_
    for found, expected in zip(model.linearize(X_query), (model.predict(X_query), gradient), strict=True):
        assert found.shape == expected.shape
        scale = np.abs(expected).reshape(len(X_query), -1).max()
        np.testing.assert_allclose(found, expected, rtol=1e-9, atol=1e-11 * scale)


@pytest.mark.parametrize("n_outputs", [None, 1, 2])
def test_prediction_beside_the_gradient_is_that_of_predict(X, X_query, n_outputs):
    model = KernelRidge(regularization=1e-3).fit(X, smooth_targets(X, n_outputs))
    prediction, _ = model.linearize(X_query)
    np.testing.assert_allclose(prediction, model.predict(X_query), rtol=1e-12)
    assert prediction.shape == model.predict(X_query).shape


@pytest.mark.parametrize("lam", [1e-4, 1e-1])
@pytest.mark.parametrize("n_outputs", [None, 2])
def test_leave_one_out_knows_the_diagonal_of_the_inverse(X, lam, n_outputs):
    model = KernelRidge(sigma=ARD, regularization=lam).fit(X, smooth_targets(X, n_outputs))
    residuals, inverse_diagonal = model.leave_one_out()
    Z = (X - X.min(axis=0)) / np.ptp(X, axis=0) / ARD
    K = np.exp(-cdist(Z, Z, "sqeuclidean"))
    np.testing.assert_allclose(inverse_diagonal, np.diag(np.linalg.inv(K + lam * np.eye(len(X)))), rtol=1e-8)
    np.testing.assert_array_equal(residuals, model.leave_one_out_residuals())


@pytest.mark.parametrize("weighted", [False, True])
@pytest.mark.parametrize("n_outputs", [None, 2])
@pytest.mark.parametrize("center_targets", [True, False])
@pytest.mark.parametrize("sigma", [0.5, ARD])
def test_leave_one_out_residuals_equal_refits(X, sigma, center_targets, n_outputs, weighted):
    model = KernelRidge(sigma=sigma, regularization=1e-3, input_bounds=(LOWER, UPPER), center_targets=center_targets)
    y = smooth_targets(X, n_outputs)
    w = np.resize([0.2, 1.0, 7.0], len(X)) if weighted else np.ones(len(X))
    refits = np.empty_like(y)
    for i in range(len(X)):
        others = np.arange(len(X)) != i
        refits[i] = y[i] - clone(model).fit(X[others], y[others], w[others]).predict(X[[i]])[0]
    residuals = model.fit(X, y, w if weighted else None).leave_one_out_residuals()
    assert residuals.shape == y.shape
    np.testing.assert_allclose(residuals, refits, rtol=0, atol=1e-10)


def test_leave_one_out_residuals_keep_the_parameters_of_the_fit(X):
    model = KernelRidge(regularization=1e-3).fit(X, smooth_targets(X))
    before = model.leave_one_out_residuals()
    model.set_params(sigma=2.0, regularization=1.0, center_targets=False, input_bounds=(0, 1))
    np.testing.assert_array_equal(model.leave_one_out_residuals(), before)


@pytest.mark.parametrize("n_outputs", [None, 2])
@pytest.mark.parametrize("lam", [1e-6, 1e-2])
def test_std_is_that_of_a_gaussian_process_of_scikit_learn(X, X_query, n_outputs, lam):
    y = smooth_targets(X, n_outputs)
    model = KernelRidge(sigma=ARD, regularization=lam, input_bounds=(LOWER, UPPER)).fit(X, y)
    std = model.predict_std(X_query)
    assert std.shape == model.predict(X_query).shape

    Z, Z_query = ((A - LOWER) / (UPPER - LOWER) for A in (X, X_query))
    kernel = RBF(np.array(ARD) / np.sqrt(2)) + WhiteKernel(lam)
    inverse = np.linalg.inv(kernel(Z))
    for output, residuals in enumerate(model.leave_one_out_residuals().reshape(len(X), -1).T):
        variance = np.mean(residuals**2 * np.diag(inverse))
        scaled = ConstantKernel(variance) * RBF(np.array(ARD) / np.sqrt(2)) + WhiteKernel(variance * lam)
        process = GaussianProcessRegressor(scaled, alpha=0.0, optimizer=None)
        target = y.reshape(len(X), -1)[:, output] - np.mean(y, axis=0).ravel()[output]
        mean, expected = process.fit(Z, target).predict(Z_query, return_std=True)
        np.testing.assert_allclose(std.reshape(9, -1)[:, output], expected, rtol=1e-6)
        np.testing.assert_allclose(
            model.predict(X_query).reshape(9, -1)[:, output] - np.mean(y, axis=0).ravel()[output], mean, atol=1e-6
        )


def test_std_of_a_weighted_fit_is_that_of_a_process_whose_samples_have_that_noise(X, X_query):
    y, w, lam = smooth_targets(X), np.resize([0.2, 1.0, 7.0], len(X)), 1e-2
    model = KernelRidge(sigma=ARD, regularization=lam, input_bounds=(LOWER, UPPER)).fit(X, y, w)
    residuals, inverse_diagonal = model.leave_one_out()
    variance = np.mean(residuals**2 * inverse_diagonal)
    Z, Z_query = ((A - LOWER) / (UPPER - LOWER) for A in (X, X_query))
    kernel = ConstantKernel(variance) * RBF(np.array(ARD) / np.sqrt(2))
    process = GaussianProcessRegressor(kernel, alpha=variance * lam / w, optimizer=None)
    _, std = process.fit(Z, y).predict(Z_query, return_std=True)
    np.testing.assert_allclose(model.predict_std(X_query), np.sqrt(std**2 + variance * lam), rtol=1e-6)


def test_std_is_as_large_as_the_errors():
    # Of a process with this very kernel; 400 residuals determine the scale to about 4 %.
    rng = np.random.default_rng(0)
    Z = rng.uniform(size=(800, 3))
    K = np.exp(-cdist(Z, Z, "sqeuclidean") / 0.5**2) + 1e-10 * np.eye(800)
    y = 30.0 * (np.linalg.cholesky(K) @ rng.normal(size=800) + 0.1 * rng.normal(size=800))
    model = KernelRidge(sigma=0.5, regularization=0.01, input_bounds=(0, 1)).fit(Z[:400], y[:400])
    standardized = (model.predict(Z[400:]) - y[400:]) / model.predict_std(Z[400:])
    assert np.sqrt(np.mean(standardized**2)) == pytest.approx(1.0, abs=0.1)


def test_std_grows_from_the_noise_to_the_signal_away_from_the_training_rows(X):
    lam = 1e-4
    model = KernelRidge(sigma=0.5, regularization=lam, input_bounds=(LOWER, UPPER)).fit(X, smooth_targets(X))
    at_row, nowhere = model.predict_std(np.vstack([X[:1], UPPER + 100 * (UPPER - LOWER)]))
    scale = nowhere / np.sqrt(1 + lam)
    assert np.sqrt(lam) * scale < at_row < np.sqrt(2 * lam) * scale


def test_interpolates_without_regularization(X):
    y = smooth_targets(X, 2)
    model = KernelRidge(sigma=0.2, regularization=0.0).fit(X, y)
    np.testing.assert_allclose(model.predict(X), y, rtol=0, atol=1e-9)


@pytest.mark.parametrize("center_targets", [True, False])
def test_strong_regularization_predicts_the_mean_or_zero(X, X_query, center_targets):
    y = smooth_targets(X, 2)
    model = KernelRidge(regularization=1e12, center_targets=center_targets).fit(X, y)
    expected = y.mean(axis=0) if center_targets else np.zeros(2)
    np.testing.assert_allclose(model.predict(X_query), np.tile(expected, (9, 1)), rtol=0, atol=1e-8)


def test_far_from_the_training_inputs_predicts_the_mean_with_no_gradient(X):
    y = smooth_targets(X)
    model = KernelRidge().fit(X, y)
    prediction, gradient = model.linearize(UPPER[np.newaxis] + 100 * (UPPER - LOWER))
    np.testing.assert_allclose(prediction, y.mean(), rtol=1e-14)
    np.testing.assert_array_equal(gradient, 0.0)


def test_order_of_training_rows_does_not_matter(X, X_query):
    y = smooth_targets(X, 2)
    shuffled = np.random.default_rng(2).permutation(len(X))
    one = KernelRidge(regularization=1e-4).fit(X, y)
    other = KernelRidge(regularization=1e-4).fit(X[shuffled], y[shuffled])
    np.testing.assert_allclose(one.predict(X_query), other.predict(X_query), rtol=1e-9)
    np.testing.assert_allclose(
        one.leave_one_out_residuals()[shuffled], other.leave_one_out_residuals(), rtol=0, atol=1e-9
    )


def test_units_of_the_inputs_do_not_matter(X, X_query):
    y = smooth_targets(X, 2)
    slope, shift = np.array([1000.0, -0.01, 3.0]), np.array([5.0, -1.0, 40.0])
    one = KernelRidge(sigma=ARD, regularization=1e-4).fit(X, y)
    other = KernelRidge(sigma=ARD, regularization=1e-4).fit(slope * X + shift, y)
    np.testing.assert_allclose(other.predict(slope * X_query + shift), one.predict(X_query), rtol=1e-9)
    # The gradient is in the units of the inputs, so it does change, by the chain rule.
    scaled_gradient = other.linearize(slope * X_query + shift)[1] * slope * (UPPER - LOWER)
    np.testing.assert_allclose(scaled_gradient, one.linearize(X_query)[1] * (UPPER - LOWER), rtol=1e-7, atol=1e-8)


def test_units_of_the_targets_do_not_matter(X, X_query):
    y = smooth_targets(X)
    one = KernelRidge().fit(X, y)
    other = KernelRidge().fit(X, 100.0 * y - 3.0)
    np.testing.assert_allclose(other.predict(X_query), 100.0 * one.predict(X_query) - 3.0, rtol=1e-9)


def test_equal_sigmas_are_one_sigma(X, X_query):
    y = smooth_targets(X)
    one = KernelRidge(sigma=0.4, regularization=1e-3).fit(X, y)
    three = KernelRidge(sigma=[0.4, 0.4, 0.4], regularization=1e-3).fit(X, y)
    np.testing.assert_array_equal(three.predict(X_query), one.predict(X_query))


def test_wide_sigma_ignores_its_input(X, X_query):
    model = KernelRidge(sigma=[0.4, 1e6, 0.4], regularization=1e-3).fit(X, smooth_targets(X))
    moved = X_query.copy()
    moved[:, 1] = LOWER[1]
    np.testing.assert_allclose(model.predict(moved), model.predict(X_query), rtol=1e-9)


def test_sigma_is_in_units_of_the_bounds(X, X_query):
    y = smooth_targets(X)
    wide_bounds = (LOWER, LOWER + 2 * (UPPER - LOWER))
    one = KernelRidge(sigma=0.6, regularization=1e-3, input_bounds=(LOWER, UPPER)).fit(X, y)
    other = KernelRidge(sigma=0.3, regularization=1e-3, input_bounds=wide_bounds).fit(X, y)
    np.testing.assert_allclose(other.predict(X_query), one.predict(X_query), rtol=1e-9)
    np.testing.assert_allclose(one.length_scale_, 0.6 * (UPPER - LOWER), rtol=1e-12)


def test_unit_bounds_leave_the_inputs_as_they_are():
    X = np.random.default_rng(3).normal(size=(20, 3))
    y = X[:, 0]
    model = KernelRidge(sigma=0.7, regularization=0.5, input_bounds=(0, 1), center_targets=False).fit(X, y)
    K = np.exp(-(cdist(X, X) ** 2) / 0.7**2)
    np.testing.assert_allclose(model.predict(X), K @ np.linalg.solve(K + 0.5 * np.eye(20), y), rtol=1e-10)


@pytest.mark.parametrize("constant", [0.0, 1e6])
def test_constant_input_is_ignored(X, X_query, constant):
    y = smooth_targets(X)
    X_constant = np.column_stack([X, np.full(len(X), constant)])
    X_other = np.column_stack([X_query, np.linspace(-3, 3, len(X_query))])
    with_column = KernelRidge(regularization=1e-3).fit(X_constant, y)
    without = KernelRidge(regularization=1e-3).fit(X, y)

    prediction, gradient = with_column.linearize(X_other)
    np.testing.assert_allclose(prediction, without.predict(X_query), rtol=1e-10)
    np.testing.assert_array_equal(gradient[:, 3], 0.0)
    np.testing.assert_allclose(gradient[:, :3], without.linearize(X_query)[1], rtol=1e-10)


def test_one_training_row_is_predicted_everywhere():
    model = KernelRidge().fit([[1.0, 2.0]], [3.0])
    np.testing.assert_array_equal(model.predict([[1.0, 2.0], [50.0, -7.0]]), 3.0)
    with pytest.raises(ValueError, match=r"n_samples=1 .* at least 2"):
        model.leave_one_out_residuals()
    with pytest.raises(ValueError, match=r"n_samples=1 .* at least 2"):
        model.predict_std([[1.0, 2.0]])


def test_same_data_gives_bitwise_the_same_model(X, X_query):
    y = smooth_targets(X, 2)
    one, other = (KernelRidge(sigma=ARD).fit(X, y).linearize(X_query) for _ in range(2))
    np.testing.assert_array_equal(one[0], other[0])
    np.testing.assert_array_equal(one[1], other[1])


def test_pickle_and_clone(X, X_query):
    bounds = (LOWER, UPPER)
    model = KernelRidge(sigma=np.array(ARD), input_bounds=bounds).fit(X, smooth_targets(X))
    loaded = pickle.loads(pickle.dumps(model))
    np.testing.assert_array_equal(loaded.predict(X_query), model.predict(X_query))

    cloned = clone(model)
    np.testing.assert_array_equal(cloned.sigma, ARD)
    with pytest.raises(NotFittedError):
        cloned.predict(X_query)


def test_model_does_not_share_memory_with_its_data(X, X_query):
    y = smooth_targets(X)
    model = KernelRidge(regularization=1e-3, input_bounds=(LOWER, UPPER)).fit(X, y)
    before = model.predict(X_query)
    X[:], y[:] = 0.0, 0.0
    np.testing.assert_array_equal(model.predict(X_query), before)
    assert not np.shares_memory(model.input_offset_, LOWER)


@pytest.mark.parametrize("method", ["predict", "predict_std"])
def test_methods_need_a_fit(method, X_query):
    with pytest.raises(NotFittedError, match="KernelRidge"):
        getattr(KernelRidge(), method)(X_query)
    with pytest.raises(NotFittedError, match="KernelRidge"):
        KernelRidge().leave_one_out_residuals()


@pytest.mark.parametrize(
    ("parameters", "message"),
    [
        ({"sigma": 0.0}, r"sigma=0\.0 is not allowed.*> 0.*pass for example sigma="),
        ({"sigma": -0.5}, r"sigma=-0\.5 is not allowed"),
        ({"sigma": np.nan}, r"sigma=nan is not allowed.*finite"),
        ({"sigma": np.inf}, r"sigma=inf is not allowed.*finite"),
        ({"sigma": "wide"}, r"sigma='wide' is not allowed"),
        ({"sigma": [0.3, 0.4]}, r"sigma=\[0\.3, 0\.4\] is not allowed.*each of the 3 inputs"),
        ({"sigma": [0.3, -0.4, 0.3]}, r"sigma=\[0\.3, -0\.4, 0\.3\] is not allowed"),
        ({"sigma": [[0.3, 0.4, 0.3]]}, r"sigma=\[\[0\.3, 0\.4, 0\.3\]\] is not allowed"),
        ({"regularization": -1e-3}, r"regularization=-0\.001 is not allowed.*>= 0.*pass for example"),
        ({"regularization": np.nan}, r"regularization=nan is not allowed.*finite"),
        ({"regularization": np.inf}, r"regularization=inf is not allowed.*finite"),
        ({"regularization": None}, r"regularization=None is not allowed"),
        ({"input_bounds": 3.0}, r"input_bounds=3\.0 is not allowed.*pair \(lower, upper\)"),
        ({"input_bounds": (1.0, 1.0)}, r"input_bounds=\(1\.0, 1\.0\) .*lower < upper"),
        ({"input_bounds": (0.0, np.inf)}, r"input_bounds=\(0\.0, inf\) .*finite"),
        ({"input_bounds": ([0, 0], [1, 1])}, r"input_bounds=.*each of the 3 inputs"),
        ({"input_bounds": (0, 1, 2)}, r"input_bounds=\(0, 1, 2\) .*pair"),
    ],
)
def test_wrong_parameter_is_named_with_what_is_allowed(X, parameters, message):
    with pytest.raises(ValueError, match=message):
        KernelRidge(**parameters).fit(X, smooth_targets(X))


def test_wrong_shape_is_named(X, X_query):
    model = KernelRidge().fit(X, smooth_targets(X))
    with pytest.raises(ValueError, match="2 features, but KernelRidge is expecting 3"):
        model.predict(X_query[:, :2])
    with pytest.raises(ValueError, match="Expected 2D array, got 1D array"):
        model.predict_std(X_query[0])
    with pytest.raises(ValueError, match="inconsistent numbers of samples"):
        model.fit(X, smooth_targets(X)[:-1])


@pytest.mark.parametrize("n_duplicates", [1, 30])
def test_singular_kernel_says_what_to_do(X, n_duplicates):
    X_twice = np.vstack([X, X[:n_duplicates]])
    y = smooth_targets(X_twice)
    with pytest.raises(np.linalg.LinAlgError, match=r"regularization=0: raise.*duplicates.*lower sigma"):
        KernelRidge(sigma=0.2, regularization=0.0).fit(X_twice, y)
    KernelRidge(sigma=0.2, regularization=1e-10).fit(X_twice, y)


def test_singular_kernel_is_not_passed_off_as_a_fit_by_rounding(X):
    # Cholesky's last pivot is about 2e-15: above 0, and noise.
    X_twice = np.vstack([X, X[:1]])
    with pytest.raises(np.linalg.LinAlgError, match="singular to working precision"):
        KernelRidge(sigma=0.01, regularization=1e-15).fit(X_twice, smooth_targets(X_twice))


@pytest.mark.parametrize("n_outputs", [None, 2])
def test_standard_deviations_come_with_predictions_as_from_scikit_learn(n_outputs):
    X = random_inputs(50, seed=1)
    y = smooth_targets(X, n_outputs)
    model = KernelRidge().fit(X, y)
    mean, std = model.predict(X[:7], return_std=True)
    np.testing.assert_array_equal(mean, model.predict(X[:7]))
    np.testing.assert_array_equal(std, model.predict_std(X[:7]))
    process = GaussianProcessRegressor().fit(X, y)
    assert [one.shape for one in (mean, std)] == [one.shape for one in process.predict(X[:7], return_std=True)]


def test_its_signature_can_be_read():
    assert "sigma: 'float | ArrayLike' = 0.35" in str(inspect.signature(KernelRidge))


def test_one_output_is_that_of_all():
    X = random_inputs(50, seed=1)
    y = smooth_targets(X, 2)
    model = KernelRidge().fit(X, y)
    values, gradient = model.linearize(X[:4])
    one, slope = model.output(1).linearize(X[:4])
    np.testing.assert_allclose(one, values[:, 1])
    np.testing.assert_allclose(slope, gradient[:, 1])
