"""Docstrings are written as numpydoc writes them, by one template, and none holds a signature, which nobody looks for."""

import inspect

import pytest

import wam_cast as wc

docscrape = pytest.importorskip("numpydoc.docscrape_sphinx")


@pytest.fixture
def read(extension):
    return extension("docstrings").read


@pytest.mark.parametrize(
    ("thing", "what"),
    [
        (wc.simulate_cast, "function"),
        (wc.CastSimulator, "class"),
        (wc.CastSimulator.record, "method"),
        (wc.Cast, "class"),
    ],
)
def test_they_are_numpydocs(read, thing, what):
    settings, lines = {"show_class_members": False}, inspect.getdoc(thing)
    ours = read(thing, what, lines, dict(settings))
    assert str(ours) == str(docscrape.get_doc_object(thing, what, lines, dict(settings)))
    assert lines.split("\n")[0] in str(ours)
    assert ours.template is read(wc.plan_cast, "function", "Plan.", dict(settings)).template
    assert ours["Signature"] == ""
