"""The command line `wam-cast`."""

import sys


def main() -> None:
    """Run the command line; also while its parts are still being loaded, Ctrl-C ends it with code 130 and no traceback."""
    try:
        from wam_cast.cli.entry import run

        run()
    except KeyboardInterrupt:
        print("interrupted", file=sys.stderr)
        sys.exit(130)
