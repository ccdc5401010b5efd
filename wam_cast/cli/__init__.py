"""The command line `wam-cast`."""

from wam_cast.cli.commands import main

__all__ = ["main"]
