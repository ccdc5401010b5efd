"""By which name a dataset and a model know the controller of their casts."""

from __future__ import annotations

import operator
import sys
from collections.abc import Callable
from typing import Any

from wam_cast.errors import InputError, quoted

DEFAULT_CONTROLLER = "wam_cast.robot.controller.CastController"
"""What makes the controller where none is given."""


def controller_name(make_controller: Callable[[Any], object] | None = None) -> str:
    """Return the name of what makes controllers from scenarios, such as `my_module.MyController`; by default the package's own.

    It is a class or a function at the top level of a module: worker processes import it, and a dataset remembers its name. What
    stands behind the name is not looked at: after a change of the controller, generate into another directory.

    Raises
    ------
    InputError
        If it cannot be imported by such a name.
    """
    if make_controller is None:
        return DEFAULT_CONTROLLER
    module, path = (getattr(make_controller, name, "") for name in ("__module__", "__qualname__"))
    try:
        found: object = operator.attrgetter(path)(sys.modules[module])
    except (KeyError, AttributeError):
        found = None
    if found is not make_controller:
        raise InputError(
            f"make_controller = {quoted(make_controller)} has no name by which worker processes could import it: "
            "give a class or a function that stands at the top level of a module"
        )
    return f"{module}.{path}"
