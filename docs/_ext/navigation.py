"""The tree of pages beside each page, from their titles alone: Sphinx copies all that stands on all pages for it, each time."""

from functools import cache
from typing import Any

from sphinx import addnodes


def titles(toc: Any) -> Any:
    """Return a page's table of contents with its title and, below it, the pages that it leads to."""
    short = toc.deepcopy()
    for entry in short.children:
        if len(entry) > 1:
            entry[1][:] = list(entry.findall(addnodes.toctree))
            if not entry[1].children:
                entry.pop(1)
    return short


def setup(app: Any) -> dict[str, bool]:
    """Let the theme have what it asks for from these."""

    @cache
    def all_titles() -> dict[str, Any]:
        return {page: titles(toc) for page, toc in app.env.tocs.items()}

    def shorten(_app: Any, _page: str, _template: str, context: dict[str, Any], _doctree: Any) -> None:
        from_all = context["toctree"]

        def toctree(**options: Any) -> str:
            if not options.get("titles_only"):
                return from_all(**options)
            whole, app.env.tocs = app.env.tocs, all_titles()
            try:
                return from_all(**options)
            finally:
                app.env.tocs = whole

        context["toctree"] = toctree

    app.connect("html-page-context", shorten, priority=400)  # the theme's own is 500
    return {"parallel_read_safe": True}
