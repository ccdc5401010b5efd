"""Predictor: what planners know of a forward model."""

from __future__ import annotations

from typing import NamedTuple, Protocol, runtime_checkable

from wam_cast.scenario import Scenario
from wam_cast.types import Array

OUTPUTS = (
    "landing_along",
    "landing_across",
    "entry_angle",
    "entry_speed",
    "slack",
    "peak_torque_utilization",
    "peak_velocity_utilization",
)
"""What is predicted of a cast: landing along and across the casting plane [m], entry angle [rad] and speed [m/s], slack of the
string from the landing on [m], and the peak torque and velocity utilization over the joints."""

ALONG, ACROSS, ENTRY_ANGLE, ENTRY_SPEED, SLACK, PEAK_TORQUE_UTILIZATION, PEAK_VELOCITY_UTILIZATION = range(len(OUTPUTS))
"""The columns of a prediction."""


class Linearization(NamedTuple):
    """A model linearized about one cast; derivatives by `[distance, speed, wait]` in SI units."""

    outputs: Array
    """The prediction, shape (7,)."""
    gradient: Array
    """Its derivative, shape (7, 3)."""
    std: float
    """Predictive standard deviation of the landing along the casting plane, for the model's own error [m]."""
    std_gradient: Array
    """Its derivative, shape (3,)."""


@runtime_checkable
class Predictor(Protocol):
    """What planners know of a forward model. It works in the casting plane; casts are rows `[distance, speed, wait]`."""

    @property
    def scenario(self) -> Scenario:
        """The scenario whose casts it predicts."""

    @property
    def reach(self) -> tuple[float, float]:
        """The smallest and the largest distance of a cup from the base axis [m]."""

    @property
    def training_casts(self) -> Array:
        """Casts with known landings, shape (m, 3): where a search may start."""

    @property
    def training_outputs(self) -> Array:
        """What became of them, columns as of a prediction, shape (m, 7)."""

    def predict(self, casts: Array) -> Array:
        """Return the prediction, shape (n, 7), for casts of shape (n, 3)."""

    def linearize(self, cast: Array) -> Linearization:
        """Return the `Linearization` about one cast, shape (3,)."""

    def landing_with_gradient(self, casts: Array) -> tuple[Array, Array]:
        """Return the landing along the plane [m] of casts of shape (n, 3), shape (n,), and its derivative, shape (n, 3)."""


@runtime_checkable
class DirectedPredictor(Predictor, Protocol):
    """A model of a robot whose casts land otherwise in each direction, as those of a tilted base do."""

    def toward(self, bearing: float) -> Predictor:
        """Return the model of the casts at a bearing [rad]."""

    def predict_std(self, casts: Array) -> Array:
        """Return the standard deviations of what is predicted, shape (n, 7), for casts of shape (n, 3)."""
