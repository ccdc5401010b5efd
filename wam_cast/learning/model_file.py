"""The file of a forward model: one compressed numpy archive with all that the model is made anew from."""

from __future__ import annotations

import io
import json
import math
import zipfile
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Annotated, Any, NamedTuple, Self

import numpy as np
from numpy.typing import NDArray
from pydantic import AfterValidator, BaseModel, ConfigDict, Field, NonNegativeInt, ValidationError, model_validator

from wam_cast.errors import InputError, describe_validation
from wam_cast.learning.uncertainty import LARGEST_LOG_RATIO, ErrorFit, LengthScale, Regularization
from wam_cast.planning.prediction import OUTPUTS
from wam_cast.scenario import Scenario
from wam_cast.storage.array_archive import LARGEST_MEMBER, NOT_AN_ARCHIVE, read_array
from wam_cast.storage.atomic import write_file
from wam_cast.text_file import read_bytes
from wam_cast.types import Array

FORMAT = "wam_cast forward model 5"

WIDTHS = {
    "training_casts": (3,),
    "training_outputs": (len(OUTPUTS),),
    "training_is_clean": (),
    "training_log_ratios": (),
}
"""What the archive holds beside its header: fields of `StoredModel`, each with the shape of its rows."""

MOST_TRAINING_CASTS = 100_000
"""With more a file would be larger than `LARGEST_MEMBER`."""

LARGEST_VALUE = 1e6
"""In SI units no cast has a larger number."""

Rmse = Annotated[float, Field(ge=0, le=LARGEST_VALUE)]


def _checked_rmse(value: float) -> float:
    """Return the error of the test casts, which may be nan."""
    if not (math.isnan(value) or 0 <= value <= LARGEST_VALUE):
        raise ValueError(f"info.test_rmse = {value:g} must be nan or from 0 to {LARGEST_VALUE:g} m")
    return value


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
        Of the kernel: ARD length scales of distance, speed and wait, in parameters scaled to the unit cube of the bounds, and
        lambda.
    leave_one_out_rmse, validation_rmse, test_rmse
        Root mean squared errors of the landing along the casting plane [m]: of the training casts, each predicted by a fit to
        all the others, and of the other two parts. `.ForwardModel.fit` chooses by the first one alone. The last one is nan if
        the test casts stayed closed.
    n_landmarks
        Training casts that the kernel stands at, see `.KernelRidge`; None if at all of them: the regression is then exact.
    """

    seed: NonNegativeInt
    n_train: Annotated[int, Field(ge=2, le=MOST_TRAINING_CASTS)]
    n_validation: NonNegativeInt
    n_test: NonNegativeInt
    sigma: tuple[LengthScale, LengthScale, LengthScale]
    regularization: Regularization
    leave_one_out_rmse: Rmse
    validation_rmse: Rmse
    test_rmse: Annotated[float, AfterValidator(_checked_rmse)]
    n_landmarks: Annotated[int, Field(ge=1, le=MOST_TRAINING_CASTS)] | None = None  # which older files do not have


class StoredModel(NamedTuple):
    """What a model file holds: what a `.ForwardModel` has under the same names, and what its uncertainty learned."""

    scenario: Scenario
    training_casts: Array
    training_outputs: Array
    training_is_clean: NDArray[np.bool_]
    training_log_ratios: Array
    """What the uncertainty's correction is fitted to, shape (n_train,)."""
    info: Fit
    uncertainty: ErrorFit
    controller: str


class _Written(BaseModel):
    """The one field of a header that every version has."""

    format: str


class _Header(_Written):
    """What is kept as JSON."""

    model_config = ConfigDict(extra="forbid")

    fingerprint: str
    scenario: dict[str, Any]
    info: Fit
    uncertainty: ErrorFit
    controller: str

    @model_validator(mode="after")
    def _has_its_landmarks(self) -> Self:
        if (self.info.n_landmarks or 0) > self.info.n_train:
            raise ValueError(
                f"info.n_landmarks = {self.info.n_landmarks} is more than its {self.info.n_train} training casts"
            )
        return self


