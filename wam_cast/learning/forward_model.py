"""The forward model: an estimator bound to a scenario, which maps casts to landings (section 2.4 of the paper)."""

from __future__ import annotations

import math
from copy import copy
from pathlib import Path
from typing import TYPE_CHECKING, Self

import numpy as np
from numpy.typing import ArrayLike, NDArray

from wam_cast.cast import cast_bounds
from wam_cast.controller_names import DEFAULT_CONTROLLER
from wam_cast.deprecation import renamed
from wam_cast.errors import InputError
from wam_cast.learning.any_regressor import AnyRegressor, Regressor
from wam_cast.learning.kernel.kernel_regression import KernelRegression
from wam_cast.learning.kernel_fit import KernelFit, fit_kernel, learn_uncertainty
from wam_cast.learning.model_file import MOST_TRAINING_CASTS, Fit, StoredModel, read_model, write_model
from wam_cast.learning.parts import Part, Parts, split_casts
from wam_cast.learning.uncertainty import ConstantUncertainty, LandingUncertainty, held_out_scale
from wam_cast.parallel.threads import one_thread
from wam_cast.planning.prediction import ALONG, Linearization
from wam_cast.scenario import Scenario
from wam_cast.types import Array, checks_types

if TYPE_CHECKING:
    from wam_cast.learning.dataset import CastDataset

REACH_TAIL = 0.005
"""Fraction of the clean casts beyond either end of the reach."""


