"""Drawings of the station's diagram."""

from __future__ import annotations

import subprocess
from pathlib import Path

from wam_cast.errors import InputError
from wam_cast.files import write_file
from wam_cast.system.station import CastStation

FORMATS = (".svg", ".png", ".pdf", ".dot")


def write_graph(station: CastStation, path: str | Path) -> None:
    """Write a drawing of the diagram: its parts, ports and connections.

    Parameters
    ----------
    station
        What is drawn.
    path
        Its suffix chooses the format: .svg, .png and .pdf need Graphviz, .dot is Graphviz's own language.

    Raises
    ------
    InputError
        If the suffix is another, Graphviz is missing, or the file cannot be written.
    """
    path = Path(path)
    suffix = path.suffix.lower()
    if suffix not in FORMATS:
        allowed = ", ".join(FORMATS)
        raise InputError(
            f"cannot write {path}: its suffix is {path.suffix or 'missing'}; choose one of {allowed}"
        )
    text = station.graph()
    if suffix == ".dot":
        write_file(path, text.encode())
        return
    try:
        drawn = subprocess.run(
            ["dot", f"-T{suffix[1:]}"], input=text.encode(), capture_output=True, check=True
        )
    except (OSError, subprocess.CalledProcessError):
        raise InputError(
            f"cannot write {path}: it needs a working `dot`; install Graphviz, or choose a file that ends in .dot"
        ) from None
    write_file(path, drawn.stdout)
