"""Prediction: what a model says of a cast for a cup, planned or not."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from wam_cast.cast import Cast
from wam_cast.casting_plane import from_casting_plane, to_casting_plane, to_polar
from wam_cast.planning.landing_distribution import LandingStd, landing_std, rim_clear_probability
from wam_cast.planning.prediction import ACROSS, ALONG, Predictor
from wam_cast.types import Array, Position


class Prediction(NamedTuple):
    """What a model says of a cast for a cup; `.Plan` has the same fields in the same order, and says what they are."""

    cast: Cast
    landing: Array
    miss: float
    std: LandingStd
    entry_angle: float
    entry_speed: float
    slack: float
    peak_torque_utilization: float
    peak_velocity_utilization: float
    rim_clear_probability: float

    @classmethod
    def of(cls, model: Predictor, cast: Cast, cup: Position) -> Prediction:
        """Ask `model` about `cast` for a cup at world (x, y) [m]."""
        outputs = model.predict(cast.to_array()[np.newaxis])[0].tolist()
        along, across = to_casting_plane(np.array(cup), cast.bearing)
        return cls._from_outputs(model, cast, cup, outputs, (outputs[ALONG] - along, outputs[ACROSS] - across))

    @classmethod
    def aimed(cls, model: Predictor, parameters: Array, cup: Position) -> Prediction:
        """Ask `model` about the cast `[distance, speed, wait]`, shape (3,), whose bearing aims it at a cup at world (x, y) [m].

        The casting plane is turned by what the ball is expected to land beside it, so that the ball is expected on the line from
        the base axis to the cup.
        """
        outputs = model.predict(parameters[np.newaxis])[0].tolist()
        radius, bearing = to_polar(cup)
        cast = Cast.from_array(parameters, bearing - math.atan2(outputs[ACROSS], outputs[ALONG]))
        offset = math.hypot(outputs[ALONG], outputs[ACROSS]) - radius, 0.0
        return cls._from_outputs(model, cast, cup, outputs, offset)

    @classmethod
    def _from_outputs(
        cls, model: Predictor, cast: Cast, cup: Position, outputs: list[float], offset: tuple[float, float]
    ) -> Prediction:
        """Return what the model's `outputs` for `cast` mean for a cup from which the ball lands by `offset` [m]."""
        along, across, entry_angle, entry_speed, slack, peak_torque, peak_velocity = outputs
        std = landing_std(model, cast.to_array(), model.scenario.noise)
        landing = from_casting_plane(along, across, cast.bearing)
        miss = float(np.linalg.norm(landing - cup))
        probability = rim_clear_probability(model.scenario, entry_angle, offset, std)
        return cls(cast, landing, miss, std, entry_angle, entry_speed, slack, peak_torque, peak_velocity, probability)
