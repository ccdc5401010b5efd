"""Where the notebooks are, and a kernel to run them in."""

import copy
import gc
import json
import os
import subprocess
import sys
from pathlib import Path

import nbformat
import pytest
from jupyter_client.kernelspec import KernelSpec
from jupyter_client.manager import AsyncKernelManager
from nbclient import NotebookClient

NOTEBOOKS = Path(__file__).parents[2] / "notebooks"

SETUP = """
import warnings

from pydrake.common.deprecation import DrakeDeprecationWarning

warnings.simplefilter("error", DrakeDeprecationWarning)
"""
"""Runs before a notebook. PYTHONWARNINGS could not name a class of pydrake: it is read before packages can be imported."""

TIMEOUT = 180
"""For one cell [s]; machines that run tests are often busy."""


class ThisPython(AsyncKernelManager):
    """Starts kernels of the Python that runs the tests, whatever kernels are installed for whom."""

    kernel_spec = KernelSpec(
        argv=[sys.executable, "-m", "ipykernel_launcher", "-f", "{connection_file}"],
        display_name="Python 3",
        language="python",
    )


def ours_in(folder):
    """Return the project's notebooks in a folder, by name: those that git knows, or all where there is no git."""
    listed = subprocess.run(["git", "ls-files", "*.ipynb"], cwd=folder, capture_output=True, text=True, check=False)
    known = listed.stdout.split() if listed.returncode == 0 and listed.stdout else None
    return {path.stem: path for path in sorted(folder.glob("*.ipynb")) if known is None or path.name in known}


@pytest.fixture(scope="session")
def notebook_paths():
    return ours_in(NOTEBOOKS)


@pytest.fixture(scope="session")
def exercise_paths():
    return ours_in(NOTEBOOKS / "exercises")


@pytest.fixture(scope="session")
def committed():
    """Return a function that gives a notebook's text as it is committed, or about to be; a reader may have run the file in place.

    Without git it is the file's, without what running it leaves there.
    """

    def text_of(path):
        command = ["git", "show", f":./{path.name}"]
        shown = subprocess.run(command, cwd=path.parent, capture_output=True, text=True, encoding="utf-8", check=False)
        return shown.stdout if shown.returncode == 0 else not_run(path.read_text(encoding="utf-8"))

    return text_of


def not_run(text):
    """Return a notebook's text without outputs, counts and metadata, as it would be stored."""
    notebook = json.loads(text)
    notebook["metadata"] = {
        "kernelspec": {"display_name": "Python 3", "language": "python", "name": "python3"},
        "language_info": {"name": "python"},
    }
    for cell in notebook["cells"]:
        cell["metadata"] = {key: cell["metadata"][key] for key in ("tags",) if key in cell["metadata"]}
        if cell["cell_type"] == "code":
            cell |= {"outputs": [], "execution_count": None}
    return json.dumps(notebook, indent=1, ensure_ascii=False) + "\n"


@pytest.fixture
def run_notebook(tmp_path):
    """Return a function that runs a notebook in an empty directory, then code after it, and returns what was executed."""
    environment = {name: value for name, value in os.environ.items() if name not in FORGOTTEN}
    environment["IPYTHONDIR"] = str(tmp_path / "ipython")  # nobody's startup files
    (tmp_path / "work").mkdir()

    def run(notebook, after=()):
        executed = copy.deepcopy(notebook)
        executed.cells.insert(0, nbformat.v4.new_code_cell(SETUP))
        executed.cells.extend(nbformat.v4.new_code_cell(code) for code in after)
        client = NotebookClient(
            executed,
            kernel_manager_class=ThisPython,
            resources={"metadata": {"path": str(tmp_path / "work")}},
            timeout=TIMEOUT,
        )
        # What widgets capture would be lost to the tests; and nbclient, answering them, can miss the end of a cell.
        client.comm_open_handlers = {}
        gc.collect()  # a thread of the client would not do for other tests' Meshcats, which must end where they began
        client.execute(env=environment)
        return executed

    return run


FORGOTTEN = ("PYTEST_CURRENT_TEST", "MPLBACKEND")
"""Variables that a kernel does not inherit: under the first it would not show what C++ writes to the standard error."""
