"""What is committed of a notebook: no outputs, nothing of a machine, short cells of plain formatted Python."""

import ast
import json
import subprocess
import sys

import nbformat
import pytest

LONGEST_CELL = 15
"""Lines."""

METADATA = {
    "kernelspec": {"display_name": "Python 3", "language": "python", "name": "python3"},
    "language_info": {"name": "python"},
}

OF_THIS_MACHINE = {"tags": ["remove-output"]}
"""The metadata of a cell that prints what is of no use to readers of the site, such as an address on the machine it runs on."""

TEACHES_A_SYSTEM = ("02_the_diagram", "01_hand_kinematics")
"""The only notebooks with a class: one controller each."""


def complaints_about(name, text):
    """Return what is wrong with the file's `text` of the notebook `name`, a line each."""
    notebook = json.loads(text)
    found = []
    if text != json.dumps(notebook, indent=1, ensure_ascii=False) + "\n":
        found.append("not stored with an indent of 1 and a newline at the end")
    if notebook["metadata"] != METADATA:
        found.append("metadata that are not the plain ones")
    if not is_introduced(notebook["cells"][0]):
        found.append("does not begin with a title and, below it, what it teaches")
    classes = []
    for number, cell in enumerate(notebook["cells"], start=1):
        found += [f"cell {number}: {complaint}" for complaint in complaints_about_cell(cell)]
        if cell["cell_type"] == "code":
            classes += classes_in(cell)
    if classes != (["wc.ArmController"] if name in TEACHES_A_SYSTEM else []):
        found.append(f"classes derived from {classes}")
    return found


def is_introduced(cell):
    """Return whether a cell is a title, an empty line, and at least one sentence."""
    lines = "".join(cell["source"]).split("\n")
    return (
        cell["cell_type"] == "markdown"
        and len(lines) > 2
        and lines[0].startswith("# ")
        and lines[1] == ""
        and "." in lines[2]
    )


def complaints_about_cell(cell):
    if cell["metadata"] not in ({}, OF_THIS_MACHINE):
        yield "metadata"
    if len("".join(cell["source"]).split("\n")) > LONGEST_CELL:
        yield f"longer than {LONGEST_CELL} lines"
    if cell["cell_type"] != "code":
        return
    if cell["outputs"]:
        yield "outputs"
    if cell["execution_count"] is not None:
        yield "an execution count"
    try:
        tree = ast.parse("".join(cell["source"]))
    except SyntaxError:
        yield "not plain Python"
        return
    imports = [node for node in ast.walk(tree) if isinstance(node, ast.Import | ast.ImportFrom)]
    if any(alias.name in ("*", "pydrake.all") for node in imports for alias in node.names):
        yield "imports by other than their names"


def classes_in(cell):
    """Return the bases of the classes that a cell defines, as written."""
    try:
        tree = ast.parse("".join(cell["source"]))
    except SyntaxError:
        return []
    classes = [node for node in ast.walk(tree) if isinstance(node, ast.ClassDef)]
    return [", ".join(map(ast.unparse, node.bases)) for node in classes]


def test_notebooks_are_as_they_should_be(notebook_paths, exercise_paths, committed):
    assert notebook_paths
    assert exercise_paths
    for name, path in [*notebook_paths.items(), *exercise_paths.items()]:
        text = committed(path)
        nbformat.validate(json.loads(text))
        assert complaints_about(name, text) == [], name


def test_ruff_reads_the_notebooks(notebook_paths, exercise_paths):
    folder = next(iter(notebook_paths.values())).parent
    command = [sys.executable, "-m", "ruff", "check", "--show-files", str(folder)]
    shown = subprocess.run(command, capture_output=True, text=True, check=True).stdout.splitlines()
    assert {str(path) for path in [*notebook_paths.values(), *exercise_paths.values()]} <= set(shown)


