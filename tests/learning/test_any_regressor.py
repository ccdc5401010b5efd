"""A regressor of one's own in the place of kernel ridge regression."""

from dataclasses import asdict, replace

import numpy as np
import pytest
from sklearn.ensemble import GradientBoostingRegressor, RandomForestRegressor
from sklearn.linear_model import LinearRegression

from wam_cast.cast import cast_bounds
from wam_cast.errors import InputError
from wam_cast.learning.any_regressor import AnyRegressor
from wam_cast.learning.forward_model import ForwardModel
from wam_cast.learning.kernel_ridge import KernelRidge
from wam_cast.learning.parts import split_casts
from wam_cast.learning.reference import reference_dataset, reference_model
from wam_cast.planning.plan import plan_cast
from wam_cast.scenario import Scenario

BOUNDS = cast_bounds(Scenario())


@pytest.fixture(scope="module")
def data():
    return reference_dataset()


@pytest.fixture(scope="module")
def forest(data):
    return ForwardModel.fit(data, estimator=RandomForestRegressor(20, random_state=0))


def fitted(regressor, n_outputs=7):
    X = np.random.default_rng(0).uniform(*BOUNDS, (60, 3))
    return AnyRegressor(regressor, BOUNDS).fit(X, np.column_stack([X @ [1.0, -2.0, 0.5 * i] for i in range(n_outputs)]))


def test_it_is_fitted_to_the_training_casts_and_measured_on_the_others(data, forest):
    parts = split_casts(data)
    own = RandomForestRegressor(20, random_state=0).fit(parts.train.X, parts.train.y)
    X = parts.validation.X
    np.testing.assert_array_equal(forest.predict(X), own.predict(X))
    errors = own.predict(X)[:, 0] - parts.validation.landing
    assert forest.info.validation_rmse == pytest.approx(np.sqrt(np.mean(errors**2)))
    assert (forest.info.n_train, forest.info.n_test) == (len(parts.train.X), parts.n_test)
    assert np.mean(np.abs(errors) <= 2 * forest.linearize(X[0]).std) == pytest.approx(0.95, abs=0.01)
    assert forest.linearize(X[0]).std == forest.linearize(X[1]).std
    assert not np.any(forest.linearize(X[0]).std_gradient)
    assert forest.reach == reference_model().reach


def test_a_clone_is_fitted():
    given = LinearRegression()
    fitted(given)
    assert not hasattr(given, "coef_")


def test_derivatives_are_those_of_the_prediction():
    line = fitted(LinearRegression())
    X = np.random.default_rng(1).uniform(*BOUNDS, (4, 3))
    values, gradient = line.linearize(X)
    np.testing.assert_allclose(values, line.predict(X))
    assert gradient.shape == (4, 7, 3)
    np.testing.assert_allclose(gradient[2], [[1.0, -2.0, 0.5 * i] for i in range(7)], atol=1e-9)
    landing, slope = line.output(3).linearize(X)
    np.testing.assert_allclose(landing, values[:, 3])
    np.testing.assert_allclose(slope, gradient[:, 3])


def test_smooth_derivatives_are_close_to_those_in_closed_form(data):
    closed = reference_model()
    info = closed.info
    estimator = KernelRidge(sigma=info.sigma, regularization=info.regularization, input_bounds=BOUNDS)
    own = AnyRegressor(estimator, BOUNDS).fit(closed.training_casts, closed.training_outputs)
    X = closed.training_casts[:20]
    wanted = closed.landing_with_gradient(X)[1] * (BOUNDS[1] - BOUNDS[0])
    found = own.output(0).linearize(X)[1] * (BOUNDS[1] - BOUNDS[0])
    np.testing.assert_allclose(found, wanted, atol=0.02 * np.abs(wanted).max())


@pytest.mark.parametrize("method", ["program", "gradient"])
def test_planners_work_on_it(forest, method):
    plan = plan_cast(forest, (0.6, 0.2), method)
    assert plan.predicted_std.along == pytest.approx(forest.uncertainty.value, rel=0.5)


@pytest.mark.slow
def test_a_kernel_ridge_keeps_its_hyperparameters(data):
    info = reference_model().info
    model = ForwardModel.fit(data, estimator=KernelRidge(sigma=info.sigma, regularization=info.regularization))
    same = ForwardModel.from_hyperparameters(data, info.sigma, info.regularization)  # whose test casts stay closed
    assert model.info == replace(same.info, test_rmse=model.info.test_rmse)
    # The shipped model was fitted by another build of the same routines.
    for name, shipped in asdict(info).items():
        assert getattr(model.info, name) == (shipped and pytest.approx(shipped, rel=1e-6)), name
    X = model.training_casts[:5]
    np.testing.assert_array_equal(model.predict(X), reference_model().predict(X))


def test_it_is_not_saved(forest, tmp_path):
    with pytest.raises(InputError, match=r"a\.model: only a model by kernel ridge regression is saved"):
        forest.save(tmp_path / "a.model")
    assert not list(tmp_path.iterdir())


@pytest.mark.parametrize("wrong", [None, "forest", RandomForestRegressor])
def test_what_is_no_regressor_is_refused(wrong):
    with pytest.raises(InputError, match="is no regressor: give an instance"):
        fitted(wrong)


def test_one_that_has_one_output_is_refused_with_the_remedy():
    with pytest.raises(
        InputError, match=r"GradientBoostingRegressor cannot be fitted to 7 outputs .*MultiOutputRegressor"
    ):
        fitted(GradientBoostingRegressor())


def test_one_that_predicts_something_else_is_refused():
    class Flat(LinearRegression):
        def predict(self, X):
            return np.zeros(len(X))

    with pytest.raises(InputError, match=r"predictions of 2 casts are not 7 finite numbers each"):
        fitted(Flat())
