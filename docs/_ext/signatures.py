"""Signatures as they are written in the source: autodoc spells the aliases of arrays and numbers out."""

import re
from typing import Any

from pydantic import BaseModel

ARRAY = re.compile(r"[~\w.]*ndarray\[tuple\[[~\w.]*Any, \.\.\.\], [~\w.]*dtype\[[~\w.]*?(\w+)\]\]")
LIKE_AN_ARRAY = re.compile(r"[~\w.]*_Buffer \| .*?_NestedSequence\[complex \| bytes \| str\]")

CONSTRAINED = re.compile(r"[~\w.]*Annotated\[([~\w.]+(?:\[[^\]]*\])?), (?:FieldInfo\([^\]]*\]\)|[~\w.]+\([^)]*\))\]")
"""A type with what pydantic asks of it, which is for files and messages that may be damaged."""


def shorten(_app: Any, what: str, _name: str, thing: Any, _options: Any, signature: str, returns: str) -> Any:
    """Write types of arrays and checked numbers in short, and leave a scenario's parts, whose attributes tell all, unsigned."""
    if what == "class" and issubclass(thing, BaseModel):
        return "", None
    shortened = []
    for text in (signature, returns):
        for pattern, short in ((ARRAY, r"NDArray[\1]"), (LIKE_AN_ARRAY, "ArrayLike"), (CONSTRAINED, r"\1")):
            text = text and pattern.sub(short, text)
        shortened.append(text)
    return tuple(shortened)


def setup(app: Any) -> dict[str, bool]:
    """Connect it."""
    app.setup_extension("sphinx.ext.autodoc")
    app.connect("autodoc-process-signature", shorten)
    return {"parallel_read_safe": True}