class ForwardModel:
    """Predicts the landing of casts of one scenario, in the casting plane.

    Make one with `fit` or `load`, or use `.reference_model`.

    Attributes
    ----------
    scenario
        Whose casts it predicts.
    training_casts, training_outputs
        The training casts `[distance, speed, wait]`, shape (n_train, 3), and their `.OUTPUTS`, shape (n_train, 7).
    training_is_clean
        Which of them kept the arm's limits and landed with a slack string, shape (n_train,).
    reach
        The smallest and largest distance of a cup from the base axis that the model plans for [m]: with the cup of its
        scenario, so that the string lets the ball rest in it.
    info
        A `.Fit`: how it was made.
    uncertainty
        The predictive standard deviation of the landing.
    controller
        Name of what made the controller of the casts that it learned from, see `.controller_name`.
    """

    def __init__(
        self,
        scenario: Scenario,
        estimator: KernelRegression | AnyRegressor,
        uncertainty: LandingUncertainty | ConstantUncertainty,
        training_outputs: Array,
        training_is_clean: NDArray[np.bool_],
        info: Fit,
        controller: str = DEFAULT_CONTROLLER,
    ) -> None:
        self.scenario = scenario
        self.training_casts: Array = estimator.X_fit_
        self.training_outputs = training_outputs
        self.training_is_clean = training_is_clean
        self.reach = self._reach(scenario)
        self.info = info
        self.uncertainty = uncertainty
        self.controller = controller
        self._estimator = estimator
        self._landing_estimator = estimator.output(ALONG)

    known_casts = renamed("known_casts", "training_casts")
    known_outputs = renamed("known_outputs", "training_outputs")
    expand = renamed("expand", "linearize")

    @classmethod
    def fit(cls, data: CastDataset, estimator: Regressor | None = None) -> Self:
        """Fit to a dataset, split by index into training, validation and test casts as 1300 : 300 : 100.

        The ARD length scales and the regularization are those of least leave-one-out error over the training casts;
        validation and test casts only measure the result, but that the standard deviation is scaled by the errors of the
        validation casts; where they are few, by cross-validation. What is judged is the landing along the casting plane: across it,
        casts without noise land less than a tenth of a millimetre off, which carries no information.

        With more than 5,000 training casts the kernel stands at 2,000 of them alone, the landmarks, which also choose sigma and
        lambda: `info.n_landmarks` says so. The model learns from all casts still, to within an error that *Many casts* in
        `docs/learning.md` measures.

        An `estimator` of your own takes the place of this one: any regressor of scikit-learn's kind, for inputs of shape (n, 3)
        in SI units and targets of shape (n, 7); a clone of it is fitted. Its derivatives are taken by central differences of 1 % of
        the bounds to either side. Its predictive standard deviation is the same for all casts: that of which two hold 95 % of the
        validation casts. Such a model cannot be saved. Of a `.KernelRidge` sigma, lambda and a number of landmarks are taken
        as they are, the inputs are scaled by the scenario's bounds, and all else is as without it.

        Raises
        ------
        InputError
            If too few of the dataset's casts came down to the rim plane, none reaches a cup, or the estimator cannot be fitted to
            several outputs.
        """
        parts = split_casts(data)
        if estimator is None:
            return cls._fit_parts(data, parts, KernelFit(data.scenario), opens_test=True)
        if isinstance(estimator, KernelRegression):
            chosen = (estimator.sigma, estimator.regularization, estimator.n_landmarks)
            return cls._fit_parts(data, parts, KernelFit(data.scenario, chosen), opens_test=True)
        return cls._fit_any(data, parts, estimator)

    @classmethod
    def from_hyperparameters(cls, data: CastDataset, sigma: ArrayLike, regularization: float) -> Self:
        """Fit to the training casts of a dataset, with a sigma (or ARD length scales) and a lambda chosen before.

        The test casts stay closed. Raises `.InputError` as `fit` does.
        """
        parts = split_casts(data)
        fit = KernelFit(data.scenario, (sigma, regularization, None))
        return cls._fit_parts(data, parts, fit, opens_test=False)

    @classmethod
    def _fit_parts(cls, data: CastDataset, parts: Parts, fit: KernelFit, *, opens_test: bool) -> Self:
        train, validation = parts.train, parts.validation
        if len(train.X) > MOST_TRAINING_CASTS:
            raise InputError(
                f"dataset: {len(train.X)} training casts are too many for the file of a model, which holds all of them; "
                f"give it {MOST_TRAINING_CASTS} at most"
            )
        with one_thread():  # as when it is loaded, to the last digit
            estimator = fit(train)
            leave_one_out = estimator.leave_one_out_residuals()[:, 0]
            uncertainty = learn_uncertainty(estimator, fit, train, validation)

        distance, speed, wait = (float(one) for one in np.asarray(estimator.sigma))
        info = Fit(
            **_counts(data, parts),
            sigma=(distance, speed, wait),
            regularization=float(estimator.regularization),
            leave_one_out_rmse=_rmse(leave_one_out),
            validation_rmse=_landing_rmse(estimator, validation),
            test_rmse=_landing_rmse(estimator, parts.open_test()) if opens_test else math.nan,
            n_landmarks=None if estimator.landmarks_ is None else len(estimator.centers_),
        )
        return cls(data.scenario, estimator, uncertainty, train.y, train.is_clean, info, data.controller)

    @classmethod
    def _fit_any(cls, data: CastDataset, parts: Parts, regressor: Regressor) -> Self:
        """Fit a regressor of another kind than kernel ridge regression."""
        train, validation = parts.train, parts.validation
        estimator = AnyRegressor(regressor, cast_bounds(data.scenario)).fit(train.X, train.y)
        errors = estimator.predict(validation.X)[:, ALONG] - validation.landing
        info = Fit(
            **_counts(data, parts),
            sigma=(math.nan,) * 3,
            regularization=math.nan,
            leave_one_out_rmse=math.nan,
            validation_rmse=_rmse(errors),
            test_rmse=_landing_rmse(estimator, parts.open_test()),
        )
        uncertainty = ConstantUncertainty(held_out_scale(errors))
        return cls(data.scenario, estimator, uncertainty, train.y, train.is_clean, info, data.controller)

    def landing_rmse(self, part: Part) -> float:
        """Return the root mean squared error of the predicted landing along the casting plane [m]."""
        return _landing_rmse(self._estimator, part)

    def predict(self, casts: Array) -> Array:
        """Predict the `.OUTPUTS` of casts `[distance, speed, wait]`, shape (n, 3): landing along first. Shape (n, 7)."""
        return self._estimator.predict(casts)

    def linearize(self, cast: Array) -> Linearization:
        """Return all that a planner asks about one cast `[distance, speed, wait]`, shape (3,)."""
        outputs, gradient = self._estimator.linearize(cast[np.newaxis])
        return Linearization(outputs[0], gradient[0], *self.uncertainty.linearize(cast))

    def landing_with_gradient(self, casts: Array) -> tuple[Array, Array]:
        """Return the landing along the casting plane [m] of a few casts, shape (n,), and its derivative in SI units, (n, 3)."""
        return self._landing_estimator.linearize(casts)

    @checks_types
    def serves(self, scenario: Scenario) -> bool:
        """Return whether the model predicts the casts of `scenario`: the cup's shape may be another, and there may be noise.

        A model that was learned without noise predicts the middle of what noise scatters.
        """
        return self.scenario.fingerprint in (scenario.fingerprint, scenario.without_noise.fingerprint)

    @checks_types
    def bound_to(self, scenario: Scenario, controller: str | None = None) -> Self:
        """Return the same model for plans in `scenario`, whose cup and noise count, to be executed by a controller of that name.

        By default that is the one that it learned from. Raises `.InputError` if it does not serve, or no such cup can be reached.
        """
        if not self.serves(scenario):
            raise InputError(
                f"made for another scenario ({self.scenario.fingerprint}, not {scenario.fingerprint}); "
                "name a model of this scenario, or make one with: wam-cast generate, then wam-cast fit"
            )
        if controller not in (None, self.controller):
            raise InputError(
                f"made from casts of another controller ({self.controller}, not {controller}); "
                "name a model of this controller's casts, or fit one to a dataset that was generated with it"
            )
        bound = copy(self)
        bound.scenario = scenario
        bound.reach = self._reach(scenario)
        return bound

    @checks_types
    def save(self, path: str | Path) -> None:
        """Write the model to one file. Raises `.InputError` if that cannot be done; then nothing is left behind.

        Only kernel ridge regression can be saved: a file of another regressor would be a pickle, which runs whatever is in it.
        """
        trained, learned = (self.training_casts, self.training_outputs, self.training_is_clean), self.uncertainty
        if not isinstance(learned, LandingUncertainty):
            raise InputError(
                f"model {path}: only a model by kernel ridge regression is saved, not one with an estimator of your own; "
                "keep the dataset, and fit the estimator to it again"
            )
        stored = StoredModel(self.scenario, *trained, learned.log_ratios, self.info, learned.fit, self.controller)
        write_model(path, stored)

    @classmethod
    @checks_types
    def load(cls, path: str | Path, scenario: Scenario | None = None, controller: str | None = None) -> Self:
        """Read a model that `save` wrote, to use it with `scenario` and a `controller` of that name, see `.controller_name`.

        By default they are those that it was made for.

        Raises
        ------
        InputError
            If the file cannot be read, is not a model, or was made for casts that differ from the scenario's or the controller's.
        """
        stored = read_model(path, None if scenario is None else scenario.arm.urdf)
        outputs, is_clean, info = stored.training_outputs, stored.training_is_clean, stored.info
        try:
            with one_thread():
                chosen = (info.sigma, info.regularization, info.n_landmarks)
                estimator = fit_kernel(stored.scenario, *chosen, stored.training_casts, outputs)
                uncertainty = LandingUncertainty(estimator, stored.training_log_ratios, stored.uncertainty)
            model = cls(stored.scenario, estimator, uncertainty, outputs, is_clean, info, stored.controller)
            return model.bound_to(stored.scenario if scenario is None else scenario, controller)
        except (InputError, np.linalg.LinAlgError) as error:
            raise InputError(f"model {path}: {error}") from None

    def _reach(self, scenario: Scenario) -> tuple[float, float]:
        """Return the distances between which clean casts land, the string slack, that let the ball rest in the scenario's cup.

        All but the last casts at either end, where there are too few to learn from.
        """
        if not np.any(self.training_is_clean):
            raise InputError(
                "no cast of the dataset kept the arm's limits and landed with a slack string, so that no cup can be reached; "
                "change the scenario's motion or bounds"
            )
        clean = self.training_outputs[self.training_is_clean, 0]
        landing = clean[scenario.tether.leaves_free(self.training_casts[self.training_is_clean, 0], clean)]
        if len(landing) == 0:
            raise InputError(
                "no cast of the dataset lets the ball rest in a cup where it lands: it would hang in a taut string, so that no cup "
                "can be reached; a longer string (string.length) or a deeper drop (motion.drop_distance) mends it"
            )
        nearest, farthest = np.quantile(landing, [REACH_TAIL, 1 - REACH_TAIL])
        return float(nearest), float(farthest)


def _counts(data: CastDataset, parts: Parts) -> dict[str, int]:
    """Return what `Fit` says of the dataset."""
    n_train, n_validation = len(parts.train.X), len(parts.validation.X)
    return {"seed": data.seed, "n_train": n_train, "n_validation": n_validation, "n_test": parts.n_test}


def _landing_rmse(estimator: KernelRegression | AnyRegressor, part: Part) -> float:
    return _rmse(estimator.predict(part.X)[:, ALONG] - part.landing)


def _rmse(residuals: Array) -> float:
    return float(np.sqrt(np.mean(residuals**2)))