def test_a_notebook_that_was_run_in_place_is_judged_by_what_is_committed(tmp_path, committed, monkeypatch):
    clone, clean = tmp_path / "clone", stored(code("x = 1"))
    clone.mkdir()
    path = clone / "01.ipynb"
    path.write_text(clean, encoding="utf-8")

    def git(*words):
        subprocess.run(["git", "-C", str(clone), *words], check=True, capture_output=True)

    ran = stored(code("x = 1", execution_count=1, outputs=[{"output_type": "stream", "name": "stdout", "text": "1"}]))
    git("init", "-q")
    git("add", "01.ipynb")
    path.write_text(ran, encoding="utf-8")
    assert committed(path) == clean
    git("add", "01.ipynb")  # what is about to be committed is not spared
    assert complaints_about("01", committed(path)) == ["cell 2: outputs", "cell 2: an execution count"]


def test_without_git_what_running_a_notebook_leaves_in_it_is_no_complaint(tmp_path, committed, monkeypatch):
    monkeypatch.setenv("GIT_CEILING_DIRECTORIES", str(tmp_path.parent))
    path = tmp_path / "01.ipynb"
    ran = code("x = 1", execution_count=1, outputs=[{"output_type": "stream"}], metadata={"execution": {}})
    path.write_text(stored(ran, indent=2, metadata=METADATA | {"vscode": {}}), encoding="utf-8")
    assert committed(path) == stored(code("x = 1"))
    path.write_text(stored(code("from pydrake.all import *", execution_count=1)), encoding="utf-8")
    assert complaints_about("01", committed(path)) == ["cell 2: imports by other than their names"]


TITLE = {"cell_type": "markdown", "id": "title", "metadata": {}, "source": ["# A title\n", "\n", "It teaches."]}


def code(source, **changes):
    cell = {"cell_type": "code", "execution_count": None, "id": "code", "metadata": {}, "outputs": []}
    return cell | {"source": source.splitlines(keepends=True)} | changes


def stored(*cells, indent=1, **changes):
    """Return the file's text of a notebook with a title and `cells`."""
    notebook = {"cells": [TITLE, *cells], "metadata": METADATA, "nbformat": 4, "nbformat_minor": 5}
    return json.dumps(notebook | changes, indent=indent) + "\n"


@pytest.mark.parametrize(
    "text",
    [
        stored(code("x = 1")),
        stored(code("x = 1", metadata=OF_THIS_MACHINE)),
        stored(code("\n".join(["x = 1"] * 15))),
        stored(code("from pydrake.all import RigidTransform, Simulator")),
    ],
)
def test_lint_accepts(text):
    assert complaints_about("01", text) == []


@pytest.mark.parametrize(
    ("text", "complaint"),
    [
        (stored(indent=2), "not stored with an indent of 1 and a newline at the end"),
        (stored()[:-1], "not stored with an indent of 1 and a newline at the end"),
        (stored(metadata=METADATA | {"vscode": {}}), "metadata that are not the plain ones"),
        (stored(cells=[code("x")]), "does not begin with a title and, below it, what it teaches"),
        (stored(cells=[TITLE | {"source": ["# A title"]}]), "does not begin with a title and, below it, what it teaches"),
        (stored(code("x", metadata={"collapsed": False})), "cell 2: metadata"),
        (stored(code("x", metadata={"tags": ["skip-execution"]})), "cell 2: metadata"),
        (stored(code("\n".join(["x = 1"] * 16))), "cell 2: longer than 15 lines"),
        (stored(TITLE | {"source": ["text\n"] * 15 + ["text"]}), "cell 2: longer than 15 lines"),
        (stored(code("x", outputs=[{"output_type": "stream"}])), "cell 2: outputs"),
        (stored(code("x", execution_count=3)), "cell 2: an execution count"),
        (stored(code("%matplotlib widget")), "cell 2: not plain Python"),
        (stored(code("from pydrake.all import *")), "cell 2: imports by other than their names"),
        (stored(code("import pydrake.all")), "cell 2: imports by other than their names"),
        (stored(code("class A(wc.ArmController):\n    pass")), "classes derived from ['wc.ArmController']"),
    ],
)  # fmt: skip
def test_lint_refuses(text, complaint):
    assert complaints_about("01", text) == [complaint]


def test_one_notebook_teaches_one_system():
    system, other = code("class A(wc.ArmController):\n    pass"), code("class B:\n    pass")
    for name in TEACHES_A_SYSTEM:
        assert complaints_about(name, stored(system)) == []
        assert complaints_about(name, stored(system, system)) != []
        assert complaints_about(name, stored(other)) != []
        assert complaints_about(name, stored()) != []
