"""Start processes that do not import the main module.

A process that multiprocessing spawns imports the script, or module, that runs as `__main__` first. That starts an unguarded
script's work again, and fails where there is nothing to import: at a prompt, or from standard input. joblib's loky does without
too, but its processes outlive a parent that was killed.
"""

from __future__ import annotations

import sys
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from multiprocessing import spawn
from pathlib import Path
from types import ModuleType
from typing import Any

_lock = threading.Lock()


def can_be_imported() -> bool:
    """Return whether there is a main module to import: nothing that was typed, or came from standard input."""
    main = _main()
    return main.__spec__ is not None or Path(getattr(main, "__file__", None) or "<stdin>").is_file()


def _main() -> ModuleType:
    """Return the main module, with the `__spec__` that multiprocessing asks for: IPython's `%reset` takes it away."""
    main = sys.modules["__main__"]
    vars(main).setdefault("__spec__", None)
    return main


@contextmanager
def without_main() -> Iterator[None]:
    """Give a context in which processes that this thread spawns do not import the main module."""
    untyped: Any = spawn
    starter = threading.get_ident()
    _main()

    def prepare(name: str) -> dict[str, Any]:
        data: dict[str, Any] = prepare_with_main(name)
        if threading.get_ident() == starter:
            data = {key: value for key, value in data.items() if not key.startswith("init_main_from")}
        return data

    with _lock:
        prepare_with_main = untyped.get_preparation_data
        untyped.get_preparation_data = prepare
        try:
            yield
        finally:
            untyped.get_preparation_data = prepare_with_main
