"""What the best cast is: of all that land in the cup's middle, the one whose ball most surely enters without touching the rim.

A ball of radius r that comes down at an angle a from the vertical sweeps a cylinder, which the rim plane cuts in an ellipse with
half axes r / cos a along the casting plane and r across it. It enters clear if that ellipse lies within the cup's circle of
radius R: along the plane, its centre may be off by R - r / cos a. By how much it is off is uncertain, for two reasons: the model
errs, and a real cast repeats its command only so well.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from scipy.special import ndtr

from wam_cast.planning.prediction import Predictor
from wam_cast.scenario import Noise, Scenario
from wam_cast.types import Array

STEEP = 0.2
"""Least cosine of an entry angle: flatter casts count as 78 degrees."""

LITTLE = 0.1
"""Of a typical arm's noise, which plans allow for where the scenario has less."""

N_SCATTER_CASTS = 7
"""Casts whose landing the scatter of a move is computed from."""

N_AROUND = 721
"""Points of a swept ellipse that are kept within the cup's circle."""

N_NODES = 40
"""Of the quadrature over the clear offsets."""

FARTHEST = 8.0
"""Standard deviations beyond which there are no landings."""


class Spread(NamedTuple):
    """By how much a cast's landing is uncertain along and across the casting plane: standard deviations [m]."""

    along: float
    across: float


def clear_offset(scenario: Scenario, entry_angle: float) -> float:
    """Return how far from the cup's axis the ball may land along the casting plane and still enter clear [m].

    0 where it cannot: the ball is too wide for the cup at that angle [rad].
    """
    return max(scenario.cup.inner_radius - _swept(scenario, entry_angle), 0.0)


def clear_half_width(scenario: Scenario, entry_angle: float, along: Array) -> Array:
    """Return how far across the casting plane the ball may land and still enter clear [m], at offsets `along` it [m], (n,).

    -inf where it cannot. Every point of the swept ellipse must be within the cup's circle: for an ellipse about (x, y) with half
    axes a along and r across, (x + a cos t)^2 + (y + r sin t)^2 <= R^2 for all t, which bounds y for each t.
    """
    around = np.linspace(-math.pi, math.pi, N_AROUND)
    cup, ball = scenario.cup.inner_radius, scenario.ball.radius
    room = cup**2 - (along[:, np.newaxis] + _swept(scenario, entry_angle) * np.cos(around)) ** 2
    widths = np.where(room >= 0, np.sqrt(np.maximum(room, 0.0)) - ball * np.abs(np.sin(around)), -np.inf)
    width = widths.min(axis=1)
    return np.asarray(np.where(width >= 0, width, -np.inf))


def _swept(scenario: Scenario, entry_angle: float) -> float:
    return scenario.ball.radius / max(math.cos(entry_angle), STEEP)


def repeatability(scenario: Scenario) -> Noise:
    """Return the noise of the move and of the swing that plans allow for: the scenario's, but at least a little of each.

    Without noise the model's error alone tells casts into the middle apart; of those that are alike in it, the one that forgives
    most is the better choice still.
    """
    typical = Noise.typical()
    return Noise(
        **{
            name: max(getattr(scenario.noise, name), LITTLE * getattr(typical, name))
            for name in ("distance", "speed", "wait", "swing")
        }
    )


def scatter_of_move(model: Predictor, parameters: Array, noise: Noise) -> tuple[float, Array]:
    """Return the mean square by which the move's noise puts the landing off [m^2], and its derivative, shape (3,).

    Expectations are taken by the Gauss-Hermite rule of three points along each parameter: the cast itself, and casts that are off
    by sqrt(3) standard deviations, of weight 1/6 each. Unlike the gradient alone it sees a cliff before the cast is over it.
    """
    offsets = math.sqrt(3) * np.diag([noise.distance, noise.speed, noise.wait])
    points = parameters + np.vstack([np.zeros(3), offsets, -offsets])
    landing, gradient = model.landing_with_gradient(points)
    off, off_gradient = landing[1:] - landing[0], gradient[1:] - gradient[0]
    return float(off @ off) / 6, off @ off_gradient / 3


def landing_spread(model: Predictor, parameters: Array, noise: Noise) -> Spread:
    """Return the spread of the landing of one cast, shape (3,): the model's own error, and what noise makes of move and swing.

    Noise of the torques and the encoders is left out: what is typical of them moves the landing by less than 0.1 and 2 mm.
    A swing of the hanging string, in whatever phase, moves the landing by about as much as the ball: its angle times the
    string's length.
    """
    swing = noise.swing * model.scenario.string.length
    mean_square, _ = scatter_of_move(model, parameters, noise)
    return Spread(math.sqrt(model.expand(parameters).std ** 2 + mean_square + swing**2), swing)


def clear_entry_probability(
    scenario: Scenario, entry_angle: float, offset: tuple[float, float], spread: Spread
) -> float:
    """Return the probability that the ball enters the cup without touching its rim.

    Parameters
    ----------
    scenario
        Its cup and ball count.
    entry_angle
        From the vertical [rad].
    offset
        Of the expected landing from the cup's axis, along and across the casting plane [m].
    spread
        Of the landing about it, normal and independent along and across.
    """
    along = clear_offset(scenario, entry_angle)
    if along == 0.0:
        return 0.0
    tiny = np.finfo(np.float64).tiny
    # In standard deviations along: narrow spreads need the nodes where the landings are.
    low, high = (
        min(max((end - offset[0]) / (spread.along + tiny), -FARTHEST), FARTHEST) for end in (-along, along)
    )
    nodes, weights = np.polynomial.legendre.leggauss(N_NODES)
    deviations = (low + high) / 2 + (high - low) / 2 * nodes
    half = clear_half_width(scenario, entry_angle, offset[0] + deviations * spread.along)
    across = spread.across + tiny
    inside = np.maximum(ndtr((half - offset[1]) / across) - ndtr((-half - offset[1]) / across), 0.0)
    density = np.exp(-0.5 * deviations**2) / math.sqrt(2 * math.pi)
    return float(min(1.0, (high - low) / 2 * np.sum(weights * density * inside)))
