"""Predictor: what planners know of a forward model."""

from __future__ import annotations

from typing import Protocol

from wam_cast.scenario import Scenario
from wam_cast.types import Array

ALONG, ACROSS, ENTRY_ANGLE, ENTRY_SPEED, SLACK, PEAK_LOAD, PEAK_SPEED = range(7)
"""The columns of a prediction: landing along and across the casting plane [m], entry angle [rad] and speed [m/s], slack of the
string from the landing on [m], the largest shares of the motors' torque and of the joints' speed limits."""


class Expansion(Protocol):
    """A model about one cast; derivatives by `[distance, speed, wait]` in SI units."""

    @property
    def outputs(self) -> Array:
        """The prediction, shape (7,)."""

    @property
    def gradient(self) -> Array:
        """Of the prediction, shape (7, 3)."""

    @property
    def std(self) -> float:
        """By how much the landing along the plane may be off for the model's own error, one standard deviation [m]."""

    @property
    def std_gradient(self) -> Array:
        """Its derivative, shape (3,)."""


class Predictor(Protocol):
    """What planners know of a forward model. It works in the casting plane; casts are rows `[distance, speed, wait]`."""

    @property
    def scenario(self) -> Scenario:
        """The scenario whose casts it predicts."""

    @property
    def reach(self) -> tuple[float, float]:
        """The smallest and the largest distance of a cup from the base axis [m]."""

    @property
    def known_casts(self) -> Array:
        """Casts with known landings, shape (m, 3): where a search may start."""

    @property
    def known_outputs(self) -> Array:
        """What became of them, columns as of a prediction, shape (m, 7)."""

    def predict(self, casts: Array) -> Array:
        """Return the prediction, shape (n, 7), for casts of shape (n, 3)."""

    def expand(self, cast: Array) -> Expansion:
        """Return the `Expansion` about one cast, shape (3,)."""

    def landing_with_gradient(self, casts: Array) -> tuple[Array, Array]:
        """Return the landing along the plane [m] of casts of shape (n, 3), shape (n,), and its derivative, shape (n, 3)."""
