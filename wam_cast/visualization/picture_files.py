"""Pictures in the format that their file's suffix asks for."""

from __future__ import annotations

import io
from pathlib import Path

from matplotlib.figure import Figure

from wam_cast.errors import InputError
from wam_cast.storage.atomic import check_writable, write_file
from wam_cast.visualization.style import storing_style

PICTURE_FORMATS = ("pdf", "png", "svg")
"""By their suffixes."""


def picture_format(path: str | Path, allowed: tuple[str, ...] = PICTURE_FORMATS) -> str:
    """Return which of the `allowed` formats the suffix of `path` asks for.

    Raises
    ------
    InputError
        If it is none of them.
    """
    suffix = Path(path).suffix
    if suffix[1:].lower() not in allowed:
        choice = ", ".join(f".{name}" for name in allowed)
        raise InputError(f"cannot write {path}: its suffix is {suffix or 'missing'}; choose one of {choice}")
    return suffix[1:].lower()


def check_picture(path: str | Path, allowed: tuple[str, ...] = PICTURE_FORMATS) -> None:
    """Raise `.InputError` if a picture could not be written to `path`; for asking before a long computation."""
    picture_format(path, allowed)
    check_writable(path)


NO_DATE = {"pdf": {"CreationDate": None}, "svg": {"Date": None}, "png": {}}
"""Metadata that leave out when a file was written, so that the same figure is the same file."""


def write_figure(figure: Figure, path: str | Path, *, dpi: float = 120) -> None:
    """Write `figure` to `path` as PDF, PNG or SVG by its suffix; what was there before is replaced.

    `dpi` is the resolution of a PNG, and of pictures within the others, in pixels an inch.

    Raises
    ------
    InputError
        If the suffix is another one, or the file cannot be written; then nothing has changed.
    """
    content = io.BytesIO()
    file_format = picture_format(path)
    with storing_style():
        figure.savefig(content, format=file_format, dpi=dpi, metadata=NO_DATE[file_format])
    write_file(path, content.getvalue())
