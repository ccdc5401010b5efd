"""The one error that a user's own input can cause."""

from __future__ import annotations

from pydantic import ValidationError


class InputError(ValueError):
    """Input that cannot be used: one line that names the value, what is allowed and how to fix it.

    The command line prints it and exits with code 2; from Python it is a `ValueError`.
    """


def describe_validation(error: ValidationError) -> str:
    """Return one line for the first thing that pydantic found, with the number of further ones."""
    first, *others = error.errors()
    path = ".".join(str(part) for part in first["loc"])
    message = first["msg"].removeprefix("Value error, ")
    if first["type"] == "extra_forbidden":
        message = "unknown key; remove it or correct its spelling"
    elif path:
        message = f"{message[0].lower()}{message[1:]}, not {first['input']!r}"
    more = f" (and {len(others)} more)" if others else ""
    return f"{path}: {message}{more}" if path else f"{message}{more}"
