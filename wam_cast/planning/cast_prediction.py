"""Prediction: what a model says of a cast for a cup, planned or not."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from wam_cast.cast import Cast
from wam_cast.casting_plane import from_casting_plane, to_casting_plane, to_polar
from wam_cast.planning.landing_distribution import LandingStd, landing_std, rim_clear_probability
from wam_cast.planning.prediction import (
    ACROSS,
    ALONG,
    ENTRY_ANGLE,
    ENTRY_SPEED,
    PEAK_TORQUE_UTILIZATION,
    PEAK_VELOCITY_UTILIZATION,
    SLACK,
    Predictor,
)
from wam_cast.types import Array, Position


@dataclass(frozen=True)
class Prediction:
    """What a model says of a cast for a cup.

    Attributes
    ----------
    cast
        The cast.
    landing
        World (x, y) where the ball is expected to cross the rim plane [m], shape (2,).
    miss
        Its distance from the cup's axis [m].
    std
        Predictive standard deviations of the landing along and across the casting plane [m]: the model's own error, and the
        scenario's noise of the move and the swing.
    entry_angle, entry_speed
        Of the ball at the rim plane: from the vertical [rad], and [m/s].
    slack
        Of the string from the landing on [m].
    peak_torque_utilization, peak_velocity_utilization
        The largest utilization of the motors' torque limits and of the joints' velocity limits, up to the landing.
    rim_clear_probability
        That the ball enters the cup without touching its rim.
    """

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
        outputs = _outputs(model, cast.to_array())
        along, across = to_casting_plane(np.array(cup), cast.bearing)
        return cls._from_outputs(model, cast, cup, outputs, (outputs[ALONG] - along, outputs[ACROSS] - across))

    @classmethod
    def aimed(cls, model: Predictor, parameters: Array, cup: Position) -> Prediction:
        """Ask `model` about the cast `[distance, speed, wait]`, shape (3,), whose bearing aims it at a cup at world (x, y) [m].

        The casting plane is turned by what the ball is expected to land beside it, so that the ball is expected on the line from
        the base axis to the cup.
        """
        outputs = _outputs(model, parameters)
        radius, bearing = to_polar(cup)
        cast = Cast.from_array(parameters, bearing - math.atan2(outputs[ACROSS], outputs[ALONG]))
        offset = math.hypot(outputs[ALONG], outputs[ACROSS]) - radius, 0.0
        return cls._from_outputs(model, cast, cup, outputs, offset)

    @classmethod
    def _from_outputs(
        cls, model: Predictor, cast: Cast, cup: Position, outputs: list[float], offset: tuple[float, float]
    ) -> Prediction:
        """Return what the model's `outputs` for `cast` mean for a cup from which the ball lands by `offset` [m]."""
        std = landing_std(model, cast.to_array(), model.scenario.noise)
        landing = from_casting_plane(outputs[ALONG], outputs[ACROSS], cast.bearing)
        return cls(
            cast=cast,
            landing=landing,
            miss=float(np.linalg.norm(landing - cup)),
            std=std,
            entry_angle=outputs[ENTRY_ANGLE],
            entry_speed=outputs[ENTRY_SPEED],
            slack=outputs[SLACK],
            peak_torque_utilization=outputs[PEAK_TORQUE_UTILIZATION],
            peak_velocity_utilization=outputs[PEAK_VELOCITY_UTILIZATION],
            rim_clear_probability=rim_clear_probability(model.scenario, outputs[ENTRY_ANGLE], offset, std),
        )


def _outputs(model: Predictor, parameters: Array) -> list[float]:
    values: list[float] = model.predict(parameters[np.newaxis])[0].tolist()
    return values
