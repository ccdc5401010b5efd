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
    if path.suffix not in FORMATS:
        raise InputError(
            f"output {path}: cannot draw {path.suffix or 'without a suffix'}; choose one of {', '.join(FORMATS)}"
        )
    text = station.graph()
    if path.suffix == ".dot":
        write_file(path, text.encode())
        return
    try:
        drawn = subprocess.run(
            ["dot", f"-T{path.suffix[1:]}"], input=text.encode(), stdout=subprocess.PIPE, check=True
        )
    except FileNotFoundError:
        raise InputError(
            f"output {path}: needs the program `dot`; install Graphviz, or choose a file that ends in .dot"
        ) from None
    write_file(path, drawn.stdout)
