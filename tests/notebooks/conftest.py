"""A kernel to run notebooks in."""

import copy
import gc
import os
import sys

import nbformat
import pytest
from jupyter_client.kernelspec import KernelSpec
from jupyter_client.manager import AsyncKernelManager
from nbclient import NotebookClient

SETUP = """
import warnings

from pydrake.common.deprecation import DrakeDeprecationWarning

warnings.simplefilter("error", DrakeDeprecationWarning)
"""
"""Runs before a notebook. PYTHONWARNINGS could not name a class of pydrake: it is read before packages can be imported."""

TIMEOUT = 600
"""For one cell [s]; machines that run tests are often busy."""


class ThisPython(AsyncKernelManager):
    """Starts kernels of the Python that runs the tests, whatever kernels are installed for whom."""

    kernel_spec = KernelSpec(
        argv=[sys.executable, "-m", "ipykernel_launcher", "-f", "{connection_file}"],
        display_name="Python 3",
        language="python",
    )


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
