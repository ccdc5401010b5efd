"""LossyLink: by how much a link delays each message, and which it loses or doubles; drawn from a seed."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np


@dataclass
class LossyLink:
    """A link between the arm and its controller.

    Parameters
    ----------
    delay
        From a status that is sent to when the command that answers it arrives, but for the controller's own time [s]; half of it
        each way.
    jitter
        Mean of what each message takes longer, exponentially distributed [s]: so messages overtake each other.
    loss, doubling
        Shares of the messages, each way, that are lost, and that arrive twice.
    seed
        Draws it.
    """

    delay: float = 0.0
    jitter: float = 0.0
    loss: float = 0.0
    doubling: float = 0.0
    seed: int = 0
    _rng: np.random.Generator = field(init=False, repr=False)

    def __post_init__(self) -> None:
        self._rng = np.random.default_rng(self.seed)

    def arrivals(self, sent: float) -> list[float]:
        """Return when what is sent at a time [s] arrives: once, twice, or not at all."""
        lost, doubled = self._rng.random(2)
        first, second = sent + self.delay / 2 + self.jitter * self._rng.standard_exponential(2)
        if lost < self.loss:
            return []
        return [first, second] if doubled < self.doubling else [first]
