"""The errors that users meet: of their own input, and of the machine; and what raises them in many places."""

from __future__ import annotations

import math
import operator
import re
import reprlib
from collections.abc import Callable
from functools import wraps
from numbers import Real
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from pydantic import BaseModel, ValidationError


LONGEST_WORD, LONGEST_LINE = 200, 1000
"""Letters of a word in a message, such as a path, and of all of it but the commands that it names."""

_SHORT = reprlib.Repr()
_SHORT.maxlevel, _SHORT.maxstring, _SHORT.maxother, _SHORT.maxlong = 3, 100, 100, 100


class _OneLineError(Exception):
    """Whatever the line quotes, it is one line, not too long, and of letters that any terminal shows."""

    def __init__(self, line: str) -> None:
        super().__init__(_bounded(spelled_out(" ".join(part.strip() for part in line.splitlines()))))


class InputError(_OneLineError, ValueError):
    """Input that cannot be used: one line that names the value, what is allowed and how to fix it.

    The command line prints it and exits with code 2; from Python it is a `ValueError`.
    """


class MachineError(_OneLineError, RuntimeError):
    """The machine failed, not the input and not the simulation: one line that says what happened and how to go on.

    The command line prints it and exits with code 2.
    """


def spelled_out(text: str) -> str:
    """Return a text in which control characters and stray bytes, such as a file's name may have, are written as escapes."""
    return "".join(
        letter if letter.isprintable() or letter == "\n" else letter.encode("unicode_escape").decode()
        for letter in text
    )


def shortened(value: object, longest: int = LONGEST_WORD) -> str:
    """Return the text of a value, such as a path that a user gave, of at most `longest` letters: of longer ones both ends."""
    text = str(value)
    half = (longest - 3) // 2
    return text if len(text) <= longest else f"{text[:half]}...{text[-half:]}"


def quoted(value: object) -> str:
    """Return the representation of a value that a user gave, of any kind and size, shortened and on one line."""
    try:
        return shortened(" ".join(_SHORT.repr(value).split()))
    except ValueError:  # Python's own refusal
        return "a number of thousands of digits"


def is_finite(value: object) -> bool:
    """Return whether a value that a user gave, of any kind, is one finite number."""
    try:
        return isinstance(value, Real) and math.isfinite(value)
    except OverflowError:  # an integer that no float holds
        return False


def _bounded(line: str) -> str:
    """Return a line with what is too long in it shortened; commands, in backquotes, are to be pasted and stay whole."""
    parts = line.split("`")
    parts[::2] = [
        shortened(re.sub(rf"\S{{{LONGEST_WORD + 1},}}", lambda word: shortened(word[0]), part), LONGEST_LINE)
        for part in parts[::2]
    ]
    return "`".join(parts)


def checked_integer(name: str, value: int, least: int, most: int | None = None) -> int:
    """Return `value` as an int; raises `InputError` if it is no integer from `least` on, or beyond `most`."""
    try:
        number = operator.index(value)
    except TypeError:
        number = least - 1
    if number < least:
        raise InputError(f"{name} = {quoted(value)} must be an integer, {least} or more")
    if most is not None and number > most:
        raise InputError(f"{name} = {quoted(number)} must be {most} at most")
    return number


def checked_std(name: str, value: float, largest: float) -> float:
    """Return `value` as a float; raises `InputError` if it is no standard deviation from 0 to `largest` metres."""
    if not is_finite(value) or not 0 <= value <= largest:
        raise InputError(f"{name} = {quoted(value)} must be a standard deviation from 0 to {largest:g} m")
    return float(value)


def with_input_errors(initialize: Callable[..., None]) -> Callable[..., None]:
    """Return the constructor of a pydantic model that raises `InputError` where pydantic refuses a value."""
    from pydantic import ValidationError

    @wraps(initialize)
    def checked(self: BaseModel, /, **values: Any) -> None:
        try:
            initialize(self, **values)
        except ValidationError as error:
            raise InputError(describe_validation(error, type(self))) from None

    # What is within another model, or comes from a file, is made without it: the errors then say where they are.
    checked.__pydantic_base_init__ = True  # type: ignore[attr-defined]
    return checked


def describe_validation(error: ValidationError, model: type[BaseModel] | None = None) -> str:
    """Return one line for the first thing that pydantic found, with the number of further ones.

    With the `model` that refused the values, a line about a wrong key lists the right ones.
    """
    first, *others = error.errors()
    path = shortened(".".join(str(part) for part in first["loc"])) or "the top level"
    message, found = first["msg"].removeprefix("Value error, "), quoted(first["input"])
    keys = ", ".join(_keys(model, first["loc"][:-1] if first["type"] == "extra_forbidden" else first["loc"]))
    if first["type"] == "value_error":  # written by a validator of ours, which names the value itself
        line = message
    elif first["type"] == "extra_forbidden":
        line = f"{path}: unknown key; {f'allowed here: {keys}' if keys else 'remove it or correct its spelling'}"
    elif first["type"] == "missing":
        line = f"{path}: a value is missing, found {found}"
    elif first["type"] == "model_type" and keys:
        line = f"{path}: must map some of these keys to values: {keys}; not {found}"
    else:
        line = f"{path}: {message[0].lower()}{message[1:]}, not {found}"
    return f"{line} (and {len(others)} more)" if others else line


def _keys(model: Any, location: tuple[int | str, ...]) -> list[str]:
    """Return the keys of the group of values at `location` within `model`, none if there is no such group."""
    for part in location:
        field = getattr(model, "model_fields", {}).get(part)
        model = None if field is None else field.annotation
    return list(getattr(model, "model_fields", {}))
