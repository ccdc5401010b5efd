"""The walks through the code lead to files that are there, few of them, with what a reader is told to look for."""

import re
from pathlib import Path

import pytest

import wam_cast

PACKAGE = Path(wam_cast.__file__).parent
PAGE = (Path(__file__).parents[2] / "docs" / "walks.md").read_text(encoding="utf-8")
WALKS = dict(re.findall(r"^## (.+)\n([^#]+)", PAGE, re.MULTILINE))
MOST_FILES = 8


def files_of(walk):
    """Return the files of a walk, and what its line says of each."""
    return re.findall(r"^\| `(\S+\.py)` \| (.+) \|$", WALKS[walk], re.MULTILINE)


def test_every_walk_is_known():
    assert set(WALKS) == {
        "A cast to its outcome",
        "A dataset to a prediction",
        "A cup to a verdict",
        "A cast over a wire",
    }


@pytest.mark.parametrize("walk", WALKS)
def test_a_walk_is_short(walk):
    files = [file for file, _ in files_of(walk)]
    assert 1 < len(files) == len(set(files)) <= MOST_FILES


@pytest.mark.parametrize(("file", "line"), [pair for walk in WALKS for pair in files_of(walk)])
def test_a_file_of_a_walk_defines_what_to_look_for(file, line):
    text = (PACKAGE / file).read_text(encoding="utf-8")
    names = re.findall(r"`(\w+)`", line)
    assert names
    assert [name for name in names if not re.search(rf"^ *(def|class) {name}\b", text, re.MULTILINE)] == []
