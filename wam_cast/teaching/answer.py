"""Answer: a learner's function, called with care: whatever it does, what is wrong with it is said in one line."""

from __future__ import annotations

import copy
import traceback
from collections.abc import Callable, Mapping
from typing import Any, Protocol

import numpy as np
from numpy.typing import ArrayLike

from wam_cast.types import Array

LONGEST = 160
"""Letters of an exception's own words."""

Shape = tuple[int, ...] | None


class WrongError(Exception):
    """The answer is wrong; the words say which property fails, and never what is right."""


class NotYetError(Exception):
    """The answer is not written yet."""


class Judge(Protocol):
    """Asks an answer what it makes of inputs drawn by `rng`; raises `WrongError` or `NotYetError`, or returns if it is right."""

    __name__: str

    def __call__(self, answer: Answer, rng: np.random.Generator, /) -> None:
        """Judge an answer."""


class Answer:
    """A learner's function, to be asked for arrays of a shape; `None` takes any."""

    def __init__(self, function: Callable[..., Any]) -> None:
        self._function = function

    def __call__(self, *arguments: Any, shape: Shape = ()) -> Array:
        """Return what the function makes of the arguments, of the given shape and finite; raise if it does not."""
        return _as_array(self._call(arguments), shape, "the result")

    def parts(self, *arguments: Any, **shapes: Shape) -> list[Array]:
        """Return the parts of a result of several, by their names and shapes."""
        found = self._call(arguments)
        names = ", ".join(shapes)
        if not isinstance(found, tuple | list | np.ndarray) or len(found) != len(shapes):
            raise WrongError(f"must return {len(shapes)} things: {names}")
        return [_as_array(one, shape, name) for one, (name, shape) in zip(found, shapes.items(), strict=True)]

    def _call(self, arguments: tuple[Any, ...]) -> Any:
        given = copy.deepcopy(arguments)
        try:
            with np.errstate(all="ignore"):  # what comes of it is told
                found = self._function(*given)
        except NotImplementedError:
            raise NotYetError from None
        except Exception as error:
            if isinstance(error, TypeError) and any(word in str(error) for word in ("ellipsis", "NoneType")):
                raise NotYetError("something that it needs returns nothing so far; solve that first") from None
            raise WrongError(described(error)) from None
        if found is None or found is ...:
            raise NotYetError
        for before, after in zip(arguments, given, strict=True):
            if isinstance(before, np.ndarray) and not np.array_equal(before, after):
                raise WrongError("changes the array that it was given; work on a copy")
        return found


def agree(
    found: Array, expected: ArrayLike, allowed: float, words: str, mistakes: Mapping[str, ArrayLike] | None = None
) -> None:
    """Raise `WrongError` unless `found` is within `allowed` of what is expected, relative to the largest of it if that is above 1.

    The words are of what fails; or those of the mistake, out of `mistakes`, that gives what was found.
    """
    expected = np.asarray(expected)
    bound = allowed * max(1.0, float(np.max(np.abs(expected))))
    error = float(np.max(np.abs(found - expected)))
    if error <= bound:
        return
    for hint, result in (mistakes or {}).items():
        mistaken = np.asarray(result, dtype=float)
        if mistaken.shape == found.shape and np.max(np.abs(found - mistaken)) <= bound:
            raise WrongError(hint)
    raise WrongError(f"{words}: off by {error:.2g}, and {bound:.2g} is allowed")


def require(holds: object, words: str) -> None:
    """Raise `WrongError` unless a property holds."""
    if not holds:
        raise WrongError(words)


def _as_array(value: Any, shape: Shape, name: str) -> Array:
    if value is None or value is ...:
        raise NotYetError
    try:
        array = np.asarray(value, dtype=float)
    except (TypeError, ValueError):
        raise WrongError(f"{name} must be numbers, not {type(value).__name__}") from None
    if shape is not None and array.shape != shape:
        turned = " (transposed?)" if array.shape == shape[::-1] and len(shape) == 2 else ""
        wanted = f"one number, shape {shape}" if shape == () else f"of shape {shape}"
        raise WrongError(f"{name} must be {wanted}, and has the shape {array.shape}{turned}")
    if not np.all(np.isfinite(array)):
        raise WrongError(f"{name} has values that are not finite")
    return array


def described(error: BaseException) -> str:
    """Return in one line what was raised, and where in the learner's code."""
    if isinstance(error, SyntaxError):
        kind, said, line = "SyntaxError", error.msg, error.lineno
    else:
        frames = traceback.extract_tb(error.__traceback__)
        kind, said, line = type(error).__name__, str(error), (frames[1] if len(frames) > 1 else frames[0]).lineno
    said = " ".join(said.split())[:LONGEST]
    return f"raises {kind}{f': {said}' if said else ''} (line {line} of its cell)"
