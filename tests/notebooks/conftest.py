"""A kernel to run notebooks in."""

import copy
import gc
import os
import sys

import nbformat
import pytest
from jupyter_client.kernelspec import KernelSpec
from jupyter_client.manager import AsyncKernelManager
from jupyter_core.utils import run_sync
from nbclient import NotebookClient

SETUP = """
import os
import sys
import warnings

from pydrake.common.deprecation import DrakeDeprecationWarning

warnings.simplefilter("error", DrakeDeprecationWarning)
os.chdir({folder!r})
for name in [name for name in sys.modules if name.partition(".")[0] == "wam_cast"]:
    del sys.modules[name]
%reset_selective -f .
"""
"""Runs before a notebook, which then finds no names, an empty folder, and of the package nothing but what it imports itself.

PYTHONWARNINGS could not name a class of pydrake: it is read before packages can be imported.
"""

TIMEOUT = 600
"""For one cell [s]; machines that run tests are often busy."""

FORGOTTEN = ("PYTEST_CURRENT_TEST", "MPLBACKEND")
"""Variables that a kernel does not inherit: under the first it would not show what C++ writes to the standard error."""


class ThisPython(AsyncKernelManager):
    """Starts kernels of the Python that runs the tests, whatever kernels are installed for whom."""

    kernel_spec = KernelSpec(
        argv=[sys.executable, "-m", "ipykernel_launcher", "-f", "{connection_file}"],
        display_name="Python 3",
        language="python",
    )


@pytest.fixture(scope="session")
def kernel(tmp_path_factory):
    """Return the kernel of all notebooks: to start one and to load Drake takes as long as many a notebook."""
    environment = {name: value for name, value in os.environ.items() if name not in FORGOTTEN}
    environment["IPYTHONDIR"] = str(tmp_path_factory.mktemp("ipython"))  # nobody's startup files
    manager = ThisPython()
    run_sync(manager.start_kernel)(env=environment)
    yield manager
    run_sync(manager.shutdown_kernel)(now=True)


@pytest.fixture
def run_notebook(kernel, tmp_path):
    """Return a function that runs a notebook in an empty directory, then code after it, and returns what was executed."""

    def run(notebook, after=()):
        (tmp_path / "work").mkdir(exist_ok=True)
        executed = copy.deepcopy(notebook)
        executed.cells.insert(0, nbformat.v4.new_code_cell(SETUP.format(folder=str(tmp_path / "work"))))
        executed.cells.extend(nbformat.v4.new_code_cell(code) for code in after)
        client = NotebookClient(executed, km=kernel, timeout=TIMEOUT)
        # What widgets capture would be lost to the tests; and nbclient, answering them, can miss the end of a cell.
        client.comm_open_handlers = {}
        gc.collect()  # a thread of the client would not do for other tests' Meshcats, which must end where they began
        try:
            client.execute()
        finally:
            client.kc.stop_channels()
        return executed

    return run
