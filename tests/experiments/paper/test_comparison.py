"""The comparison's numbers, computed again from the casts."""

import numpy as np
import pytest
from scipy.stats import norm

import wam_cast as wc
from wam_cast.cast import cast_bounds
from wam_cast.experiments.paper import baselines
from wam_cast.experiments.paper.comparison import COVERAGE
from wam_cast.experiments.paper.selection import make_estimator
from wam_cast.experiments.statistics import coverage
from wam_cast.learning.kernel_ridge import KernelRidge
from wam_cast.learning.parts import split_casts

BOUNDS = cast_bounds(wc.Scenario())


@pytest.fixture
def found(finished):
    return finished[0].comparison


@pytest.fixture
def parts(casts):
    return split_casts(casts)


@pytest.fixture
def ard(finished, parts):
    """The model with ARD length scales, fitted anew."""
    chosen = finished[0].selection.per_parameter
    return make_estimator(wc.Scenario(), chosen).fit(parts.train.X, parts.train.landing)


def row_of(found, name):
    (row,) = found.rows[found.rows["name"] == name].to_dict("records")
    return row


def nearest(train, casts):
    scaled = [casts / (BOUNDS[1] - BOUNDS[0]) for casts in (casts, train.X)]
    distances = np.linalg.norm(scaled[0][:, np.newaxis] - scaled[1], axis=2)
    return train.landing[np.argmin(distances, axis=1)]


@pytest.mark.slow
def test_rows_are_errors_on_the_test_casts(found, parts, casts):
    measured = casts.frame["landing_along"].to_numpy()[80:]
    assert found.test_measured.tolist() == measured.tolist()
    train, test = parts.train, parts.open_test()
    for name, predicted in (("constant", train.landing.mean()), ("nearest_neighbour", nearest(train, test.X))):
        row, errors = row_of(found, name), np.sort(np.abs(predicted - measured))
        assert row["rmse"] == pytest.approx(np.sqrt(np.mean(errors**2)), rel=1e-12)
        assert (row["median"], row["max"]) == pytest.approx((errors[2], errors[4]), rel=1e-12)
        assert row["p95"] == pytest.approx(0.2 * errors[3] + 0.8 * errors[4], rel=1e-12)
        assert row["rmse_interval"][0] < row["rmse"] < row["rmse_interval"][1]


def test_rows_know_the_validation_error_too(found, parts):
    residuals = parts.train.landing.mean() - parts.validation.landing
    assert row_of(found, "constant")["validation_rmse"] == pytest.approx(np.sqrt(np.mean(residuals**2)), rel=1e-12)


def test_test_landings_are_predicted_by_the_model_of_all_sigmas(found, parts, ard):
    np.testing.assert_allclose(found.test_predicted, ard.predict(parts.open_test().X), rtol=0, atol=1e-9)


def test_each_polynomial_has_its_error_on_each_part(found, parts):
    fitted = baselines.polynomial(2, BOUNDS).fit(parts.train.X, parts.train.landing)
    expected = [
        np.sqrt(np.mean((fitted.predict(part.X) - part.landing) ** 2))
        for part in (parts.train, parts.validation, parts.open_test())
    ]
    two = found.polynomials.iloc[1]
    assert (two.training_rmse, two.validation_rmse, two.test_rmse) == pytest.approx(expected, rel=1e-6)


def test_held_out_residuals_are_prediction_minus_what_was_measured(finished, found, parts, ard):
    chosen, (train, validation) = finished[0].selection.per_parameter, (parts.train, parts.validation)
    held_out = found.held_out
    np.testing.assert_array_equal(
        np.column_stack([held_out.distance, held_out.speed, held_out.wait]), np.vstack([train.X, validation.X])
    )
    for row in range(0, len(train.X), 8):
        others = np.arange(len(train.X)) != row
        refit = KernelRidge(
            sigma=np.array(chosen.sigma), regularization=chosen.regularization, input_bounds=BOUNDS
        ).fit(train.X[others], train.landing[others])
        (predicted,) = refit.predict(train.X[[row]])
        assert held_out.residual[row] == pytest.approx(predicted - train.landing[row], rel=1e-3, abs=1e-9)
    np.testing.assert_allclose(
        held_out.residual[len(train.X) :], ard.predict(validation.X) - validation.landing, rtol=0, atol=1e-9
    )


def test_the_worst_casts_are_the_twentieth_of_largest_error(found):
    squares = np.array(found.held_out.residual) ** 2
    assert (len(squares), found.held_out.worst) == (80, 0.05)
    worst = np.argsort(squares)[-4:]
    assert found.held_out.share_of_worst == pytest.approx(squares[worst].sum() / squares.sum(), rel=1e-12)


def test_coverage_of_normal_errors_is_what_their_std_says():
    rng = np.random.default_rng(0)
    mean, std = rng.normal(size=(2, 100_000))
    std = np.exp(std)
    measured = mean + std * rng.standard_normal(len(std))
    np.testing.assert_allclose(coverage(mean - measured, std, COVERAGE), COVERAGE, rtol=0, atol=0.006)
    # Twice the std that they have.
    wide = coverage(mean - measured, 2 * std, COVERAGE)
    np.testing.assert_allclose(wide, 2 * norm.cdf(2 * norm.ppf((1 + COVERAGE) / 2)) - 1, rtol=0, atol=0.006)


def test_calibration_is_that_of_the_validation_casts(found, parts, ard):
    train, validation = parts.train, parts.validation
    process = baselines.gaussian_process(BOUNDS).fit(train.X, train.landing)
    predictions = {
        "KRR": (ard.predict(validation.X), ard.predict_std(validation.X)),
        "Gaussian process": process.predict(validation.X, return_std=True),
    }
    assert found.empirical.keys() == predictions.keys()
    for name, (mean, std) in predictions.items():
        levels = 2 * norm.cdf(np.abs(mean - validation.landing) / std) - 1
        shares = [np.mean(levels <= share) for share in found.coverage]
        np.testing.assert_allclose(found.empirical[name], shares, rtol=0, atol=1e-12, err_msg=name)
