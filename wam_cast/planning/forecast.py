"""Prediction: what a model says of any cast for any cup, planned or not."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from wam_cast.cast import Cast
from wam_cast.casting_plane import to_casting_plane
from wam_cast.planning.landing_distribution import Spread, clear_entry_probability, landing_spread
from wam_cast.planning.prediction import ACROSS, ALONG, ENTRY_ANGLE, PEAK_LOAD, PEAK_SPEED, Predictor
from wam_cast.types import Array


@dataclass(frozen=True)
class Prediction:
    """What a model says of a cast for a cup.

    Attributes
    ----------
    landing
        World (x, y) [m], shape (2,).
    spread
        Of it along and across the casting plane [m].
    miss
        Distance from the cup's axis [m].
    clear_entry_probability
        That the ball enters the cup without touching its rim.
    peak_load, peak_speed
        The largest shares of the motors' torque and of the joints' speed limits.
    """

    landing: Array
    spread: Spread
    miss: float
    clear_entry_probability: float
    peak_load: float
    peak_speed: float

    @classmethod
    def of(cls, model: Predictor, cast: Cast, cup: tuple[float, float]) -> Prediction:
        """Ask `model` about `cast` for a cup at world (x, y) [m]."""
        outputs = model.predict(cast.to_array()[np.newaxis])[0]
        along, across = float(outputs[ALONG]), float(outputs[ACROSS])
        spread = landing_spread(model, cast.to_array(), model.scenario.noise)
        cup_along, cup_across = to_casting_plane(np.array(cup), cast.bearing)
        offset = along - cup_along, across - cup_across
        c, s = math.cos(cast.bearing), math.sin(cast.bearing)
        return cls(
            landing=np.array([c * along - s * across, s * along + c * across]),
            spread=spread,
            miss=math.hypot(*offset),
            clear_entry_probability=clear_entry_probability(
                model.scenario, float(outputs[ENTRY_ANGLE]), offset, spread
            ),
            peak_load=float(outputs[PEAK_LOAD]),
            peak_speed=float(outputs[PEAK_SPEED]),
        )
