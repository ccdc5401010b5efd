"""What is chosen, and the curves, computed again by scikit-learn's kernel ridge regression."""

import numpy as np
import pytest
from sklearn.kernel_ridge import KernelRidge

import wam_cast as wc
from wam_cast.cast import cast_bounds
from wam_cast.experiments.paper import selection
from wam_cast.learning.parts import split_casts

LOWER, UPPER = cast_bounds(wc.Scenario())


@pytest.fixture
def parts(casts):
    return split_casts(casts)


def validation_rmse(parts, sigma, regularization, unit=1.0):
    """Return what the model errs on the validation casts, with inputs divided by `unit`."""
    X, y = parts.train.X, parts.train.landing
    model = KernelRidge(kernel="rbf", gamma=sigma**-2, alpha=regularization).fit(X / unit, y - y.mean())
    residuals = model.predict(parts.validation.X / unit) + y.mean() - parts.validation.landing
    return np.sqrt(np.mean(residuals**2))


def test_the_papers_sigma_is_in_si_units(finished, parts):
    curve = finished[0].selection.papers_curve
    assert curve["x"].tolist() == [1e-8, 1e-6, 1e-4, 1e-2, 1.0]
    expected = [validation_rmse(parts, 0.35, regularization) for regularization in curve["x"]]
    np.testing.assert_allclose(curve["validation_rmse"], expected, rtol=1e-4)


def test_other_sigmas_are_in_units_of_the_bounds(finished, parts):
    found = finished[0].selection
    for i in (8, 16, 24):
        sigma = found.sigma_curve["x"][i]
        expected = validation_rmse(parts, sigma, found.isotropic.regularization, UPPER - LOWER)
        assert found.sigma_curve["validation_rmse"][i] == pytest.approx(expected, rel=1e-3)
    for i in (6, 12, 18):
        expected = validation_rmse(parts, found.isotropic.sigma[0], found.regularization_curve["x"][i], UPPER - LOWER)
        assert found.regularization_curve["validation_rmse"][i] == pytest.approx(expected, rel=1e-3)


@pytest.mark.parametrize("starts", [(0.005, 0.5), (0.5, 0.005)])
def test_of_the_descents_the_lower_end_is_chosen(parts, monkeypatch, starts):
    # From a sigma far below the distances between casts there is no slope to go down.
    monkeypatch.setattr(selection, "DESCENT_STARTS", starts)
    for name in ("SIGMAS", "REGULARIZATIONS", "PAPERS_REGULARIZATIONS"):
        monkeypatch.setattr(selection, name, np.array([0.1]))
    found = selection.select_models(wc.Scenario(), parts, lambda *_: None)
    assert [descent["x"].iloc[0] for descent in found.descents] == pytest.approx(starts)
    ends = {descent["rmse"].iloc[-1]: descent["x"].iloc[-1] for descent in found.descents}
    assert max(ends) > 10 * min(ends)
    assert found.by_validation.sigma == (ends[min(ends)],)
    assert found.by_validation.validation_rmse == pytest.approx(min(ends), rel=1e-3)
    assert found.by_validation.regularization == found.isotropic.regularization
