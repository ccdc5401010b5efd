"""Pages that are made from the code hold all of it, so that they cannot lag behind."""

import json
import re
from pathlib import Path

import pytest
import typer

import wam_cast as wc
from wam_cast.cli.commands import app

ROOT = Path(__file__).parents[2]
PACKAGE = Path(wc.__file__).parent
pytestmark = pytest.mark.slow


@pytest.fixture(scope="module")
def pages(extension):
    """Return the module that writes the pages; it is none of the package's."""
    return extension("generated_pages")


def test_every_command_and_option_is_on_the_command_lines_page(pages):
    sections = pages.command_line_page().split("\n## ")
    commands = typer.main.get_command(app).commands
    assert [section.removeprefix("## ").split("\n")[0] for section in sections] == list(commands)
    for section, command in zip(sections, commands.values(), strict=True):
        for parameter in command.params:
            if parameter.name != "help":
                assert (parameter.opts[0] if parameter.opts[0][0] == "-" else parameter.metavar) in section


def test_every_module_is_in_the_reference_once(pages):
    listed = [name for _, folders in pages.LAYERS.values() for folder in folders for name in pages.modules_in(folder)]
    files = [path.relative_to(PACKAGE).with_suffix("") for path in PACKAGE.rglob("[!_]*.py")]
    expected = [".".join(["wam_cast", *file.parts]) for file in files if file.parts[0] != "cli"]
    assert sorted(listed) == sorted(expected)


def test_every_page_of_the_reference_is_in_its_contents_in_order(pages):
    page = (ROOT / "docs" / "reference.md").read_text(encoding="utf-8")
    assert re.findall(r"^reference/(\w+)$", page, re.MULTILINE) == list(pages.LAYERS)


def test_every_public_name_is_in_the_table_with_what_it_is(pages):
    rows = [row for row in pages.public_names().splitlines() if row.startswith("| {py:")]
    assert len(rows) == len(wc.__all__) - 1  # all but the version
    assert all(row.split(" | ")[1].removesuffix(" |").strip().endswith(".") for row in rows)


def test_notebooks_are_copied_with_their_links_and_go_when_they_are_gone(pages, tmp_path):
    source, target = tmp_path / "notebooks", tmp_path / "docs" / "notebooks"
    source.mkdir()
    cell = {"cell_type": "markdown", "source": ["[why](../docs/planning.md#time) [on](02.ipynb)"]}
    (source / "01.ipynb").write_text(json.dumps({"cells": [cell]}))
    pages.copy_notebooks(source, target)
    assert "[why](../planning.md#time) [on](02.ipynb)" in (target / "01.ipynb").read_text()
    stamp = (target / "01.ipynb").stat().st_mtime_ns
    pages.copy_notebooks(source, target)
    assert (target / "01.ipynb").stat().st_mtime_ns == stamp, "what did not change is not read again"
    (source / "01.ipynb").unlink()
    pages.copy_notebooks(source, target)
    assert list(target.iterdir()) == []
