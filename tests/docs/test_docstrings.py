"""Docstrings are written as numpydoc writes them, by one template, and none holds a signature, which nobody looks for."""

import importlib.util
import inspect
from pathlib import Path

import pytest

import wam_cast as wc

docscrape = pytest.importorskip("numpydoc.docscrape_sphinx")
PATH = Path(__file__).parents[2] / "docs" / "_ext" / "docstrings.py"


@pytest.fixture
def read():
    spec = importlib.util.spec_from_file_location("docstrings", PATH)
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module.read


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
