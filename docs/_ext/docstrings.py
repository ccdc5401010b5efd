"""Docstrings as they are meant to be read.

Ours are plain text: bars and underscores are themselves, what is indented below a blank line is a formula, and a name in
single backticks is the thing of that name.
"""

import re
import warnings
from typing import Any

from pydantic import BaseModel
from sphinx.util.nodes import make_refnode

LITERAL = re.compile(r"(`+[^`]*`+)")
SPECIAL = re.compile(r"(?<=\w)_(?!\w)|\|")
ARRAY = re.compile(r"[~\w.]*ndarray\[tuple\[[~\w.]*Any, \.\.\.\], [~\w.]*dtype\[[~\w.]*?(\w+)\]\]")
LIKE_AN_ARRAY = re.compile(r"[~\w.]*_Buffer \| .*?_NestedSequence\[complex \| bytes \| str\]")
PORTS = "Ports"
"""A heading of ours that numpydoc does not know."""


def escape(line: str) -> str:
    """Return a line with what means something to reStructuredText taken at its word, but for what is in backticks."""
    pieces = LITERAL.split(line)
    return "".join(piece if i % 2 else SPECIAL.sub(r"\\\g<0>", piece) for i, piece in enumerate(pieces))


def translate(_app: Any, _what: str, name: str, _thing: Any, _options: Any, lines: list[str]) -> None:
    """Rewrite a docstring of ours in place."""
    if not name.startswith("wam_cast"):
        return
    translated: list[str] = []
    formula = indent = 0  # how far the formula, if we are in one, and the last line were indented
    is_after_blank = False
    for line in lines:
        own = len(line) - len(line.lstrip())
        if not line.strip():
            is_after_blank = True
        elif line.strip() == PORTS:
            line = f"**{PORTS}**"
        elif set(line.strip()) == {"-"} and translated[-1] == f"**{PORTS}**":
            line = ""
        elif formula and own >= formula:
            pass
        elif is_after_blank and own > indent:
            formula = own
            translated += [" " * indent + "::", ""]
        else:
            formula, line = 0, escape(line)
        if line.strip():
            is_after_blank = False
            indent = indent if formula else own
        translated.append(line)
    lines[:] = translated


def shorten(_app: Any, what: str, _name: str, thing: Any, _options: Any, signature: str, returns: str) -> Any:
    """Write the types of arrays in a signature in short, and leave a scenario's parts, whose attributes tell all, without one."""
    if what == "class" and issubclass(thing, BaseModel):
        return "", None
    return tuple(
        text and LIKE_AN_ARRAY.sub("ArrayLike", ARRAY.sub(r"NDArray[\1]", text)) for text in (signature, returns)
    )


def skip_inherited(_app: Any, _what: str, name: str, *_details: Any) -> bool | None:
    """Leave out what scikit-learn adds to estimators to route metadata, which ours take none of, and pydantic's settings."""
    return True if re.fullmatch(r"set_\w+_request|model_config", name) else None


def find_by_name(_app: Any, env: Any, node: Any, content: Any) -> Any:
    """Refer from a name in backticks to the one public thing that is called so, wherever it is; any other name stays as it is."""
    if node.get("refdomain") != "py" or node.get("reftype") != "obj":
        return None
    objects = env.get_domain("py").objects
    ending = "." + node["reftarget"]
    found = [name for name in objects if name.endswith(ending)]
    if len(found) != 1:
        return content
    place = objects[found[0]]
    return make_refnode(_app.builder, node["refdoc"], place.docname, place.node_id, content, found[0])


def setup(app: Any) -> dict[str, bool]:
    """Come before numpydoc, which makes what it finds into more of reStructuredText."""
    app.setup_extension("sphinx.ext.autodoc")
    app.connect("autodoc-process-docstring", translate, priority=100)
    app.connect("autodoc-process-signature", shorten)
    app.connect("autodoc-skip-member", skip_inherited)
    app.connect("missing-reference", find_by_name)
    warnings.filterwarnings("ignore", "Unknown section", UserWarning, "numpydoc")  # in docstrings of Drake's
    return {"parallel_read_safe": True}
