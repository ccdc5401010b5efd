"""numpydoc as it is, but for its template, which it compiles anew for each docstring: a third of a build went so."""

from pathlib import Path
from typing import Any

import numpydoc.numpydoc
from jinja2 import FileSystemLoader
from jinja2.sandbox import SandboxedEnvironment
from numpydoc.docscrape import get_doc_object
from numpydoc.docscrape_sphinx import SphinxClassDoc, SphinxFunctionDoc, SphinxObjDoc

TEMPLATES = SandboxedEnvironment(loader=FileSystemLoader(Path(numpydoc.__file__).parent / "templates"))

KINDS = {"class_doc": SphinxClassDoc, "func_doc": SphinxFunctionDoc, "obj_doc": SphinxObjDoc}


def read(thing: Any, what: Any = None, doc: Any = None, config: Any = None, builder: Any = None) -> Any:  # noqa: ARG001 - numpydoc gives it
    """Read a docstring; all are written by one template."""
    settings = {**(config or {}), "template": TEMPLATES.get_template("numpydoc_docstring.rst")}
    return get_doc_object(thing, what=what, doc=doc, config=settings, **KINDS)


def setup(app: Any) -> dict[str, bool]:
    """Connect it, but not to signatures: numpydoc looks for them in docstrings, which have none here."""
    metadata: dict[str, bool] = numpydoc.numpydoc.setup(app, get_doc_object_=read)
    for listener in list(app.events.listeners["autodoc-process-signature"]):
        if listener.handler is numpydoc.numpydoc.mangle_signature:
            app.disconnect(listener.id)
    return metadata
