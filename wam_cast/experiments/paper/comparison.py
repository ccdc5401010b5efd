"""The comparison of estimators on one split: fitted and chosen without the test part, which is opened once, for all of them."""

from __future__ import annotations

import time
from dataclasses import dataclass
from typing import Any

import numpy as np
import pandas as pd

from wam_cast.cast import PARAMETERS, cast_bounds
from wam_cast.experiments.frames import Record, Result, Rows, Values, records
from wam_cast.experiments.paper import baselines
from wam_cast.experiments.paper.selection import Selection, make_estimator
from wam_cast.experiments.paper.settings import OnProgress
from wam_cast.experiments.statistics import coverage, rmse, rmse_interval
from wam_cast.learning.kernel_ridge import KernelRidge
from wam_cast.learning.parts import Part, Parts
from wam_cast.parallel.seeds import Purpose, derived_seed
from wam_cast.scenario import Scenario

DEGREES = range(1, 13)
COVERAGE = np.arange(0.05, 1.0, 0.05)
WORST = 0.05
"""Share of the casts that are called the worst."""

N_PREDICTIONS = 1000
"""Casts that are predicted at once to time a prediction."""


class Residuals(Result):
    """Casts and what the model errs there [m], as one that has not seen them: leave-one-out, then the validation casts.

    `share_of_worst` of the squared error is that of the `worst` casts, a share too.
    """

    distance: Values
    speed: Values
    wait: Values
    residual: Values
    worst: float
    share_of_worst: float


class Comparison(Result):
    """What opens the test part: all estimators on it.

    Attributes
    ----------
    rows
        A row an estimator: its name and label; `rmse` with its bootstrap interval `rmse_interval`, `median`, `p95` and `max` of its
        errors on the test casts, and `validation_rmse` [m]; what it costs, `fit_s` [s] and `predict_us` [us a cast].
    polynomials
        Of degree 1 to 12, well conditioned. A row a polynomial: its `label`, `degree`, number of terms, the `condition` number of
        its least squares (nan if there are more terms than training casts, so that these have many solutions), and its
        `training_rmse`, `validation_rmse` and `test_rmse` [m].
    variants
        Polynomials as others may fit them.
    test_measured, test_predicted
        Landings along the casting plane [m], predicted by the model with ARD length scales.
    held_out
        Where that model errs.
    coverage, empirical
        Share of the validation casts that should be, and are, within a model's central interval.
    """

    rows: Rows
    polynomials: Rows
    variants: Rows
    test_measured: Values
    test_predicted: Values
    held_out: Residuals
    coverage: Values
    empirical: dict[str, Values]

    def row(self, name: str) -> Record:
        """Return the row of that name."""
        (row,) = records(self.rows[self.rows["name"] == name])
        return row


@dataclass(frozen=True)
class _Fitted:
    """An estimator after its fit: its errors on training and validation casts, and how long the fit took."""

    name: str
    label: str
    estimator: Any
    training_rmse: float
    validation_rmse: float
    fit_s: float


def compare(scenario: Scenario, parts: Parts, selection: Selection, seed: int, report: OnProgress) -> Comparison:
    """Fit all estimators to the training casts, then open the test part and measure them there."""
    candidates = _candidates(scenario, selection, seed)
    report(0, len(candidates))
    fitted: dict[str, _Fitted] = {}
    for done, (name, (label, estimator)) in enumerate(candidates.items(), 1):
        fitted[name] = _fit(name, label, estimator, parts)
        report(done, len(candidates))
    polynomials = [fitted[f"polynomial_{degree}"] for degree in DEGREES]
    best = min(polynomials, key=lambda one: one.validation_rmse)
    compared = {name: one for name, one in fitted.items() if not name.startswith(("polynomial", "variant"))}
    compared |= {"polynomial_12": fitted["polynomial_12"], "polynomial_best": best}
    ard, process = fitted["ard"].estimator, fitted["gaussian_process"].estimator
    validation = parts.validation
    process_mean, process_std = process.predict(validation.X, return_std=True)

    test = parts.open_test()
    variants = [one for name, one in fitted.items() if name.startswith("variant")]
    residuals = ard.predict(validation.X) - validation.landing
    return Comparison(
        rows=pd.DataFrame([_row(name, one, test, seed) for name, one in compared.items()]),
        polynomials=pd.DataFrame([_polynomial(one, parts, test) for one in polynomials]),
        variants=pd.DataFrame([_polynomial(one, parts, test) for one in variants]),
        test_measured=test.landing,
        test_predicted=ard.predict(test.X),
        held_out=_held_out(ard, parts),
        coverage=COVERAGE,
        empirical={
            "KRR": coverage(residuals, ard.predict_std(validation.X), COVERAGE),
            "Gaussian process": coverage(process_mean - validation.landing, process_std, COVERAGE),
        },
    )


