"""A forward model from nothing but the scenario's numbers: the closed form of a cast, before any cast was made or simulated."""

from __future__ import annotations

from typing import Any, Self

import numpy as np
import pandas as pd

from wam_cast.adaptation.closed_form.hand_path import PlannedPath
from wam_cast.adaptation.closed_form.planar_arm import move_arm
from wam_cast.adaptation.closed_form.point_mass import Swing, fall
from wam_cast.cast import PARAMETERS
from wam_cast.generation.sampling import sample_casts
from wam_cast.learning.dataset import CastDataset
from wam_cast.learning.forward_model import ForwardModel
from wam_cast.motion.polling import SLACK_MARGIN
from wam_cast.planning.prediction import OUTPUTS, Linearization
from wam_cast.scenario import Scenario
from wam_cast.types import Array, checks_types

N_CASTS = 680
"""Of the closed form that the model is fitted to: 520 to train with."""

ERROR_SHARE, ERROR_SHARE_BY_MASS = 0.0015, 0.035
"""Standard deviation of the closed form's own error, by the string's length: the first, and the second times the string's mass over
the ball's, since a slack string has no mass here. Two of it held about 95 % of simulated landings at ratios from 0.01 to 0.3. Where
a string is slack before the drop, as in fast moves under little gravity or with short strings, errors are several times as big."""


def closed_form_casts(scenario: Scenario, casts: Array) -> pd.DataFrame:
    """Return what becomes of casts `[distance, speed, wait]`, shape (n, 3), by the closed form.

    The arm moves as its controller moves it, without saturation. As long as the string is taut it swings with the ball as one rigid
    body; a slack string has no mass. The frame has the columns of a dataset, see `.CastDataset`, that are learned from.
    """
    planned, arm = PlannedPath(scenario, casts), move_arm(scenario, casts)
    latest = planned.drop_end + scenario.motion.hold_duration
    found = fall(Swing.of(scenario), arm.path, latest, scenario.cup.rim_height, scenario.ball.radius)
    outward, upward = found.velocity
    has_landed = np.isfinite(found.radius)
    peaks = arm.peak_torque_utilization, arm.peak_velocity_utilization
    meets_limit = (peaks[0] >= 1) | (peaks[1] > 1) | ~arm.is_within_range
    status = np.where(has_landed, "landed", "never_crossed")
    columns: dict[str, Any] = dict(zip(PARAMETERS, np.asarray(casts, dtype=float).T, strict=True))
    outputs = (
        found.radius,
        np.where(has_landed, 0.0, np.nan),
        np.arctan2(np.abs(outward), -upward),
        np.hypot(outward, upward),
        found.slack,
        *peaks,
    )
    columns.update(zip(OUTPUTS, outputs, strict=True))
    return pd.DataFrame(
        columns
        | {
            "status": np.where(meets_limit, "limit_hit", status),
            "crossing_time": found.crossing_time,
            "is_slack": found.crossing_slack > SLACK_MARGIN * scenario.string.length,
        }
    )


def closed_form_std(scenario: Scenario) -> float:
    """Return the standard deviation of the closed form's own error in the landing along the casting plane [m]."""
    string = scenario.string
    return string.length * (ERROR_SHARE + ERROR_SHARE_BY_MASS * string.mass / scenario.ball.mass)


class ClosedFormModel:
    """Predicts the landing of casts by the closed form: a `.Predictor` that has seen no cast.

    Casts that fill the bounds are computed by `closed_form_casts`; kernel ridge regression of them, a `.ForwardModel`, gives smooth
    predictions with derivatives. The predictive standard deviation is that of this regression and, independent of it, that of the
    closed form's own error, `closed_form_std`, the same for all casts.

    Attributes
    ----------
    scenario
        Whose casts it predicts.
    fitted
        The regression.
    error_std
        Standard deviation of the closed form's own error in the landing along the casting plane [m].
    """

    def __init__(self, fitted: ForwardModel, error_std: float) -> None:
        self.fitted, self.error_std = fitted, error_std

    @classmethod
    @checks_types
    def of(cls, scenario: Scenario, n_casts: int = N_CASTS) -> Self:
        """Return the model of a scenario, whose noise does not count, by so many casts of the closed form.

        Raises
        ------
        InputError
            If too few of the casts land, none reaches a cup, or the arm cannot be where the scenario wants it.
        """
        frame = closed_form_casts(scenario, sample_casts(scenario, n_casts, seed=0))
        fitted = ForwardModel.fit(CastDataset(scenario, 0, frame, engine="closed form"))
        return cls(fitted, closed_form_std(scenario))

    @property
    def scenario(self) -> Scenario:
        """The scenario whose casts it predicts."""
        return self.fitted.scenario

    @property
    def reach(self) -> tuple[float, float]:
        """The smallest and the largest distance of a cup from the base axis [m]."""
        return self.fitted.reach

    @property
    def training_casts(self) -> Array:
        """Casts of the closed form, where a search may start, shape (m, 3)."""
        return self.fitted.training_casts

    @property
    def training_outputs(self) -> Array:
        """What became of them, shape (m, 7)."""
        return self.fitted.training_outputs

    def predict(self, casts: Array) -> Array:
        """Return the prediction, shape (n, 7), for casts of shape (n, 3)."""
        return self.fitted.predict(casts)

    def linearize(self, cast: Array) -> Linearization:
        """Return the `.Linearization` about one cast, shape (3,)."""
        fitted = self.fitted.linearize(cast)
        std = float(np.hypot(fitted.std, self.error_std))
        return fitted._replace(std=std, std_gradient=fitted.std / std * fitted.std_gradient)

    def landing_with_gradient(self, casts: Array) -> tuple[Array, Array]:
        """Return the landing along the plane [m] of casts of shape (n, 3), shape (n,), and its derivative, shape (n, 3)."""
        return self.fitted.landing_with_gradient(casts)
