"""What the model is compared with: exact where it should be, and estimators like any other."""

import warnings
from math import comb

import numpy as np
import pytest
from sklearn.base import clone
from sklearn.exceptions import ConvergenceWarning
from sklearn.gaussian_process import GaussianProcessRegressor
from sklearn.model_selection import cross_val_score
from sklearn.utils.estimator_checks import (
    check_dict_unchanged,
    check_fit_idempotent,
    check_n_features_in,
    parametrize_with_checks,
)
from threadpoolctl import threadpool_limits

from wam_cast.cast import cast_bounds
from wam_cast.experiments.paper import baselines
from wam_cast.generation.sampling import sample_casts
from wam_cast.scenario import Scenario

BOUNDS = cast_bounds(Scenario())
CASTS = sample_casts(Scenario(), 260, seed=0)
X, X_TEST = CASTS[:200], CASTS[200:]

ESTIMATORS = {
    "constant": baselines.constant(),
    "polynomial": baselines.polynomial(4, BOUNDS),
    "additive polynomial": baselines.additive_polynomial(4, BOUNDS),
    "raw polynomial": baselines.raw_polynomial(4),
    "polynomial in one parameter": baselines.single_parameter_polynomial(4, BOUNDS, 1),
    "nearest neighbour": baselines.nearest_neighbour(BOUNDS),
    "gaussian process": baselines.gaussian_process(BOUNDS),
    "neural network": baselines.neural_network(BOUNDS, seed=1),
}
EACH = pytest.mark.parametrize("name", ESTIMATORS)


@pytest.fixture(autouse=True)
def one_thread():
    """Several threads slow down what is small, most of all where tests run side by side."""
    with threadpool_limits(1):
        yield


def landing(casts):
    """A smooth landing [m] that no finite polynomial is."""
    distance, speed, wait = casts.T
    return 0.2 + distance + 0.4 * speed * np.cos(3 * wait)


def exact_polynomial(casts, degree):
    """A polynomial with all products of this total degree, of the size of landings."""
    weights = np.random.default_rng(degree).normal(size=(degree, 3))
    scaled = (casts - BOUNDS[0]) / (BOUNDS[1] - BOUNDS[0])
    return 0.5 + np.prod(scaled @ weights.T + 0.3, axis=1)


def rmse(estimator, targets):
    return np.sqrt(np.mean((estimator.predict(X_TEST) - targets) ** 2))


@parametrize_with_checks(
    [baselines.MonomialFeatures(2), baselines.LegendreFeatures(2, is_additive=True), baselines.NormalEquations()]
)
def test_parts_follow_the_contract_of_scikit_learn(estimator, check):
    check(estimator)


@pytest.mark.slow
@parametrize_with_checks([baselines.SubsetTuned(GaussianProcessRegressor())])
def test_a_process_tuned_on_some_rows_follows_the_contract_of_scikit_learn(estimator, check):
    check(estimator)


@pytest.mark.parametrize("check", [check_n_features_in, check_dict_unchanged, check_fit_idempotent])
def test_a_process_tuned_on_some_rows_keeps_to_the_most_important_of_it(check):
    check("SubsetTuned", baselines.SubsetTuned(GaussianProcessRegressor(), n_rows=20))


@EACH
def test_is_an_estimator_that_learns_the_same_every_time(name):
    original = ESTIMATORS[name]
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        one, other = (clone(original).fit(X, landing(X)) for _ in range(2))
        assert one.predict(X_TEST).shape == (len(X_TEST),)
    np.testing.assert_array_equal(one.predict(X_TEST), other.predict(X_TEST))
    assert clone(original).get_params().keys() == original.get_params().keys()
    scores = cross_val_score(original, X[:60], landing(X[:60]), cv=2)
    assert np.all(scores > 0.3) or name == "constant" or "polynomial" in name


@EACH
def test_inputs_are_not_changed(name):
    casts, landings = X.copy(), landing(X)
    clone(ESTIMATORS[name]).fit(casts, landings).predict(casts)
    np.testing.assert_array_equal(casts, X)
    np.testing.assert_array_equal(landings, landing(X))


def test_constant_is_the_mean():
    fitted = baselines.constant().fit(X, landing(X))
    np.testing.assert_allclose(fitted.predict(X_TEST), landing(X).mean(), rtol=1e-15)


@pytest.mark.parametrize("degree", [1, 2, 3, 5, 7])
def test_polynomial_reproduces_a_polynomial_of_its_degree(degree):
    fitted = baselines.polynomial(degree, BOUNDS).fit(X, exact_polynomial(X, degree))
    assert rmse(fitted, exact_polynomial(X_TEST, degree)) < 1e-9
    assert fitted[-1].coef_.shape == (comb(degree + 3, 3),)
    if degree > 1:
        lower = baselines.polynomial(degree - 1, BOUNDS).fit(X, exact_polynomial(X, degree))
        assert rmse(lower, exact_polynomial(X_TEST, degree)) > 1e-6


