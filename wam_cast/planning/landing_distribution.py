"""Landing distribution: by how much a landing is uncertain, and how probable a rim-clear entry is.

A ball of radius r that comes down at an angle a from the vertical sweeps a cylinder, which the rim plane cuts in an ellipse with
half axes r / cos a along the casting plane and r across it. The ball enters without touching the rim if that ellipse lies within
the cup's circle of radius R: along the plane, the clearance of its centre is R - r / cos a. The landing is uncertain for two
reasons: the model errs, and a real cast repeats its command only so well.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from scipy.special import ndtr

from wam_cast.planning.prediction import ACROSS, ENTRY_SPEED, DirectedPredictor, Predictor
from wam_cast.scenario import Noise, Scenario
from wam_cast.types import Array

MIN_ENTRY_COSINE = 0.2
"""Least cosine of an entry angle: flatter casts count as 78 degrees."""

MIN_NOISE_SHARE = 0.1
"""The share of a typical arm's noise that plans allow for where the scenario has less."""

N_SCATTER_CASTS = 7
"""Casts whose landing the scatter of a move is computed from."""

N_ELLIPSE_POINTS = 721
"""Points of a swept ellipse that are kept within the cup's circle."""

N_QUADRATURE_NODES = 40
"""Of the quadrature over the clearance."""

MAX_DEVIATIONS = 8.0
"""Standard deviations beyond which landings are left out."""


class LandingStd(NamedTuple):
    """Predictive standard deviations of a cast's landing along and across the casting plane [m]."""

    along: float
    across: float


def clearance(scenario: Scenario, entry_angle: float) -> float:
    """Return the clearance along the casting plane: how far from the cup's axis the ball may land there, off the rim [m].

    0 where there is none: the ball is too wide for the cup at that angle [rad].
    """
    return max(scenario.cup.inner_radius - _swept(scenario, entry_angle), 0.0)


def clearance_across(scenario: Scenario, entry_angle: float, along: Array) -> Array:
    """Return the clearance across the casting plane [m] at offsets `along` it [m], each of shape (n,).

    -inf where there is none. Every point of the swept ellipse must be within the cup's circle: for an ellipse about (x, y) with
    half axes a along and r across, (x + a cos t)^2 + (y + r sin t)^2 <= R^2 for all t, which bounds y for each t.
    """
    around = np.linspace(-math.pi, math.pi, N_ELLIPSE_POINTS)
    cup, ball = scenario.cup.inner_radius, scenario.ball.radius
    room = cup**2 - (along[:, np.newaxis] + _swept(scenario, entry_angle) * np.cos(around)) ** 2
    widths = np.where(room >= 0, np.sqrt(np.maximum(room, 0.0)) - ball * np.abs(np.sin(around)), -np.inf)
    width = widths.min(axis=1)
    return np.asarray(np.where(width >= 0, width, -np.inf))


def _swept(scenario: Scenario, entry_angle: float) -> float:
    """Return the swept ellipse's half axis along the casting plane [m]."""
    return scenario.ball.radius / max(math.cos(entry_angle), MIN_ENTRY_COSINE)


def repeatability(scenario: Scenario) -> Noise:
    """Return the noise of the move and of the swing that plans allow for: the scenario's, but at least a share of a typical arm's.

    Without noise the model's error alone tells casts into the middle apart. Of those that are alike in it, the one that forgives
    most is the better choice still.
    """
    typical = Noise.typical()
    return Noise(
        **{
            name: max(getattr(scenario.noise, name), MIN_NOISE_SHARE * getattr(typical, name))
            for name in ("distance", "speed", "wait", "swing")
        }
    )


def scatter_of_move(model: Predictor, parameters: Array, noise: Noise) -> tuple[float, Array]:
    """Return the mean square by which the move's noise puts the landing off [m^2], and its derivative, shape (3,).

    Expectations are taken by the Gauss-Hermite rule of three points along each parameter: the cast itself, and casts that are off
    by sqrt(3) standard deviations, of weight 1/6 each. Unlike the gradient, the rule sees a cliff before the cast is over it.
    """
    offsets = math.sqrt(3) * np.diag([noise.distance, noise.speed, noise.wait])
    points = parameters + np.vstack([np.zeros(3), offsets, -offsets])
    landing, gradient = model.landing_with_gradient(points)
    off, off_gradient = landing[1:] - landing[0], gradient[1:] - gradient[0]
    return float(off @ off) / 6, off @ off_gradient / 3


def scatter_of_swing(scenario: Scenario, noise: Noise, entry_speed: float) -> LandingStd:
    """Return the standard deviations of the landing for a swing of the hanging string, in whatever phase [m].

    Along the plane, where the cast's own swing carries the ball, it is the hanging ball's: s = angle * length. Across it nothing
    holds the ball once the string is slack, and it flies on as fast as the pendulum swings, s * sqrt(g / length), for about the
    time of a fall that ends with the entry speed v, v / g: s * sqrt(1 + v^2 / (g * length)) in all.
    """
    length = scenario.string.length
    swing = noise.swing * length
    return LandingStd(swing, swing * math.sqrt(1 + entry_speed**2 / (scenario.gravity * length)))


def landing_std(model: Predictor, parameters: Array, noise: Noise) -> LandingStd:
    """Return the predictive standard deviations of one cast's landing, for its `parameters`, shape (3,).

    They hold the model's own error, and what `noise` makes of the move and the swing. Noise of the torques and the encoders is
    left out: what is typical of them moves the landing by less than 0.1 and 2 mm.
    """
    expected = model.linearize(parameters)
    swing = scatter_of_swing(model.scenario, noise, expected.outputs[ENTRY_SPEED])
    mean_square, _ = scatter_of_move(model, parameters, noise)
    across = model.predict_std(parameters[np.newaxis])[0, ACROSS] if isinstance(model, DirectedPredictor) else 0.0
    return LandingStd(math.sqrt(expected.std**2 + mean_square + swing.along**2), math.hypot(across, swing.across))


def rim_clear_probability(
    scenario: Scenario, entry_angle: float, offset: tuple[float, float], std: LandingStd
) -> float:
    """Return the probability of a rim-clear entry: the ball enters the cup without touching its rim.

    Parameters
    ----------
    scenario
        Its cup and ball count.
    entry_angle
        From the vertical [rad].
    offset
        Of the expected landing from the cup's axis, along and across the casting plane [m].
    std
        Standard deviations of the landing about it, normal and independent along and across [m].
    """
    along = clearance(scenario, entry_angle)
    if along == 0.0:
        return 0.0
    tiny = np.finfo(np.float64).tiny
    # In standard deviations along: where these are small, the nodes must be where the landings are.
    low, high = (
        min(max((end - offset[0]) / (std.along + tiny), -MAX_DEVIATIONS), MAX_DEVIATIONS) for end in (-along, along)
    )
    nodes, weights = np.polynomial.legendre.leggauss(N_QUADRATURE_NODES)
    deviations = (low + high) / 2 + (high - low) / 2 * nodes
    half = clearance_across(scenario, entry_angle, offset[0] + deviations * std.along)
    across = std.across + tiny
    inside = np.maximum(ndtr((half - offset[1]) / across) - ndtr((-half - offset[1]) / across), 0.0)
    density = np.exp(-0.5 * deviations**2) / math.sqrt(2 * math.pi)
    return float(min(1.0, (high - low) / 2 * np.sum(weights * density * inside)))
