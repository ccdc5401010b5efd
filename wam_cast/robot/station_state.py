"""StationState: the state of a station apart from its context, to go on with in another one."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from typing import NamedTuple, Self

from pydrake.common.value import AbstractValue
from pydrake.systems.framework import Context, System

from wam_cast.types import Array


class PartState(NamedTuple):
    """The state of one system: continuous, discrete by group, and abstract."""

    continuous: Array
    discrete: list[Array]
    abstract: list[AbstractValue]


@dataclass(frozen=True, eq=False)
class StationState:
    """The time [s] in a diagram's context, and the state of those of its systems that have one."""

    time: float
    parts: tuple[PartState, ...]

    @classmethod
    def of(cls, root: Context, systems: Iterable[System]) -> Self:
        """Return a copy of the state of `systems` in the diagram's context `root`."""
        parts = []
        for system in systems:
            own = system.GetMyContextFromRoot(root)
            continuous = own.get_continuous_state_vector().CopyToVector()
            discrete = [own.get_discrete_state(i).value().copy() for i in range(own.num_discrete_state_groups())]
            abstract = [own.get_abstract_state(i).Clone() for i in range(own.num_abstract_states())]
            parts.append(PartState(continuous, discrete, abstract))
        return cls(root.get_time(), tuple(parts))

    def put_into(self, root: Context, systems: Iterable[System]) -> None:
        """Give `systems`, the same ones in this or another diagram, this state in the context `root`; its time stays."""
        for system, part in zip(systems, self.parts, strict=True):
            own = system.GetMyMutableContextFromRoot(root)
            own.get_mutable_continuous_state_vector().SetFromVector(part.continuous)
            for i, values in enumerate(part.discrete):
                own.SetDiscreteState(i, values)
            for i, value in enumerate(part.abstract):
                own.get_mutable_abstract_state(i).SetFrom(value)
