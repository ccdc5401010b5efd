"""Names that were changed: the old one works on for one minor release, and says so."""

from __future__ import annotations

import warnings
from typing import Any


def renamed(old: str, new: str) -> Any:
    """Return a property that is the attribute `new` under its `old` name, with a `DeprecationWarning`."""

    def get(instance: object) -> Any:
        warnings.warn(f"{type(instance).__name__}.{old} is now {new}", DeprecationWarning, stacklevel=2)
        return getattr(instance, new)

    return property(get, doc=f"Deprecated: it is `{new}` now.")
