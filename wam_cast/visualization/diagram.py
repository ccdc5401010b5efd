"""Drawings of the station's diagram."""

from __future__ import annotations

import subprocess
from pathlib import Path
from shutil import which

from wam_cast.errors import InputError
from wam_cast.robot.station import CastStation
from wam_cast.storage.atomic import write_file
from wam_cast.visualization.picture_files import check_picture, picture_format

FORMATS = ("svg", "png", "pdf", "dot")


def write_graph(station: CastStation, path: str | Path) -> None:
    """Write a drawing of the diagram: its parts, ports and connections.

    The suffix of `path` chooses the format: .svg, .png and .pdf need Graphviz, .dot is Graphviz's own language.

    Raises
    ------
    InputError
        If the suffix is another, Graphviz is missing, or the file cannot be written.
    """
    check_graph(path)
    drawing_format = picture_format(path, FORMATS)
    text = station.graph()
    if drawing_format == "dot":
        write_file(path, text.encode())
        return
    try:
        drawn = subprocess.run(["dot", f"-T{drawing_format}"], input=text.encode(), capture_output=True, check=True)
    except (OSError, subprocess.CalledProcessError):
        raise _without_graphviz(path) from None
    write_file(path, drawn.stdout)


def check_graph(path: str | Path) -> None:
    """Raise `.InputError` if `write_graph` could not write to `path`; for asking before a station is built."""
    check_picture(path, FORMATS)
    if picture_format(path, FORMATS) != "dot" and which("dot") is None:
        raise _without_graphviz(path)


def _without_graphviz(path: str | Path) -> InputError:
    return InputError(
        f"cannot write {path}: it needs a working `dot`; install Graphviz, or choose a file that ends in .dot"
    )
