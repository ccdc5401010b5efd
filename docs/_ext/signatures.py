"""Signatures as they are written in the source: autodoc spells the aliases of arrays out."""

import re
from typing import Any

from pydantic import BaseModel

ARRAY = re.compile(r"[~\w.]*ndarray\[tuple\[[~\w.]*Any, \.\.\.\], [~\w.]*dtype\[[~\w.]*?(\w+)\]\]")
LIKE_AN_ARRAY = re.compile(r"[~\w.]*_Buffer \| .*?_NestedSequence\[complex \| bytes \| str\]")


def shorten(_app: Any, what: str, _name: str, thing: Any, _options: Any, signature: str, returns: str) -> Any:
    """Write the types of arrays in short, and leave a scenario's parts, whose attributes tell all, without a signature."""
    if what == "class" and issubclass(thing, BaseModel):
        return "", None
    return tuple(
        text and LIKE_AN_ARRAY.sub("ArrayLike", ARRAY.sub(r"NDArray[\1]", text)) for text in (signature, returns)
    )


def setup(app: Any) -> dict[str, bool]:
    """Connect it."""
    app.setup_extension("sphinx.ext.autodoc")
    app.connect("autodoc-process-signature", shorten)
    return {"parallel_read_safe": True}
