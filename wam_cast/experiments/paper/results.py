"""What the phases of the experiment find: plain values in SI units, which go to files and come back as they were.

A value that does not exist (the landing of a ball that never came down) is None, since JSON knows no nan.
"""

from __future__ import annotations

import math
from collections.abc import Iterable

import numpy as np
from numpy.typing import ArrayLike
from pydantic import BaseModel, ConfigDict

from wam_cast.types import Array

Floats = tuple[float, ...]
MaybeFloats = tuple[float | None, ...]


class Result(BaseModel):
    """A frozen group of values."""

    model_config = ConfigDict(frozen=True, extra="forbid")


class Samples(Result):
    """The random casts: counts by status, and the training casts with their landings [m, m/s, s, m].

    `n_train`, `n_validation` and `n_test` are the casts of each part that came down to the rim plane: those that are used.
    """

    statuses: dict[str, int]
    n_train: int
    n_validation: int
    n_test: int
    share_slack: float
    distance: Floats
    speed: Floats
    wait: Floats
    landing_along: Floats
    landing_std: float
    largest_across: float


class Chosen(Result):
    """Hyperparameters of the kernel regression and their errors [m]; `sigma` has one value or one for each parameter."""

    sigma: Floats
    regularization: float
    leave_one_out_rmse: float
    validation_rmse: float


class ErrorCurve(Result):
    """Errors [m] over one hyperparameter `x`, None where the kernel matrix is singular."""

    x: Floats
    validation_rmse: MaybeFloats
    leave_one_out_rmse: MaybeFloats


class Descent(Result):
    """The steps of a descent: values of sigma, and the error there [m]."""

    x: Floats
    rmse: Floats


class Selection(Result):
    """The model selection.

    Attributes
    ----------
    by_validation
        As in the paper: sigma by gradient descent on the validation error, lambda that of `isotropic`.
    isotropic, per_parameter
        Sigma, one or one for each parameter, and lambda by leave-one-out.
    sigma_curve, regularization_curve
        Each with the other hyperparameter as in `isotropic`.
    papers_curve
        Errors over lambda with the paper's sigma, on parameters in SI units that are not scaled.
    descents
        On the validation error over sigma, each from another start; the best one gave `by_validation`.
    """

    by_validation: Chosen
    isotropic: Chosen
    per_parameter: Chosen
    sigma_curve: ErrorCurve
    regularization_curve: ErrorCurve
    papers_curve: ErrorCurve
    descents: tuple[Descent, ...]


class Row(Result):
    """One estimator: its errors on the test casts [m], with a bootstrap interval of the RMSE, and what it costs."""

    name: str
    label: str
    rmse: float
    rmse_interval: tuple[float, float]
    median: float
    p95: float
    max: float
    validation_rmse: float
    fit_s: float
    predict_us: float


class PolynomialFit(Result):
    """Errors [m] of one polynomial, its number of terms, and the condition number of its least squares.

    The latter is None if there are more terms than training casts, so that least squares have many solutions.
    """

    label: str
    degree: int
    n_terms: int
    condition: float | None
    training_rmse: float
    validation_rmse: float
    test_rmse: float


class Residuals(Result):
    """Casts and what the model errs there [m], as one that has not seen them: leave-one-out, then the validation casts.

    `share_of_worst` of the squared error is that of the `worst` casts, a share too.
    """

    distance: Floats
    speed: Floats
    wait: Floats
    residual: Floats
    worst: float
    share_of_worst: float


class Comparison(Result):
    """What opens the test part: all estimators on it.

    Attributes
    ----------
    polynomials
        Of degree 1 to 12, well conditioned.
    variants
        Polynomials as others may fit them.
    test_measured, test_predicted
        Landings along the casting plane [m], predicted by the model with a length scale for each parameter.
    held_out
        Where that model errs.
    coverage, empirical
        Share of the validation casts that should be, and are, within a model's central interval.
    """

    rows: tuple[Row, ...]
    polynomials: tuple[PolynomialFit, ...]
    variants: tuple[PolynomialFit, ...]
    test_measured: Floats
    test_predicted: Floats
    held_out: Residuals
    coverage: Floats
    empirical: dict[str, Floats]

    def row(self, name: str) -> Row:
        """Return the row of that name."""
        return next(row for row in self.rows if row.name == name)


class Band(Result):
    """Validation RMSE [m] over the sizes of the training set: median, lowest and highest of the repeated subsets."""

    median: Floats
    low: Floats
    high: Floats


