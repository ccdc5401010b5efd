"""The errors that users meet: of their own input, and of the machine; and what raises them in many places."""

from __future__ import annotations

import operator
from typing import Any

from pydantic import BaseModel, ValidationError


class InputError(ValueError):
    """Input that cannot be used: one line that names the value, what is allowed and how to fix it.

    The command line prints it and exits with code 2; from Python it is a `ValueError`.
    """


class MachineError(RuntimeError):
    """The machine failed, not the input and not the simulation: one line that says what happened and how to go on.

    The command line prints it and exits with code 2.
    """


def checked_integer(name: str, value: int, least: int) -> int:
    """Return `value` as an int; raises `InputError` if it is no integer from `least` on."""
    try:
        number = operator.index(value)
    except TypeError:
        number = least - 1
    if number < least:
        raise InputError(f"{name} = {value!r} must be an integer, {least} or more")
    return number


def describe_validation(error: ValidationError, model: type[BaseModel] | None = None) -> str:
    """Return one line for the first thing that pydantic found, with the number of further ones.

    With the `model` that refused the values, a line about a wrong key lists the right ones.
    """
    first, *others = error.errors()
    path = ".".join(str(part) for part in first["loc"]) or "the top level"
    message = first["msg"].removeprefix("Value error, ")
    keys = ", ".join(_keys(model, first["loc"][:-1] if first["type"] == "extra_forbidden" else first["loc"]))
    if first["type"] == "value_error":  # written by a validator of ours, which names the value itself
        line = message
    elif first["type"] == "extra_forbidden":
        line = f"{path}: unknown key; {f'allowed here: {keys}' if keys else 'remove it or correct its spelling'}"
    elif first["type"] == "missing":
        line = f"{path}: a value is missing, found {first['input']!r}"
    elif first["type"] == "model_type" and keys:
        line = f"{path}: must map some of these keys to values: {keys}; not {first['input']!r}"
    else:
        line = f"{path}: {message[0].lower()}{message[1:]}, not {first['input']!r}"
    return f"{line} (and {len(others)} more)" if others else line


def _keys(model: Any, location: tuple[int | str, ...]) -> list[str]:
    """Return the keys of the group of values at `location` within `model`, none if there is no such group."""
    for part in location:
        field = getattr(model, "model_fields", {}).get(part)
        model = None if field is None else field.annotation
    return list(getattr(model, "model_fields", {}))
