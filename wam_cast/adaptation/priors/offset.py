"""How a robot's casts may differ from what is believed, before the first one: the form that all ways to learn have in common."""

from __future__ import annotations

from typing import NamedTuple, Protocol, runtime_checkable

from wam_cast.types import Array


class Offset(NamedTuple):
    """How far the `.OUTPUTS` of casts are from the believed model's: mean, components with random weights, and the rest."""

    values: Array
    """Mean and components, shape (n, 1 + n_weights, 7)."""
    variance: Array
    """Of the rest, shape (n, 7)."""


class OffsetLinearization(NamedTuple):
    """An `Offset`, and its derivatives by the cast in SI units."""

    values: Array
    variance: Array
    gradient: Array
    """Of the values, shape (n, 1 + n_weights, 7, 3)."""
    variance_gradient: Array
    """Shape (n, 7, 3)."""


@runtime_checkable
class OffsetPrior(Protocol):
    """What is believed of how a robot differs.

    ::

        offset(x) = mean(x) + sum_c z_c phi_c(x) + rest(x),     z ~ N(0, I)

    The rest is normal and independent from cast to cast.
    """

    @property
    def n_weights(self) -> int:
        """Number of weights z."""

    def predict(self, casts: Array, bearing: float) -> Offset:
        """Return it at casts (n, 3) at a bearing [rad]."""

    def linearize(self, casts: Array, bearing: float) -> OffsetLinearization:
        """Return it with its derivatives."""

    def landing_along(self, weights: Array, casts: Array, bearing: float) -> tuple[Array, Array]:
        """Return mean and components, weighted by `weights`, (1 + n_weights,), of the landing along the plane alone, quickly.

        Values [m], shape (n,), and their derivatives, shape (n, 3).
        """
