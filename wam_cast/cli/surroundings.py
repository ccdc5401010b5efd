"""What a user's machine holds for other programs, and the command line does without."""

from __future__ import annotations

import os
from contextlib import chdir
from importlib import import_module
from pathlib import Path


def ignore_matplotlib_settings() -> None:
    """Let matplotlib start from its own defaults: what it finds of a user's settings it may be unable to read, and then fails."""
    os.environ.update(MATPLOTLIBRC=os.devnull, MPLBACKEND="agg")
    if os.path.lexists("matplotlibrc"):  # in this folder: it looks there first
        with chdir(Path(__file__).parent):
            import_module("matplotlib")
