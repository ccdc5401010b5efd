"""Forward models with a closed form, to plan with."""

from collections import Counter

import numpy as np
import pytest

from wam_cast.cast import cast_bounds
from wam_cast.generation.sampling import sample_casts
from wam_cast.planning.prediction import Linearization
from wam_cast.scenario import Scenario


class ClosedForm:
    """A `Predictor` of functions of the parameters, scaled to [0, 1] between their bounds.

    Each output, and `std`, is a pair: a function of casts, shape (n, 3), giving (n,), and its gradient, giving (n, 3). Outputs that
    are not named are such that nothing comes of them.
    """

    NAMES = ("along", "across", "angle", "speed", "slack", "peak_torque_utilization", "peak_velocity_utilization")

    def __init__(self, *, reach=(0.2, 1.5), training_casts=None, scenario=None, std=None, **outputs):
        self.scenario = scenario or Scenario()
        self.reach = reach
        self.calls = Counter()
        plain = dict(zip(self.NAMES, map(constant, (0.5, 0.0, 0.1, 1.5, 0.05, 0.3, 0.5)), strict=True))
        self.functions = plain | outputs
        self.std = std or constant(1e-3)
        self.lower, upper = cast_bounds(self.scenario)
        self.span = upper - self.lower
        self.know(sample_casts(self.scenario, 60, seed=1) if training_casts is None else training_casts)

    def know(self, casts):
        self.training_casts, self.training_outputs = casts, self._evaluate(casts)[0]

    def predict(self, casts):
        assert casts.ndim == 2
        self.calls["predict"] += 1
        return self._evaluate(casts)[0]

    def linearize(self, cast):
        self.calls["linearize"] += 1
        outputs, gradient = self._evaluate(cast[np.newaxis])
        scaled = (cast[np.newaxis] - self.lower) / self.span
        std, std_gradient = (function(scaled)[0] for function in self.std)
        return Linearization(outputs[0], gradient[0], float(std), std_gradient / self.span)

    def landing_with_gradient(self, casts):
        self.calls["landing_with_gradient"] += len(casts)
        outputs, gradient = self._evaluate(casts)
        return outputs[:, 0], gradient[:, 0]

    def _evaluate(self, casts):
        scaled = (casts - self.lower) / self.span
        functions = [self.functions[name] for name in self.NAMES]
        gradients = [gradient(scaled) / self.span for _, gradient in functions]
        return np.column_stack([value(scaled) for value, _ in functions]), np.stack(gradients, axis=1)


def linear(offset, *slopes):
    slopes = np.array(slopes or (0, 0, 0), dtype=float)
    return (lambda s: offset + s @ slopes), (lambda s: np.tile(slopes, (len(s), 1)))


def constant(value):
    return linear(value)


@pytest.fixture
def make_model():
    """Return a function that makes a model whose outputs, given as an offset and slopes, are linear in the scaled parameters."""

    def make(along=(0.4, 0.3, 0.2, 0.1), **outputs):
        options = {name: outputs.pop(name) for name in ("reach", "training_casts", "scenario") if name in outputs}
        lines = {name: linear(*np.atleast_1d(line)) for name, line in ({"along": along} | outputs).items()}
        return ClosedForm(**lines, **options)

    return make


@pytest.fixture
def curved_model():
    """Return a model whose landing, entry angle and error are curved, without symmetry."""
    along = (
        lambda s: 0.4 + 0.3 * s[:, 0] + 0.2 * s[:, 1] ** 2 + 0.1 * s[:, 0] * s[:, 2],
        lambda s: np.column_stack([0.3 + 0.1 * s[:, 2], 0.4 * s[:, 1], 0.1 * s[:, 0]]),
    )
    angle = (
        lambda s: 0.4 + 0.3 * np.sin(s[:, 0] - s[:, 2]),
        lambda s: 0.3 * np.column_stack([np.cos(s[:, 0] - s[:, 2]), 0 * s[:, 1], -np.cos(s[:, 0] - s[:, 2])]),
    )
    std = (
        lambda s: 1e-3 * np.exp((s[:, 0] - 0.6) ** 2 + (s[:, 1] - 0.3) ** 2 + (s[:, 2] - 0.4) ** 2),
        lambda s: 2 * (s - [0.6, 0.3, 0.4]) * 1e-3 * np.exp(np.sum((s - [0.6, 0.3, 0.4]) ** 2, axis=1))[:, None],
    )
    return ClosedForm(along=along, angle=angle, std=std)
