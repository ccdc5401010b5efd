"""PythonSystem: the base of the blocks here that have no state of their own which changes continuously."""

from __future__ import annotations

from pydrake.systems.framework import Context, ContinuousState, LeafSystem


class PythonSystem(LeafSystem):
    """A LeafSystem without continuous state that says so.

    Drake asks every block for its derivatives at every evaluation of the integrator. Where a Python class has no answer, the
    bindings find that out by a C++ exception each time, which takes a fifth of a cast's time.
    """

    def DoCalcTimeDerivatives(self, context: Context, derivatives: ContinuousState) -> None:
        """Leave `derivatives`, of which there are none; a subclass with continuous state overrides this."""
