"""ForwardModel: estimators bound to a scenario, which map casts to landings (Section 2.4 of the paper)."""

from __future__ import annotations

import io
import json
import tokenize
import zipfile
import zlib
from copy import copy
from dataclasses import asdict, dataclass, replace
from functools import lru_cache
from pathlib import Path
from typing import TYPE_CHECKING, NamedTuple, Self

import numpy as np
from numpy.typing import ArrayLike

from wam_cast.cast import cast_bounds
from wam_cast.errors import InputError
from wam_cast.learning.kernel_ridge import KernelRidge
from wam_cast.learning.leave_one_out import tune_by_leave_one_out
from wam_cast.learning.parts import OUTPUTS, Part, split_casts
from wam_cast.learning.tuning import TuningResult
from wam_cast.learning.uncertainty import ErrorFit, LandingUncertainty
from wam_cast.parallel.threads import one_thread
from wam_cast.scenario import Scenario
from wam_cast.storage.atomic import write_file
from wam_cast.types import Array

if TYPE_CHECKING:
    from wam_cast.learning.dataset import CastDataset


FORMAT = "wam_cast forward model 3"

START_SIGMA = 0.5
"""Where the search for every parameter's sigma starts: half the width of the bounds."""

REACH_TAIL = 0.005
"""Share of the clean casts beyond either end of the reach."""


@dataclass(frozen=True)
class Fit:
    """How a model was fitted, and how well.

    Attributes
    ----------
    seed
        Of the dataset.
    n_train, n_validation, n_test
        Casts of each part, without those that never came down to the rim plane.
    sigma, regularization
        Of the kernel; a sigma for each of distance, speed and wait, in parameters scaled to the unit cube of the bounds.
    leave_one_out_rmse, validation_rmse, test_rmse
        Root mean squared errors of the landing along the casting plane [m]: of the training casts, each predicted by a fit to
        all the others, and of the other two parts. `fit` chooses by the first one alone. The last one is nan until the
        test casts are opened.
    """

    seed: int
    n_train: int
    n_validation: int
    n_test: int
    sigma: tuple[float, float, float]
    regularization: float
    leave_one_out_rmse: float = float("nan")
    validation_rmse: float = float("nan")
    test_rmse: float = float("nan")


class Expansion(NamedTuple):
    """A model about one cast, derivatives by `[distance, speed, wait]` in SI units."""

    outputs: Array
    """`OUTPUTS`, shape (7,)."""
    gradient: Array
    """Of the outputs, shape (7, 3)."""
    std: float
    """By how much the landing along the casting plane may be off for the model's own error, one standard deviation [m]."""
    std_gradient: Array
    """Its derivative, shape (3,)."""


