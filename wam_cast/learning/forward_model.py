"""ForwardModel: estimators bound to a scenario, which map casts to landings (Section 2.4 of the paper)."""

from __future__ import annotations

import io
import json
import zipfile
import zlib
from dataclasses import asdict, dataclass, replace
from functools import lru_cache
from pathlib import Path
from typing import TYPE_CHECKING, Any, Self

import numpy as np
from numpy.typing import NDArray

from wam_cast.cast import PARAMETERS, cast_bounds
from wam_cast.errors import InputError
from wam_cast.files import write_file
from wam_cast.learning.kernel_ridge import KernelRidge
from wam_cast.learning.tuning import tune_sigma
from wam_cast.scenario import Scenario

if TYPE_CHECKING:
    from wam_cast.learning.dataset import CastDataset

Array = NDArray[np.float64]

OUTPUTS = ("landing_along", "landing_across", "entry_angle")
"""What the model predicts: landing in the casting plane's axes [m], and the entry angle [rad]."""

FORMAT = "wam_cast forward model 1"

REGULARIZATION = 1e-8
"""λ of the kernel ridge regression; simulated casts are free of noise, so little of it is needed."""

START_SIGMA = 0.5
"""Where the search for sigma starts: half the width of the bounds."""

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
        Casts that were used, without those that never came down to the rim plane.
    sigma, regularization
        Of the kernel; sigma in parameters scaled to the unit cube of the scenario's bounds.
    validation_rmse, test_rmse
        Root mean squared error of the landing [m]; the first one chose sigma, the second one chose nothing.
    """

    seed: int
    n_train: int
    n_validation: int
    n_test: int
    sigma: float
    regularization: float
    validation_rmse: float
    test_rmse: float = float("nan")


class ForwardModel:
    """Predicts the landing of casts of one scenario, in the casting plane.

    Make one with `fit` or `load`, or use `reference_model`.

    Attributes
    ----------
    scenario
        Whose casts it predicts.
    known_casts
        The training casts `[distance, speed, wait]`, shape (n_train, 3).
    reach
        The smallest and largest distance of a cup from the base axis that the model plans for [m].
    info
        A `Fit`: how it was made.
    """

    def __init__(
        self,
        scenario: Scenario,
        known_casts: Array,
        known_outputs: Array,
        reach: tuple[float, float],
        info: Fit,
    ) -> None:
        self.scenario = scenario
        self.known_casts = known_casts
        self.reach = reach
        self.info = info
        self._known_outputs = known_outputs
        self._estimator = KernelRidge(
            sigma=info.sigma, regularization=info.regularization, input_bounds=cast_bounds(scenario)
        ).fit(known_casts, known_outputs)

    @classmethod
    def fit(cls, data: CastDataset) -> Self:
        """Fit to a dataset, split by index into training, validation and test casts as 1300 : 300 : 100.

        Sigma goes down the gradient of the validation error, as in the paper; the test casts only measure the result.

        Raises
        ------
        InputError
            If too few of the dataset's casts came down to the rim plane.
        """
        bounds = cast_bounds(data.scenario)
        train, validation, test = (_usable(data, rows) for rows in data.split())
        for name, (X, _) in (("training", train), ("validation", validation), ("test", test)):
            if len(X) < 2:
                raise InputError(
                    f"dataset: {len(X)} {name} casts came down to the rim plane, at least 2 are needed; generate more "
                    "casts, or change the scenario's motion or bounds"
                )
        tuned = tune_sigma(
            train[0],
            train[1][:, :2],
            validation[0],
            validation[1][:, :2],
            sigma0=START_SIGMA,
            regularization=REGULARIZATION,
            input_bounds=bounds,
        )
        info = Fit(
            seed=data.seed,
            n_train=len(train[0]),
            n_validation=len(validation[0]),
            n_test=len(test[0]),
            sigma=float(tuned.sigma),
            regularization=tuned.regularization,
            validation_rmse=tuned.rmse,
        )
        model = cls(data.scenario, *train, _reach(data), info)
        residual = model.predict(test[0])[:, :2] - test[1][:, :2]
        test_rmse = float(np.sqrt(np.mean(np.sum(residual**2, axis=1))))
        model.info = replace(info, test_rmse=test_rmse)
        return model

    def predict(self, casts: Array) -> Array:
        """Predict casts `[distance, speed, wait]`, shape (n, 3): landing along and across [m], entry angle [rad], (n, 3)."""
        prediction: Array = self._estimator.predict(casts)
        return prediction

    def predict_with_gradient(self, casts: Array) -> tuple[Array, Array]:
        """Return the prediction, shape (n, 3), and its derivative by the parameters in SI units, shape (n, 3, 3)."""
        prediction, gradient = self._estimator.predict_with_gradient(casts)
        return prediction, gradient

    def save(self, path: str | Path) -> None:
        """Write the model to one file. Raises `InputError` if that cannot be done; then nothing is left behind."""
        header = {
            "format": FORMAT,
            "fingerprint": self.scenario.fingerprint,
            "scenario": self.scenario.model_dump(mode="json"),
            "reach": self.reach,
            "info": asdict(self.info),
        }
        content = io.BytesIO()
        np.savez_compressed(
            content,
            header=np.array(json.dumps(header)),
            known_casts=self.known_casts,
            known_outputs=self._known_outputs,
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
        scenario = own if scenario is None else scenario
        if scenario.fingerprint != own.fingerprint:
            raise InputError(
                f"model {path}: made for another scenario ({own.fingerprint}, not {scenario.fingerprint}); "
                "name a model of this scenario, or make one with: wam-cast generate, then wam-cast fit"
            )
        return cls(scenario, stored.known_casts, stored.known_outputs, stored.reach, stored.info)


@dataclass(frozen=True)
class _Stored:
    """What a model file holds."""

    scenario: Scenario
    fingerprint: str
    known_casts: Array
    known_outputs: Array
    reach: tuple[float, float]
    info: Fit


_MALFORMED = (
    OSError,
    EOFError,
    ValueError,
    TypeError,
    LookupError,
    AttributeError,
    zipfile.BadZipFile,
    zlib.error,
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
            known_casts, known_outputs = (
                np.asarray(file[name], dtype=float) for name in ("known_casts", "known_outputs")
            )
        if header["format"] != FORMAT or not known_casts.shape == known_outputs.shape == (
            len(known_casts),
            3,
        ):
            raise not_one
        nearest, farthest = (float(radius) for radius in header["reach"])
        info = Fit(**header["info"])
        values, fingerprint = header["scenario"], str(header["fingerprint"])
    except _MALFORMED:
        raise not_one from None
    try:
        scenario = Scenario.from_dict(values)
    except InputError as error:
        raise InputError(f"model {path}: its scenario cannot be used now ({error}); fit it anew") from None
    return _Stored(scenario, fingerprint, known_casts, known_outputs, (nearest, farthest), info)


def _usable(data: CastDataset, rows: Any) -> tuple[Array, Array]:
    """Return parameters, shape (n, 3), and outputs, shape (n, 3), of those rows whose casts crossed the rim plane."""
    frame = data.frame.iloc[rows].dropna(subset=list(OUTPUTS))
    return frame[list(PARAMETERS)].to_numpy(dtype=float), frame[list(OUTPUTS)].to_numpy(dtype=float)


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
