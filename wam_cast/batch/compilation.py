"""How a function that simulates casts is compiled."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import jax

PROCESSOR_OPTIONS = {"xla_backend_optimization_level": 1}
"""Of XLA. More of LLVM's passes make the function no faster, and its landings are the same to the last bit; but it would be ready
a quarter later."""


def compiled_by_jax(function: Callable[..., Any]) -> Callable[..., Any]:
    """Return what JAX makes of a function of arrays: it is compiled when its arguments have new shapes."""
    return jax.jit(function, compiler_options=PROCESSOR_OPTIONS if jax.default_backend() == "cpu" else None)


def computed_once(values: Any) -> Any:
    """Return arrays as they are, but let a processor compute them once.

    XLA joins an operation to each of those that use its result, and computes it as often. That saves the way through memory, which
    a graphics card waits for; a processor has the result in its cache.
    """
    if jax.default_backend() != "cpu":
        return values
    once: Callable[[Any], Any] = jax.lax.optimization_barrier
    return once(values)
