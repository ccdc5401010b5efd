"""The tree beside a page has titles and the pages below them, without what stands on those pages."""

from types import SimpleNamespace

import pytest

addnodes = pytest.importorskip("sphinx.addnodes")
nodes = pytest.importorskip("docutils.nodes")


@pytest.fixture
def navigation(extension):
    return extension("navigation")


def entry(title, *below):
    """Return an entry of a table of contents."""
    shown = addnodes.compact_paragraph("", "", nodes.reference("", title))
    return nodes.list_item("", shown, *([nodes.bullet_list("", *below)] if below else []))


def table():
    leads = addnodes.toctree(entries=[(None, "planning")])
    page = nodes.bullet_list("", entry("Page", entry("Heading", entry("function")), entry("More", leads)))
    return {"page": page, "leaf": nodes.bullet_list("", entry("Leaf", entry("Heading")))}


def test_titles_and_pages_stay_and_headings_go(navigation):
    tocs = table()
    page, leaf = (navigation.titles(toc) for toc in tocs.values())
    assert (page.astext().split(), leaf.astext().split()) == (["Page"], ["Leaf"])
    assert len(leaf.children[0]) == 1
    assert [one["entries"] for one in page.findall(addnodes.toctree)] == [[(None, "planning")]]
    assert tocs["page"].astext().split() == ["Page", "Heading", "function", "More"]


def test_only_who_asks_for_titles_gets_them(navigation):
    tocs, connected = table(), []
    env = SimpleNamespace(tocs=tocs)
    app = SimpleNamespace(env=env, connect=lambda _event, handler, priority: connected.append((handler, priority)))
    navigation.setup(app)
    ((handler, priority),) = connected
    assert priority < 500
    context = {"toctree": lambda **_: env.tocs["page"].astext()}
    handler(app, "page", "page.html", context, None)
    assert context["toctree"](titles_only=True).split() == ["Page"]
    assert context["toctree"](titles_only=False).split() == ["Page", "Heading", "function", "More"]
    assert env.tocs is tocs
