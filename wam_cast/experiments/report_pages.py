"""A report's pages: `results.json`, Markdown from a template, and one HTML page with the figures inside."""

from __future__ import annotations

import base64
import json
import math
import re
from collections.abc import Callable
from pathlib import Path

from jinja2 import Environment, FileSystemLoader, StrictUndefined
from markdown_it import MarkdownIt

from wam_cast.experiments.frames import Record
from wam_cast.storage.atomic import write_file

MISSING = "-"
"""Stands in tables for a value that does not exist."""


def report_environment(folder: Path) -> Environment:
    """Return what renders the Markdown templates in a folder, with filters for millimetres, centimetres and percent."""
    environment = Environment(
        loader=FileSystemLoader(folder),
        undefined=StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
        autoescape=False,  # Markdown, of our own numbers
    )
    environment.filters |= {"cm": _scaled(100, 2), "mm": _scaled(1000, 1), "percent": _percent}
    return environment


def write_pages(results: Record, markdown: str, folder: Path) -> None:
    """Write `results.json`, `report.md` and `report.html` around the figures that are there; what was there before is replaced."""
    text = json.dumps(results, indent=1, allow_nan=False) + "\n"
    write_file(folder / "results.json", text.encode())
    write_file(folder / "report.md", markdown.encode())
    write_file(folder / "report.html", render_html(markdown, folder).encode())


def render_html(markdown: str, folder: Path) -> str:
    """Return one page with all of the report in it, its figures included; they are read from `folder`."""
    # Links to files beside the page would break when it is moved.
    markdown = re.sub(r" \(\[PDF\]\([^)]*\)\)|(?<=\[results\.json\])\(results\.json\)", "", markdown)
    body = MarkdownIt("commonmark").enable("table").render(markdown)
    body = re.sub(r'(?<=src=")figures/[^"]+\.png(?=")', lambda match: _data_uri(folder / match[0]), body)
    title = markdown.splitlines()[0].lstrip("# ")
    return (
        f'<!doctype html>\n<html lang="en">\n<head>\n<meta charset="utf-8">\n<title>{title}</title>\n'
        f'<meta name="viewport" content="width=device-width, initial-scale=1">\n<style>{_STYLE}</style>\n'
        f"</head>\n<body>\n{body}</body>\n</html>\n"
    )


def _scaled(factor: float, digits: int) -> Callable[..., str]:
    def text(value: float | None, digits: int = digits) -> str:
        return MISSING if value is None or math.isnan(value) else f"{factor * value:.{digits}f}"

    return text


def _percent(value: float, digits: int = 0) -> str:
    return MISSING if math.isnan(value) else f"{100 * value:.{digits}f} %"


def _data_uri(path: Path) -> str:
    return f"data:image/png;base64,{base64.b64encode(path.read_bytes()).decode()}"


_STYLE = """
body { font: 16px/1.5 system-ui, sans-serif; color: #26292e; background: #fff; }
body { max-width: 60rem; margin: 2rem auto; padding: 0 1rem; }
h1, h2, h3 { line-height: 1.2; margin-top: 2.2rem; }
table { border-collapse: collapse; margin: 1rem 0; font-size: 0.92em; display: block; overflow-x: auto; }
th, td { padding: 0.3rem 0.7rem; border-bottom: 1px solid #d5d9de; text-align: left; vertical-align: top; }
th { border-bottom: 2px solid #26292e; }
img { max-width: 100%; height: auto; display: block; margin: 1.5rem auto 0.5rem; }
code, pre { font-family: ui-monospace, monospace; font-size: 0.92em; background: #f0f3f7; }
pre { padding: 0.7rem; overflow-x: auto; }
"""