class ForwardModel:
    """Predicts the landing of casts of one scenario, in the casting plane.

    Make one with `fit` or `load`, or use `reference_model`.

    Attributes
    ----------
    scenario
        Whose casts it predicts.
    known_casts, known_outputs
        The training casts `[distance, speed, wait]`, shape (n_train, 3), and their `OUTPUTS`, shape (n_train, 7).
    reach
        The smallest and largest distance of a cup from the base axis that the model plans for [m].
    info
        A `Fit`: how it was made.
    uncertainty
        What the landing may be off by.
    """

    def __init__(
        self,
        scenario: Scenario,
        estimator: KernelRidge,
        uncertainty: LandingUncertainty,
        known_outputs: Array,
        reach: tuple[float, float],
        info: Fit,
    ) -> None:
        self.scenario = scenario
        self.known_casts: Array = estimator.X_fit_
        self.known_outputs = known_outputs
        self.reach = reach
        self.info = info
        self.uncertainty = uncertainty
        self._estimator = estimator
        # The same without its other outputs, which what asks for the landing alone need not compute.
        self._landing_estimator = copy(estimator)
        self._landing_estimator.dual_coef_ = estimator.dual_coef_[:, 0].copy()
        self._landing_estimator.target_mean_ = estimator.target_mean_[0]

    @classmethod
    def fit(cls, data: CastDataset) -> Self:
        """Fit to a dataset, split by index into training, validation and test casts as 1300 : 300 : 100.

        The length scale of each parameter and the regularization are those of least leave-one-out error over the training casts;
        validation and test casts only measure the result. What is judged is the landing along the casting plane: across it,
        casts without noise land less than a tenth of a millimetre off, which carries no information.

        Raises
        ------
        InputError
            If too few of the dataset's casts came down to the rim plane.
        """
        parts = split_casts(data)
        tuned = tune_model(data.scenario, parts.train)
        model = cls.from_hyperparameters(data, tuned.sigma, tuned.regularization)
        model.info = replace(model.info, test_rmse=model.landing_rmse(parts.open_test()))
        return model

    @classmethod
    def from_hyperparameters(cls, data: CastDataset, sigma: ArrayLike, regularization: float) -> Self:
        """Fit to the training casts of a dataset, with a sigma (or one for each parameter) and a lambda chosen before.

        The test casts stay closed.

        Raises
        ------
        InputError
            As from `fit`.
        """
        parts = split_casts(data)
        distance, speed, wait = (float(one) for one in np.broadcast_to(np.squeeze(sigma), 3))
        estimator = _estimator(data.scenario, (distance, speed, wait), regularization)
        with one_thread():  # as when it is loaded, to the last digit
            estimator.fit(parts.train.X, parts.train.y)
            residuals = estimator.leave_one_out_residuals()[:, 0]
        info = Fit(
            seed=data.seed,
            n_train=len(parts.train.X),
            n_validation=len(parts.validation.X),
            n_test=parts.n_test,
            sigma=(distance, speed, wait),
            regularization=regularization,
            leave_one_out_rmse=float(np.sqrt(np.mean(residuals**2))),
        )
        with one_thread():
            uncertainty = LandingUncertainty.learn(estimator, parts.validation.X, parts.validation.landing)
        model = cls(data.scenario, estimator, uncertainty, parts.train.y, _reach(data), info)
        model.info = replace(info, validation_rmse=model.landing_rmse(parts.validation))
        return model

    def landing_rmse(self, part: Part) -> float:
        """Return the root mean squared error of the predicted landing along the casting plane [m]."""
        residuals = self.predict(part.X)[:, 0] - part.landing
        return float(np.sqrt(np.mean(residuals**2)))

    def predict(self, casts: Array) -> Array:
        """Predict the `OUTPUTS` of casts `[distance, speed, wait]`, shape (n, 3): landing along first. Shape (n, 7)."""
        prediction: Array = self._estimator.predict(casts)
        return prediction

    def predict_with_gradient(self, casts: Array) -> tuple[Array, Array]:
        """Return the prediction, shape (n, 7), and its derivative by the parameters in SI units, shape (n, 7, 3)."""
        prediction, gradient = self._estimator.predict_with_gradient(casts)
        return prediction, gradient

    def expand(self, cast: Array) -> Expansion:
        """Return all that a planner asks about one cast `[distance, speed, wait]`, shape (3,)."""
        outputs, gradient = self._estimator.expand(cast[np.newaxis])
        return Expansion(outputs[0], gradient[0], *self.uncertainty.expand(cast))

    def landing_with_gradient(self, casts: Array) -> tuple[Array, Array]:
        """Return the landing along the casting plane [m] of a few casts, shape (n,), and its derivative in SI units, (n, 3)."""
        landing, gradient = self._landing_estimator.expand(casts)
        return landing, gradient

    def serves(self, scenario: Scenario) -> bool:
        """Return whether the model predicts the casts of `scenario`: the cup's shape may be another, and there may be noise.

        A model that was learned without noise predicts the middle of what noise scatters.
        """
        return self.scenario.fingerprint in (scenario.fingerprint, scenario.without_noise.fingerprint)

    def bound_to(self, scenario: Scenario) -> Self:
        """Return the same model for plans in `scenario`, whose cup and noise count; raises `InputError` if it does not serve."""
        if not self.serves(scenario):
            raise InputError(
                f"made for another scenario ({self.scenario.fingerprint}, not {scenario.fingerprint}); "
                "name a model of this scenario, or make one with: wam-cast generate, then wam-cast fit"
            )
        bound = copy(self)
        bound.scenario = scenario
        return bound

    def save(self, path: str | Path) -> None:
        """Write the model to one file. Raises `InputError` if that cannot be done; then nothing is left behind."""
        header = {
            "format": FORMAT,
            "fingerprint": self.scenario.fingerprint,
            "scenario": self.scenario.model_dump(mode="json"),
            "reach": self.reach,
            "info": asdict(self.info),
            "uncertainty": asdict(self.uncertainty.fit),
        }
        content = io.BytesIO()
        np.savez_compressed(
            content,
            header=np.array(json.dumps(header)),
            known_casts=self.known_casts,
            known_outputs=self.known_outputs,
            known_log_ratios=self.uncertainty.log_ratios,
        )
        write_file(path, content.getvalue())

    @classmethod
    def load(cls, path: str | Path, scenario: Scenario | None = None) -> Self:
        """Read a model that `save` wrote.

        Parameters
        ----------
        path
            The file.
        scenario
            What the model is to be used with; without one, the scenario that it was made for.

        Raises
        ------
        InputError
            If the file cannot be read, is not a model, or was made for casts that differ from the scenario's.
        """
        stored = _read(path)
        own = stored.scenario
        if own.fingerprint != stored.fingerprint:
            raise InputError(
                f"model {path}: made with another model of the arm or another version of wam_cast "
                f"({stored.fingerprint}, now {own.fingerprint}); fit it anew with: wam-cast fit"
            )
        estimator = _estimator(own, stored.info.sigma, stored.info.regularization)
        with one_thread():
            estimator.fit(stored.known_casts, stored.known_outputs)
            uncertainty = LandingUncertainty(estimator, stored.known_log_ratios, stored.error_fit)
        model = cls(own, estimator, uncertainty, stored.known_outputs, stored.reach, stored.info)
        try:
            return model if scenario is None else model.bound_to(scenario)
        except InputError as error:
            raise InputError(f"model {path}: {error}") from None


