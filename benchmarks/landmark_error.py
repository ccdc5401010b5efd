"""How near kernel ridge regression with landmarks is to the exact one, and both to the truth, by the number of landmarks.

    python benchmarks/landmark_error.py [--training-casts 3000] [--landmarks 500 1000 2000] [--test-casts 2000]

Landings are synthetic (`synthetic_landings.py`). Sigma and lambda are those of least leave-one-out error over the largest number of
landmarks, as `ForwardModel.fit` takes them; all rows share them. Standard deviations are those of the model, corrected and scaled.
"""

from __future__ import annotations

import argparse
import time

import numpy as np
from synthetic_landings import synthetic_dataset

from wam_cast.cast import PARAMETERS, cast_bounds
from wam_cast.cli.terminal import print_table
from wam_cast.learning.dataset import CastDataset
from wam_cast.learning.forward_model import ForwardModel
from wam_cast.learning.hyperparameters import tune_by_lbfgs
from wam_cast.learning.kernel.landmarks import landmark_rows
from wam_cast.learning.kernel_fit import START_SIGMA
from wam_cast.learning.kernel_ridge import KernelRidge
from wam_cast.learning.losses import LeaveOneOutLoss
from wam_cast.learning.parts import split_casts
from wam_cast.planning.prediction import ALONG, OUTPUTS
from wam_cast.types import Array

HEADINGS = (
    "kernel at",
    "fit, of the exact",
    "off the exact: RMSE, max [mm]",
    "off the truth: RMSE [mm]",
    "standard deviation, of the exact: 5, 50, 95 %",
    "within 2",
)


def tuned(data: CastDataset, n_landmarks: int) -> KernelRidge:
    """Return the estimator whose hyperparameters the landmarks choose."""
    train = split_casts(data).train
    rows = landmark_rows(len(train.X), n_landmarks)
    loss = LeaveOneOutLoss(train.X[rows], train.landing[rows], input_bounds=cast_bounds(data.scenario))
    found = tune_by_lbfgs(loss, sigma0=[START_SIGMA] * len(PARAMETERS))
    return KernelRidge(sigma=found.sigma, regularization=found.regularization)


def fitted(data: CastDataset, estimator: KernelRidge, casts: Array) -> tuple[Array, Array, float]:
    """Return the predicted landings of casts, their standard deviations, and the processor time of the fit."""
    start = time.process_time()
    model = ForwardModel.fit(data, estimator=estimator)
    seconds = time.process_time() - start
    return model.predict(casts)[:, ALONG], model.uncertainty.std(casts), seconds


def main() -> None:
    arguments = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    arguments.add_argument("--training-casts", type=int, default=3000, help="5000 at most, to be exact")
    arguments.add_argument("--landmarks", type=int, nargs="+", default=(500, 1000, 2000))
    arguments.add_argument("--test-casts", type=int, default=2000)
    options = arguments.parse_args()
    data = synthetic_dataset(options.training_casts * 17 // 13 + 1)
    fresh = synthetic_dataset(options.test_casts, seed=1).frame
    casts, truth = fresh[list(PARAMETERS)].to_numpy(), fresh[OUTPUTS[ALONG]].to_numpy()
    estimator = tuned(data, max(options.landmarks))
    exact, exact_std, exact_s = fitted(data, estimator, casts)
    rows = []
    for n_landmarks in (*options.landmarks, None):
        landing, std, seconds = (
            fitted(data, estimator.set_params(n_landmarks=n_landmarks), casts)
            if n_landmarks is not None
            else (exact, exact_std, exact_s)
        )
        off = 1e3 * np.abs(landing - exact)
        rows.append(
            (
                "all" if n_landmarks is None else str(n_landmarks),
                f"{seconds / exact_s:.2f}",
                f"{np.sqrt(np.mean(off**2)):.3f}, {off.max():.2f}",
                f"{1e3 * np.sqrt(np.mean((landing - truth) ** 2)):.3f}",
                ", ".join(f"{ratio:.2f}" for ratio in np.percentile(std / exact_std, [5, 50, 95])),
                f"{np.mean(np.abs(landing - truth) <= 2 * std):.1%}",
            )
        )
    print_table(rows, HEADINGS)


if __name__ == "__main__":
    main()