def _candidates(scenario: Scenario, selection: Selection, seed: int) -> dict[str, tuple[str, Any]]:
    """Return label and unfitted estimator of each candidate by its name."""
    bounds = cast_bounds(scenario)
    candidates: dict[str, tuple[str, Any]] = {
        "constant": ("mean of the training landings", baselines.constant()),
        "nearest_neighbour": ("nearest neighbour", baselines.nearest_neighbour(bounds)),
        "neural_network": ("neural network", baselines.neural_network(bounds, derived_seed(seed, Purpose.NETWORK))),
        "gaussian_process": (
            f"Gaussian process (kernel by {baselines.KERNEL_ROWS} casts)",
            baselines.gaussian_process(bounds),
        ),
        "isotropic_by_validation": (
            "KRR, one sigma, chosen as in the paper",
            make_estimator(scenario, selection.by_validation),
        ),
        "isotropic": ("KRR, one sigma", make_estimator(scenario, selection.isotropic)),
        "ard": ("KRR, ARD length scales", make_estimator(scenario, selection.per_parameter)),
    }
    for degree in DEGREES:
        candidates[f"polynomial_{degree}"] = (f"polynomial of degree {degree}", baselines.polynomial(degree, bounds))
    variants = {
        "raw": ("monomials in SI units, normal equations", baselines.raw_polynomial(12)),
        "additive": ("no products of parameters", baselines.additive_polynomial(12, bounds)),
    }
    for column, parameter in enumerate(PARAMETERS):
        curve = baselines.single_parameter_polynomial(12, bounds, column)
        variants[parameter] = (f"in the {parameter} alone", curve)
    return candidates | {f"variant_{name}": variant for name, variant in variants.items()}


def _fit(name: str, label: str, estimator: Any, parts: Parts) -> _Fitted:
    started = time.perf_counter()
    estimator.fit(parts.train.X, parts.train.landing)
    fit_s = time.perf_counter() - started
    training, validation = (rmse(estimator.predict(part.X) - part.landing) for part in (parts.train, parts.validation))
    return _Fitted(name, label, estimator, training, validation, fit_s)


def _row(name: str, fitted: _Fitted, test: Part, seed: int) -> Record:
    residuals = fitted.estimator.predict(test.X) - test.landing
    errors = np.abs(residuals)
    many = np.resize(test.X, (N_PREDICTIONS, test.X.shape[1]))
    started = time.perf_counter()
    fitted.estimator.predict(many)
    predict_us = 1e6 * (time.perf_counter() - started) / N_PREDICTIONS
    return {
        "name": name,
        "label": fitted.label,
        "rmse": rmse(residuals),
        "rmse_interval": rmse_interval(residuals, derived_seed(seed, Purpose.BOOTSTRAP)),
        "median": float(np.median(errors)),
        "p95": float(np.percentile(errors, 95)),
        "max": float(np.max(errors)),
        "validation_rmse": fitted.validation_rmse,
        "fit_s": fitted.fit_s,
        "predict_us": predict_us,
    }


def _polynomial(fitted: _Fitted, parts: Parts, test: Part) -> Record:
    basis = fitted.estimator[:-1]
    design = basis.transform(parts.train.X)
    n_rows, n_terms = design.shape
    return {
        "label": fitted.label,
        "degree": basis[-1].degree,
        "n_terms": n_terms,
        "condition": float(np.linalg.cond(design)) if n_terms <= n_rows else np.nan,
        "training_rmse": fitted.training_rmse,
        "validation_rmse": fitted.validation_rmse,
        "test_rmse": rmse(fitted.estimator.predict(test.X) - test.landing),
    }


def _held_out(model: KernelRidge, parts: Parts) -> Residuals:
    casts = np.vstack([parts.train.X, parts.validation.X])
    # Signs as those of a prediction minus what was measured.
    validation = model.predict(parts.validation.X) - parts.validation.landing
    residual = np.concatenate([-model.leave_one_out_residuals(), validation])
    squares = np.sort(residual**2)[::-1]
    distance, speed, wait = casts.T
    return Residuals(
        distance=distance,
        speed=speed,
        wait=wait,
        residual=residual,
        worst=WORST,
        share_of_worst=float(np.sum(squares[: round(WORST * len(squares))]) / np.sum(squares)),
    )
