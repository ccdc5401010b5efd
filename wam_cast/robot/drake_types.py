"""Drake where its type stubs refuse what works, or know less than the code: thin aliases, each with its reason (drake 1.58)."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any, TypeVar

import numpy as np
from pydrake.common.value import AbstractValue
from pydrake.math import RigidTransform, RotationMatrix
from pydrake.systems.framework import (
    CacheEntry,
    Context,
    DependencyTicket,
    DiagramBuilder,
    InputPort,
    LeafSystem,
    OutputPort,
    System,
    ValueProducer,
)

from wam_cast.types import Array

S = TypeVar("S", bound=System)


def translation(p: Sequence[float] | Array, R: RotationMatrix | None = None) -> RigidTransform:
    """Return the pose at `p` [m], (3,), turned by `R`, if at all. The stubs take arrays alone."""
    position = np.array(p, dtype=float)
    return RigidTransform(position) if R is None else RigidTransform(R, position)


def add_system(builder: DiagramBuilder, name: str, system: S) -> S:
    """Add `system` to a diagram under its name, and return it. The stubs return a `System` of no kind."""
    builder.AddNamedSystem(name, system)
    return system


def evaluate(source: InputPort | OutputPort | CacheEntry, context: Context) -> Any:
    """Return the value of a port or a cache entry. The stubs say `object`, with which nothing can be done."""
    return source.Eval(context)


def held(value: AbstractValue) -> Any:
    """Return what a value holds. The stubs say that it is nothing."""
    untyped: Any = value
    return untyped.get_value()


def declare_cache_entry(
    system: LeafSystem,
    description: str,
    allocate: Callable[[], object],
    calc: Callable[[Context, AbstractValue], None],
    prerequisites: set[DependencyTicket],
) -> CacheEntry:
    """Declare a cache entry of `system` that holds a Python object. The stubs want a `calc` of any two objects."""
    untyped: Any = calc
    producer = ValueProducer(allocate=lambda: AbstractValue.Make(allocate()), calc=untyped)
    return system.DeclareCacheEntry(description, producer, prerequisites)
