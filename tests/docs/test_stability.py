"""What notebooks, README and site import is public: a name of `wam_cast`, or of a module that the page on stability lists."""

import ast
import json
import re
from importlib.util import find_spec
from pathlib import Path

import pytest
from markdown_it import MarkdownIt

import wam_cast as wc

ROOT = Path(__file__).parents[2]
STABILITY = (ROOT / "docs" / "stability.md").read_text(encoding="utf-8")
ROWS = re.findall(r"^\| .*`wam_cast\.\w.*\|$", STABILITY, re.MULTILINE)
MODULES = [module for row in ROWS for module in re.findall(r"`(wam_cast\.[\w.]+)`", row)]
"""A folder among them stands for its modules."""

PAGES = [ROOT / "README.md", *sorted((ROOT / "docs").glob("*.md")), *sorted((ROOT / "docs/howto").glob("*.md"))]


def code_of_page(path):
    """Return the Python in a page's code blocks."""
    text = path.read_text(encoding="utf-8")
    return "\n".join(token.content for token in MarkdownIt().parse(text) if token.info == "python")


@pytest.fixture(scope="module")
def notebooks(notebook_paths, exercise_paths, committed):
    """Return by name the Python in the cells of each notebook, as it is committed."""
    cells = {
        path.name: json.loads(committed(path))["cells"] for path in [*notebook_paths.values(), *exercise_paths.values()]
    }
    return {
        name: "\n".join("".join(cell["source"]) for cell in some if cell["cell_type"] == "code")
        for name, some in cells.items()
    }


def imports_of(code):
    """Return what code imports of ours: pairs of a module and a name of it, or None for the module itself."""
    found = []
    for node in ast.walk(ast.parse(code)):
        if isinstance(node, ast.Import):
            found += [(alias.name, None) for alias in node.names]
        elif isinstance(node, ast.ImportFrom):
            found += [(node.module, alias.name) for alias in node.names]
    return [(module, name) for module, name in found if module.split(".")[0] == "wam_cast"]


def home_of(module):
    """Return the entry of the list that a module belongs to."""
    return next((listed for listed in MODULES if module == listed or module.startswith(f"{listed}.")), None)


def is_public(module, name):
    """Return whether an import is of what the page calls public."""
    if module == "wam_cast":
        return name is None or name in wc.__all__
    return home_of(module) is not None and not (name or "").startswith("_")


@pytest.mark.parametrize("path", PAGES, ids=lambda path: path.relative_to(ROOT).as_posix())
def test_imports_of_pages_are_public(path):
    assert [each for each in imports_of(code_of_page(path)) if not is_public(*each)] == []


def test_imports_of_notebooks_are_public(notebooks):
    assert notebooks
    assert {name: [each for each in imports_of(code) if not is_public(*each)] for name, code in notebooks.items()} == {
        name: [] for name in notebooks
    }


def test_listed_modules_exist_and_are_used(notebooks):
    codes = [*map(code_of_page, PAGES), *notebooks.values()]
    used = {home_of(module) for code in codes for module, _ in imports_of(code)}
    assert [module for module in MODULES if find_spec(module) is None or module not in used] == []


def test_no_module_is_listed_twice():
    assert MODULES
    assert len(set(MODULES)) == len(MODULES)


@pytest.mark.parametrize(
    ("module", "name"), [("wam_cast", "cli"), ("wam_cast.cli", "main"), ("wam_cast.cast", "_bounds"), ("wam_cast.castle", None)]
)  # fmt: skip
def test_what_is_not_public_is_noticed(module, name):
    assert not is_public(module, name)