def test_legendre_products_are_orthonormal_over_the_cube():
    # Gauss's rule of 6 nodes is exact up to degree 11.
    nodes, weights = np.polynomial.legendre.leggauss(6)
    cube = np.array(np.meshgrid(nodes, nodes, nodes)).reshape(3, -1).T
    measure = np.prod(np.meshgrid(weights, weights, weights), axis=0).ravel() / 8
    terms = baselines.LegendreFeatures(5).fit_transform(cube)
    np.testing.assert_allclose(terms.T @ (measure[:, np.newaxis] * terms), np.eye(comb(8, 3)), atol=1e-12)


def test_monomials_are_all_products_up_to_the_degree():
    terms = baselines.MonomialFeatures(2).fit_transform([[2.0, 3.0, 5.0]])
    assert sorted(terms[0]) == sorted([1, 2, 3, 5, 4, 9, 25, 6, 10, 15])
    alone = baselines.MonomialFeatures(2, is_additive=True).fit_transform([[2.0, 3.0, 5.0]])
    assert sorted(alone[0]) == sorted([1, 2, 3, 5, 4, 9, 25])


@pytest.mark.parametrize("degree", [1, 2, 3])
def test_raw_and_conditioned_polynomial_agree_at_low_degree(degree):
    raw = baselines.raw_polynomial(degree).fit(X, landing(X))
    conditioned = baselines.polynomial(degree, BOUNDS).fit(X, landing(X))
    np.testing.assert_allclose(raw.predict(X_TEST), conditioned.predict(X_TEST), rtol=0, atol=1e-8)


def test_conditioning_is_what_the_scaled_basis_is_for():
    def condition(pipeline):
        return np.linalg.cond(pipeline[:-1].fit_transform(X))

    assert condition(baselines.polynomial(5, BOUNDS)) < 300
    assert condition(baselines.raw_polynomial(5)) > 1e3 * condition(baselines.polynomial(5, BOUNDS))


def test_additive_polynomial_is_exact_without_products_and_only_there():
    def sums(casts):
        return casts[:, 0] ** 4 - 2 * casts[:, 1] ** 3 + casts[:, 2]

    fitted = baselines.additive_polynomial(4, BOUNDS).fit(X, sums(X))
    assert rmse(fitted, sums(X_TEST)) < 1e-9
    assert fitted[-1].coef_.shape == (13,)
    products = baselines.additive_polynomial(12, BOUNDS).fit(X, X[:, 0] * X[:, 1])
    assert rmse(products, X_TEST[:, 0] * X_TEST[:, 1]) > 1e-3


def test_nearest_neighbour_returns_training_targets():
    fitted = baselines.nearest_neighbour(BOUNDS).fit(X, landing(X))
    np.testing.assert_array_equal(fitted.predict(X), landing(X))
    scaled, scaled_test = ((casts - BOUNDS[0]) / (BOUNDS[1] - BOUNDS[0]) for casts in (X, X_TEST))
    nearest = np.argmin(np.linalg.norm(scaled_test[:, np.newaxis] - scaled, axis=2), axis=1)
    np.testing.assert_array_equal(fitted.predict(X_TEST), landing(X)[nearest])


@pytest.mark.parametrize(("name", "most"), [("gaussian process", 1e-3), ("neural network", 1e-2)])
def test_what_learns_any_function_comes_near_a_smooth_one(name, most):
    assert rmse(clone(ESTIMATORS[name]).fit(X, landing(X)), landing(X_TEST)) < most


def test_gaussian_process_chooses_its_kernel_by_some_rows_and_knows_all():
    process = ESTIMATORS["gaussian process"][-1].process
    y = landing(X) + np.random.default_rng(0).normal(scale=0.01, size=len(X))
    few = baselines.SubsetTuned(process, n_rows=50)
    few.fit(X, y)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", ConvergenceWarning)
        alone = clone(process).fit(X[:50], y[:50])
    np.testing.assert_allclose(few.process_.kernel_.theta, alone.kernel_.theta)
    # Its kernel is theirs, and its data are all: the others' landings tell it something.
    everything = clone(process).set_params(kernel=alone.kernel_, optimizer=None).fit(X, y)
    for predicted, expected, by_some in zip(
        *(one.predict(X_TEST, return_std=True) for one in (few, everything, alone)), strict=True
    ):
        np.testing.assert_allclose(predicted, expected, rtol=1e-6, atol=1e-9)
        assert np.max(np.abs(predicted - by_some)) > 1e-4


def test_gaussian_process_chooses_its_kernel_by_400_rows():
    assert ESTIMATORS["gaussian process"][-1].n_rows == baselines.KERNEL_ROWS == 400


def test_seed_decides_the_neural_network():
    one, other = (baselines.neural_network(BOUNDS, seed).fit(X[:50], landing(X[:50])) for seed in (0, 1))
    assert np.any(one.predict(X_TEST) != other.predict(X_TEST))


def test_bounds_are_scaled_to_minus_and_plus_one():
    scaled = baselines.bounds_scaler(BOUNDS).fit_transform(np.array(BOUNDS))
    np.testing.assert_allclose(scaled, [[-1, -1, -1], [1, 1, 1]], atol=1e-12)
