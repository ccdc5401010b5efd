"""Forward models with a closed form, to plan with."""

from collections import Counter

import numpy as np
import pytest

from wam_cast.cast import cast_bounds
from wam_cast.learning.sampling import sample_casts
from wam_cast.scenario import Scenario


class ClosedForm:
    """A `Predictor` of functions of the parameters, scaled to [0, 1] between their bounds.

    Each output is a pair: a function of casts, shape (n, 3), giving (n,), and its gradient, giving (n, 3).
    """

    def __init__(self, along, across=None, angle=None, *, reach=(0.2, 1.5), known_casts=None, scenario=None):
        nothing = constant(0.0)
        self.scenario = scenario or Scenario()
        self.reach = reach
        self.known_casts = sample_casts(self.scenario, 60, seed=1) if known_casts is None else known_casts
        self.calls = Counter()
        self._outputs = [along, across or nothing, angle or nothing]
        self.lower, upper = cast_bounds(self.scenario)
        self.span = upper - self.lower

    def set_along(self, value, gradient):
        self._outputs[0] = value, gradient

    def set_angle(self, value, gradient):
        self._outputs[2] = value, gradient

    def predict(self, casts):
        assert casts.ndim == 2
        self.calls["predict"] += 1
        return self._values(casts)

    def predict_with_gradient(self, casts):
        self.calls["predict_with_gradient"] += 1
        scaled = (casts - self.lower) / self.span
        gradients = [gradient(scaled) / self.span for _, gradient in self._outputs]
        return self._values(casts), np.stack(gradients, axis=1)

    def _values(self, casts):
        scaled = (casts - self.lower) / self.span
        return np.column_stack([value(scaled) for value, _ in self._outputs])


def linear(offset, *slopes):
    slopes = np.array(slopes, dtype=float)
    return (lambda s: offset + s @ slopes), (lambda s: np.tile(slopes, (len(s), 1)))


def constant(value):
    return linear(value, 0, 0, 0)


@pytest.fixture
def make_model():
    """Return a function that makes a model whose outputs are linear in the scaled parameters."""

    def make(along=(0.4, 0.3, 0.2, 0.1), across=0.0, angle=None, **options):
        return ClosedForm(
            linear(*along), constant(across), constant(0.1) if angle is None else linear(*angle), **options
        )

    return make


@pytest.fixture
def curved_model():
    """Return a model whose landing and entry angle are curved, without symmetry."""
    along = (
        lambda s: 0.4 + 0.3 * s[:, 0] + 0.2 * s[:, 1] ** 2 + 0.1 * s[:, 0] * s[:, 2],
        lambda s: np.column_stack([0.3 + 0.1 * s[:, 2], 0.4 * s[:, 1], 0.1 * s[:, 0]]),
    )
    angle = (
        lambda s: 0.2 + np.sin(s[:, 0] - s[:, 2]),
        lambda s: np.column_stack([np.cos(s[:, 0] - s[:, 2]), 0 * s[:, 1], -np.cos(s[:, 0] - s[:, 2])]),
    )
    return ClosedForm(along, constant(0.0), angle)
