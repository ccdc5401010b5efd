"""Drake where its type stubs refuse what works, or know less than the code: thin aliases, each with its reason (drake 1.58)."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any, TypeVar
from weakref import WeakMethod

import numpy as np
from pydrake.common.value import AbstractValue
from pydrake.math import RigidTransform, RotationMatrix
from pydrake.systems.framework import (
    CacheIndex,
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


def evaluate(source: InputPort | OutputPort, context: Context) -> Any:
    """Return the value of a port. The stubs say `object`, with which nothing can be done."""
    return source.Eval(context)


def own_context(system: System, root: Context) -> Context:
    """Return the context of `system` in a `root` context, which is the same one if the system is no part of another.

    Drake's method would then tie the context to itself, and nobody could free it any more.
    """
    try:
        system.ValidateContext(root)
    except RuntimeError:
        return system.GetMyMutableContextFromRoot(root)
    return root


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
) -> CacheIndex:
    """Declare a cache entry of `system` that holds a Python object, and return its number.

    The stubs want a `calc` of any two objects. For Drake to let go of the system one day, neither function may hold it (see
    `weakly`), nor the system the entry itself: such a cycle runs through C++, where Python's garbage collector does not see it.
    """
    untyped: Any = calc
    producer = ValueProducer(allocate=lambda: AbstractValue.Make(allocate()), calc=untyped)
    return system.DeclareCacheEntry(description, producer, prerequisites).cache_index()


def evaluate_cache(system: LeafSystem, entry: CacheIndex, context: Context) -> Any:
    """Return what a cache entry of `system` holds."""
    return system.get_cache_entry(entry).Eval(context)


def weakly(method: Callable[[Context, AbstractValue], None]) -> Callable[[Context, AbstractValue], None]:
    """Return what calls a `method` of an object that is there for as long as it is called, without keeping it there."""
    weak = WeakMethod(method)

    def call(context: Context, value: AbstractValue) -> None:
        alive = weak()
        assert alive is not None
        alive(context, value)

    return call