def write_model(path: str | Path, model: StoredModel) -> None:
    """Write a model to one file. Raises `.InputError` if that cannot be done; then nothing is left behind."""
    header = {
        "format": FORMAT,
        "fingerprint": model.scenario.fingerprint,
        "scenario": model.scenario.model_dump(mode="json"),
        "info": asdict(model.info),
        "uncertainty": asdict(model.uncertainty),
        "controller": model.controller,
    }
    try:
        _Header.model_validate(header)
    except ValidationError as error:
        raise InputError(
            f"model {path}: {describe_validation(error)}, so that it cannot be kept; fit it with other hyperparameters"
        ) from None
    content = io.BytesIO()
    np.savez_compressed(content, header=np.array(json.dumps(header)), **{name: getattr(model, name) for name in WIDTHS})
    write_file(path, content.getvalue())


def read_model(path: str | Path, arm_file: str | None = None) -> StoredModel:
    """Read a model that `write_model` wrote; `arm_file` is where its arm's URDF is now, by default where it was.

    Raises
    ------
    InputError
        If the file cannot be read, is damaged or no model, or its scenario is not what it was: the arm's model and the version
        count too.
    """
    try:
        content = read_bytes(path, LARGEST_MEMBER)
    except OSError as error:
        reason = (error.strerror or str(error)).lower()
        raise InputError(f"model {path}: {reason}; name a file that wam-cast fit wrote") from None
    try:
        with zipfile.ZipFile(io.BytesIO(content)) as archive:
            text = str(read_array(archive, "header"))
            written_as = _Written.model_validate_json(text).format
            arrays = {name: read_array(archive, name) for name in WIDTHS} if written_as == FORMAT else {}
    except NOT_AN_ARCHIVE:
        raise InputError(
            f"model {path}: not a model file, or a damaged one; name one that wam-cast fit wrote, or fit it anew"
        ) from None
    if written_as != FORMAT:
        raise InputError(
            f"model {path}: is a {written_as!r}, this version reads {FORMAT!r}; fit it anew with: wam-cast fit DATASET --out FILE"
        )
    try:
        header = _Header.model_validate_json(text)
        for name, array in arrays.items():
            _check_array(name, array, header.info.n_train)
    except ValueError as error:
        reason = describe_validation(error) if isinstance(error, ValidationError) else str(error)
        raise InputError(f"model {path}: {reason}, which wam-cast fit does not write; fit it anew") from None
    if arm_file is not None and isinstance(arm := header.scenario.get("arm"), dict):
        arm["urdf"] = arm_file
    try:
        scenario = Scenario.from_dict(header.scenario)
    except InputError as error:
        raise InputError(f"model {path}: its scenario cannot be used now ({error}); fit it anew") from None
    if scenario.fingerprint != header.fingerprint:
        raise InputError(
            f"model {path}: made with another model of the arm or another version of wam_cast "
            f"({header.fingerprint}, now {scenario.fingerprint}); fit it anew with: wam-cast fit"
        )
    return StoredModel(
        scenario, **arrays, info=header.info, uncertainty=header.uncertainty, controller=header.controller
    )


def _check_array(name: str, array: NDArray[Any], n_train: int) -> None:
    """Raise `ValueError` unless the array is what a model of so many training casts has."""
    shape, dtype = (n_train, *WIDTHS[name]), np.dtype(bool if name == "training_is_clean" else float)
    if (array.shape, array.dtype) != (shape, dtype):
        raise ValueError(f"{name} is of shape {array.shape} and type {array.dtype}, not {shape} and {dtype}")
    largest = LARGEST_LOG_RATIO if name == "training_log_ratios" else LARGEST_VALUE
    is_beyond = ~(np.abs(array) <= largest)
    if np.any(is_beyond):
        raise ValueError(f"{name} holds {array[is_beyond][0]:g}, beyond {largest:g} in magnitude")
