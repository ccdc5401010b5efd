"""The file of a forward model: one compressed numpy archive with all that the model is made anew from."""

from __future__ import annotations

import io
import json
import tokenize
import zipfile
import zlib
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from wam_cast.errors import InputError
from wam_cast.learning.uncertainty import ErrorFit
from wam_cast.planning.prediction import OUTPUTS
from wam_cast.scenario import Scenario
from wam_cast.storage.atomic import write_file
from wam_cast.types import Array

FORMAT = "wam_cast forward model 5"

ARRAYS = ("training_casts", "training_outputs", "training_is_clean", "training_log_ratios")
"""What the archive holds beside its header: fields of `StoredModel`."""

OTHER_VALUES = (ValueError, TypeError, LookupError, AttributeError)
NOT_AN_ARCHIVE = (*OTHER_VALUES, OSError, EOFError, zipfile.BadZipFile, zlib.error, SyntaxError, tokenize.TokenError)
"""What JSON, zip and numpy raise for bytes that are something else."""


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
    """

    seed: int
    n_train: int
    n_validation: int
    n_test: int
    sigma: tuple[float, float, float]
    regularization: float
    leave_one_out_rmse: float
    validation_rmse: float
    test_rmse: float


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
    content = io.BytesIO()
    np.savez_compressed(content, header=np.array(json.dumps(header)), **{name: getattr(model, name) for name in ARRAYS})
    write_file(path, content.getvalue())


def read_model(path: str | Path, arm_file: str | None = None) -> StoredModel:
    """Read a model that `write_model` wrote; `arm_file` is where its arm's URDF is now, by default where it was.

    Raises
    ------
    InputError
        If the file cannot be read, is not a model, or its scenario is not what it was: the arm's model and the version count too.
    """
    try:
        content = Path(path).read_bytes()
    except OSError as error:
        reason = (error.strerror or str(error)).lower()
        raise InputError(f"model {path}: {reason}; name a file that wam-cast fit wrote") from None
    try:
        with np.load(io.BytesIO(content), allow_pickle=False) as file:
            header = json.loads(str(file["header"]))
            arrays = [np.asarray(file[name], dtype=float) for name in ARRAYS if name in file]
        written_as = str(header["format"])
    except NOT_AN_ARCHIVE:
        raise _not_a_model(path) from None
    if written_as != FORMAT:
        raise InputError(
            f"model {path}: is a {written_as!r}, this version reads {FORMAT!r}; fit it anew with: wam-cast fit DATASET --out FILE"
        )
    try:
        values, fingerprint = header["scenario"], str(header["fingerprint"])
        if arm_file is not None:
            values["arm"]["urdf"] = arm_file
        info = Fit(**header["info"] | {"sigma": tuple(float(sigma) for sigma in header["info"]["sigma"])})
        uncertainty = ErrorFit(**header["uncertainty"] | {"sigma": tuple(header["uncertainty"]["sigma"])})
        controller = str(header["controller"])
    except OTHER_VALUES:
        raise _not_a_model(path) from None
    n = info.n_train
    if [array.shape for array in arrays] != [(n, 3), (n, len(OUTPUTS)), (n,), (n,)]:
        raise _not_a_model(path)
    try:
        scenario = Scenario.from_dict(values)
    except InputError as error:
        raise InputError(f"model {path}: its scenario cannot be used now ({error}); fit it anew") from None
    if scenario.fingerprint != fingerprint:
        raise InputError(
            f"model {path}: made with another model of the arm or another version of wam_cast "
            f"({fingerprint}, now {scenario.fingerprint}); fit it anew with: wam-cast fit"
        )
    casts, outputs, is_clean, log_ratios = arrays
    return StoredModel(scenario, casts, outputs, is_clean != 0, log_ratios, info, uncertainty, controller)


def _not_a_model(path: str | Path) -> InputError:
    return InputError(f"model {path}: not a model file; name one that wam-cast fit wrote")