class LearningCurves(Result):
    """Errors over the number of training casts, by the estimator's label."""

    n_train: tuple[int, ...]
    n_repeats: int
    curves: dict[str, Band]


class LandingMap(Result):
    """Predicted landing [m] by wait, speed and distance (in this order), and which casts are allowed by speed and distance."""

    distance: Floats
    speed: Floats
    waits: Floats
    landing: tuple[tuple[Floats, ...], ...]
    is_allowed: tuple[tuple[bool, ...], ...]


class Trial(Result):
    """A cup [m], the cast planned for it, and what became of it.

    Attributes
    ----------
    predicted_offset, executed_offset
        Of the landing from the cup's middle, along the casting plane: positive beyond it [m].
    executed_across
        The same across the casting plane [m].
    predicted_miss, executed_miss
        Distances of the landings from the cup's middle [m]; the executed landing is that of the ball's free flight, before it
        touches anything.
    status
        A value of `Status`.
    """

    cup: float
    distance: float
    speed: float
    wait: float
    is_feasible: bool
    predicted_offset: float
    predicted_miss: float
    executed_offset: float | None
    executed_across: float | None
    executed_miss: float | None
    entry_angle: float | None
    status: str
    limits_hit: tuple[str, ...]

    @property
    def is_caught(self) -> bool:
        """Whether the ball rests in the cup."""
        return self.status == "caught"

    @property
    def failure(self) -> str | None:
        """What kind of failure it is, a value of `Status`; none if the ball was caught."""
        return None if self.is_caught else self.status


class Statistics(Result):
    """Of absolute values [m]; None if there are none. `n`: how many there are."""

    n: int
    mean: float | None
    median: float | None
    p95: float | None
    max: float | None


class Execution(Result):
    """One planner over all cups.

    Attributes
    ----------
    label
        Planner, and whatever else is special.
    hit_interval
        Wilson's 95 % interval of the hit rate.
    failures
        Counts by kind, of those that occurred.
    n_no_plan, n_no_plan_caught
        Cups for which no cast was predicted to land within 1 cm of the middle (the best one was cast all the same), and those
        of them that were hit.
    n_touched
        Balls that were caught though they came in farther from the middle than the ball clears the rim.
    """

    label: str
    planner: str
    n_cups: int
    n_caught: int
    hit_rate: float
    hit_interval: tuple[float, float]
    predicted_miss: Statistics
    executed_miss: Statistics
    failures: dict[str, int]
    n_no_plan: int
    n_no_plan_caught: int
    n_touched: int
    trials: tuple[Trial, ...]


class Executions(Result):
    """Several planners over the same cups."""

    planners: tuple[Execution, ...]


class NoisyModel(Result):
    """A model, what it was fitted with, and its errors [m]: on noisy test casts, and against landings without noise."""

    label: str
    sigma: Floats
    regularization: float
    test_rmse: float
    test_rmse_interval: tuple[float, float]
    noise_free_rmse: float


class NoiseStudy(Result):
    """The section on casts that do not repeat.

    Attributes
    ----------
    levels
        Of the scenario's noise.
    statuses
        Of the noisy casts.
    along, across
        Landing of each noisy training cast minus that of the same cast without noise [m].
    along_std, across_std
        Standard deviations of these [m].
    test_floor
        Root mean square of the same difference along the casting plane over the test casts [m]: what no model can foretell.
    models
        Fitted to noisy casts or to others.
    regularization_curve
        On noisy casts.
    executions
        With noise.
    """

    levels: dict[str, float]
    statuses: dict[str, int]
    along: MaybeFloats
    across: MaybeFloats
    along_std: float
    across_std: float
    test_floor: float
    models: tuple[NoisyModel, ...]
    regularization_curve: ErrorCurve
    executions: tuple[Execution, ...]


def floats(values: ArrayLike) -> Floats:
    """Return a tuple of an array's elements."""
    return tuple(np.asarray(values, dtype=float).ravel().tolist())


def maybe_floats(values: Iterable[float]) -> MaybeFloats:
    """Return a tuple of values, None for those that are not finite."""
    return tuple(maybe_float(value) for value in values)


def maybe_float(value: float) -> float | None:
    """Return `value` as a float, None if it is not finite."""
    return float(value) if math.isfinite(value) else None


def to_array(values: Iterable[float | None]) -> Array:
    """Return values as an array, nan for None."""
    return np.array([math.nan if value is None else value for value in values], dtype=float)