def tune_model(scenario: Scenario, train: Part) -> TuningResult:
    """Return the sigma of each parameter and the lambda of least leave-one-out error over training casts."""
    return tune_by_leave_one_out(
        train.X, train.landing, sigma0=[START_SIGMA] * train.X.shape[1], input_bounds=cast_bounds(scenario)
    )


def _estimator(scenario: Scenario, sigma: tuple[float, ...], regularization: float) -> KernelRidge:
    return KernelRidge(sigma=sigma, regularization=regularization, input_bounds=cast_bounds(scenario))


@dataclass(frozen=True)
class _Stored:
    """What a model file holds."""

    scenario: Scenario
    fingerprint: str
    known_casts: Array
    known_outputs: Array
    known_log_ratios: Array
    reach: tuple[float, float]
    info: Fit
    error_fit: ErrorFit


_MALFORMED = (
    OSError,
    EOFError,
    ValueError,
    TypeError,
    LookupError,
    AttributeError,
    zipfile.BadZipFile,
    zlib.error,
    SyntaxError,
    tokenize.TokenError,
)
"""What numpy, zip and JSON raise for bytes that are something else."""


def _read(path: str | Path) -> _Stored:
    """Return what a model file holds; raises `InputError` if it is not one."""
    not_one = InputError(f"model {path}: not a model file; name one that wam-cast fit wrote")
    try:
        content = Path(path).read_bytes()
    except OSError as error:
        reason = (error.strerror or str(error)).lower()
        raise InputError(f"model {path}: {reason}; name a file that wam-cast fit wrote") from None
    try:
        with np.load(io.BytesIO(content), allow_pickle=False) as file:
            header = json.loads(str(file["header"]))
            known_casts, known_outputs, known_log_ratios = (
                np.asarray(file[name], dtype=float)
                for name in ("known_casts", "known_outputs", "known_log_ratios")
            )
        n_known = len(known_casts)
        shapes = (n_known, 3), (n_known, len(OUTPUTS)), (n_known,)
        if header["format"] != FORMAT or shapes != (
            known_casts.shape,
            known_outputs.shape,
            known_log_ratios.shape,
        ):
            raise not_one
        nearest, farthest = (float(radius) for radius in header["reach"])
        info = Fit(**header["info"] | {"sigma": tuple(float(sigma) for sigma in header["info"]["sigma"])})
        error_fit = ErrorFit(**header["uncertainty"] | {"sigma": tuple(header["uncertainty"]["sigma"])})
        values, fingerprint = header["scenario"], str(header["fingerprint"])
    except _MALFORMED:
        raise not_one from None
    try:
        scenario = Scenario.from_dict(values)
    except InputError as error:
        raise InputError(f"model {path}: its scenario cannot be used now ({error}); fit it anew") from None
    return _Stored(
        scenario,
        fingerprint,
        known_casts,
        known_outputs,
        known_log_ratios,
        (nearest, farthest),
        info,
        error_fit,
    )


def _reach(data: CastDataset) -> tuple[float, float]:
    """Return the distances between which clean casts land: within the arm's limits, the string slack at the landing.

    All but the last casts at either end, where there are too few to learn from.
    """
    train, _, _ = data.split()
    frame = data.frame.iloc[train]
    clean = frame.loc[(frame["status"] == "landed") & frame["is_slack"], "landing_along"].to_numpy(
        dtype=float
    )
    if len(clean) == 0:
        raise InputError(
            "dataset: no cast kept the arm's limits and landed with a slack string, so that no cup can be reached; "
            "change the scenario's motion or bounds"
        )
    nearest, farthest = np.quantile(clean, [REACH_TAIL, 1 - REACH_TAIL])
    return float(nearest), float(farthest)


def reference_directory() -> Path:
    """Return the folder with what the package ships: the reference dataset and the model that was fitted to it."""
    return Path(__file__).parents[1] / "reference"


@lru_cache(maxsize=1)
def reference_model() -> ForwardModel:
    """Return the forward model of the reference scenario, fitted to the dataset that the package ships."""
    return ForwardModel.load(reference_directory() / "model.npz")


def reference_dataset() -> CastDataset:
    """Return the dataset that `reference_model` was fitted to: 1,700 casts of the reference scenario, seed 0, without a cup."""
    # A model that was fitted before does without pandas.
    from wam_cast.learning.dataset import CastDataset

    return CastDataset.load(reference_directory() / "dataset")
