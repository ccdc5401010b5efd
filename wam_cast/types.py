"""Types that all of the package shares, and the check that arguments are of the types that they are said to be."""

from __future__ import annotations

import inspect
import os
from collections.abc import Callable, Collection, Sequence
from functools import cache, wraps
from pathlib import Path
from types import UnionType
from typing import Any, TypeVar, Union, get_args, get_origin, get_type_hints

import numpy as np
from numpy.typing import NDArray

from wam_cast.errors import InputError, quoted

Array = NDArray[np.float64]
"""Real numbers; docstrings say of which shape and unit."""

Position = tuple[float, float]
"""World (x, y) on the floor [m], such as that of a cup's axis."""

F = TypeVar("F", bound=Callable[..., Any])

LEFT_TO_THE_FUNCTION = (bool, int, float)
"""Types that are not checked: whoever takes a number knows its range, and says both in one line."""


def checks_types(function: F) -> F:
    """Let a function refuse arguments that are not of the types in its annotations; of a class, let its constructor do so.

    Classes, callables, and sequences of them are checked; numbers, arrays and choices are left to the function. Raises
    `.InputError`, which names the argument. By hand: `pydantic.validate_call` makes other values of the arguments, and `beartype`
    takes no list for a pair.
    """
    if isinstance(function, type):
        setattr(function, "__init__", checks_types(getattr(function, "__init__")))  # noqa: B009, B010 - mypy knows no such class
        return function
    signature = inspect.signature(function)

    @cache
    def hints() -> dict[str, Any]:
        return {name: hint for name, hint in get_type_hints(function).items() if name in signature.parameters}

    @wraps(function)
    def checked(*args: Any, **kwargs: Any) -> Any:
        try:
            given = signature.bind(*args, **kwargs).arguments
        except TypeError:
            return function(*args, **kwargs)  # which says it better
        for name, value in given.items():
            if name in hints() and not _fits(value, hints()[name]):
                raise InputError(f"{name} = {quoted(value)} must be {_described(hints()[name])}")
        return function(*args, **kwargs)

    return checked  # type: ignore[return-value]


def _fits(value: object, hint: Any) -> bool:
    origin, inner = get_origin(hint), get_args(hint)
    if origin in (Union, UnionType):
        return any(_fits(value, one) for one in inner)
    if origin is Callable:
        return callable(value)
    if origin is Sequence:
        return isinstance(value, Collection) and all(_fits(one, inner[0]) for one in value)
    if not isinstance(hint, type) or hint in LEFT_TO_THE_FUNCTION or origin is not None:
        return True
    return isinstance(value, os.PathLike if hint is Path else hint)


def _described(hint: Any) -> str:
    """Return a type in words."""
    origin, inner = get_origin(hint), get_args(hint)
    if origin in (Union, UnionType):
        return " or ".join(_described(one) for one in inner)
    if origin is Callable:
        return "a function"
    if origin is Sequence:
        return f"a sequence, each {_described(inner[0])}"
    names = {type(None): "None", str: "a text", Path: "a path"}
    return names.get(hint) or f"a {getattr(hint, '__name__', hint)}"
