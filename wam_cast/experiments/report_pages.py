"""A report's pages: `results.json`, Markdown from a template, and one HTML page with the figures inside."""

from __future__ import annotations

import base64
import html
import json
import math
import re
from collections.abc import Callable
from itertools import chain, count, pairwise
from pathlib import Path

from jinja2 import Environment, FileSystemLoader, StrictUndefined
from markdown_it import MarkdownIt
from markdown_it.token import Token

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
    """Return one page with all of the report in it, its figures and a table of contents included; `folder` has the figures."""
    # Links to files beside the page would break when it is moved.
    markdown = re.sub(r" \(\[PDF\]\([^)]*\)\)", "", markdown).replace("[results.json](results.json)", "`results.json`")
    parser = MarkdownIt("commonmark").enable("table")
    tokens = parser.parse(markdown)
    contents = _contents(tokens)
    title_html, end, rest = parser.renderer.render(tokens, parser.options, {}).partition("</h1>\n")
    body = title_html + end + contents + rest
    body = re.sub(r'(?<=src=")figures/[^"]+\.png(?=")', lambda match: _data_uri(folder / match[0]), body)
    title = markdown.splitlines()[0].lstrip("# ")
    return (
        f'<!doctype html>\n<html lang="en">\n<head>\n<meta charset="utf-8">\n<title>{title}</title>\n'
        f'<meta name="viewport" content="width=device-width, initial-scale=1">\n<style>{_STYLE}</style>\n'
        f"</head>\n<body>\n{body}</body>\n</html>\n"
    )


def _contents(tokens: list[Token]) -> str:
    """Return a table of contents, a link for each heading below the title, and give these headings what the links lead to."""
    links, taken = [], set[str]()
    for opening, inline in pairwise(tokens):
        if opening.type != "heading_open" or opening.tag not in ("h2", "h3"):
            continue
        words = inline.content.replace("`", "")
        slug = re.sub(r"\W+", "-", words.lower()).strip("-")
        anchor = next(name for name in chain([slug], (f"{slug}-{n}" for n in count(2))) if name not in taken)
        taken.add(anchor)
        opening.attrSet("id", anchor)
        links.append(f'<li class="{opening.tag}"><a href="#{anchor}">{html.escape(words)}</a></li>')
    if not links:
        return ""
    return (
        "<nav>\n<details open>\n<summary>Contents</summary>\n<ul>\n"
        + "\n".join(links)
        + "\n</ul>\n</details>\n</nav>\n"
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
code, pre { font-family: ui-monospace, monospace; font-size: 0.92em; background: #f0f3f7; overflow-wrap: anywhere; }
pre { padding: 0.7rem; overflow-x: auto; }
nav { font-size: 0.92em; }
nav ul { list-style: none; margin: 0.4rem 0; padding: 0; columns: 16rem; }
nav .h3 { padding-left: 1.2rem; break-before: avoid; }
nav summary { font-weight: bold; cursor: pointer; }
nav a { color: inherit; text-decoration-color: #b5bbc2; }
@media (min-width: 1300px) {
  body { margin-left: max(19rem, calc(50vw - 30rem)); }
  nav { position: fixed; left: 1.5rem; top: 2rem; width: 15.5rem; max-height: calc(100vh - 4rem); overflow-y: auto; }
  nav ul { columns: 1; }
}
@media print { nav { display: none; } }
"""
