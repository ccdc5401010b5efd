"""Drawings of the station's diagram."""

from __future__ import annotations

from pathlib import Path

import pydot

from wam_cast.errors import InputError
from wam_cast.files import replace_file
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
    with replace_file(path) as temporary:
        if path.suffix == ".dot":
            temporary.write_text(text, encoding="utf-8")
            return
        (drawing,) = pydot.graph_from_dot_data(text)
        try:
            temporary.write_bytes(drawing.create(format=path.suffix[1:]))
        except FileNotFoundError:
            raise InputError(
                f"output {path}: needs the program `dot`; install Graphviz, or choose a file that ends in .dot"
            ) from None
