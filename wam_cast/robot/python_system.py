"""PythonSystem: the base of the blocks here that have no state of their own which changes continuously."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from pydrake.systems.framework import Context, ContinuousState, LeafSystem


class PythonSystem(LeafSystem):
    """A LeafSystem without continuous state that says so.

    Drake asks every block for its derivatives at every evaluation of the integrator. Where a Python class has no answer, the
    bindings find that out by a C++ exception each time, which takes a fifth of a cast's time.

    Attributes
    ----------
    has_events
        Whether it has declared events, periodic ones or others, of which Drake has no list.
    """

    has_events = False

    def DoCalcTimeDerivatives(self, context: Context, derivatives: ContinuousState) -> None:
        """Leave `derivatives`, of which there are none; a subclass with continuous state overrides this."""


def _noting_events(declare: Callable[..., Any]) -> Callable[..., Any]:
    """Return what declares an event, and notes that there is one."""

    def noted(self: PythonSystem, *args: Any, **kwargs: Any) -> Any:
        """Declare an event as Drake does.

        :meta private:
        """
        self.has_events = True
        return declare(self, *args, **kwargs)

    return noted


for _name in dir(LeafSystem):
    # What is forced, nobody calls but by name.
    if _name.startswith("Declare") and _name.endswith("Event") and "Forced" not in _name:
        setattr(PythonSystem, _name, _noting_events(getattr(LeafSystem, _name)))
