"""Drawings of the station's diagram."""

import subprocess
from shutil import which

import pytest

from wam_cast.errors import InputError
from wam_cast.robot.station import CastStation
from wam_cast.scenario import Scenario
from wam_cast.visualization.diagram import write_graph

needs_graphviz = pytest.mark.skipif(which("dot") is None, reason="Graphviz is not installed")


@pytest.fixture(scope="module")
def station():
    return CastStation(Scenario(), has_scene=False)


def refused(station, path):
    with pytest.raises(InputError) as caught:
        write_graph(station, path)
    assert "\n" not in str(caught.value)
    assert str(path) in str(caught.value)
    assert not path.exists()
    assert not list(path.parent.glob(".*"))
    return str(caught.value)


@pytest.mark.parametrize("name", ["station.dot", "station.DOT"])
def test_dot_is_the_stations_graph_and_needs_no_graphviz(station, tmp_path, monkeypatch, name):
    monkeypatch.setenv("PATH", "")
    write_graph(station, tmp_path / name)
    text = (tmp_path / name).read_text(encoding="utf-8")
    assert text == station.graph()
    assert text.startswith("digraph")
    for part in ("controller", "plant"):
        assert part in text


@needs_graphviz
@pytest.mark.parametrize(
    ("name", "start"), [("a.svg", b"<?xml"), ("a.png", b"\x89PNG"), ("a.pdf", b"%PDF"), ("a.SVG", b"<?xml")]
)
def test_the_suffix_chooses_the_format(station, tmp_path, name, start):
    write_graph(station, str(tmp_path / name))
    content = (tmp_path / name).read_bytes()
    assert content.startswith(start)
    if start == b"<?xml":
        assert b"controller" in content


@needs_graphviz
def test_what_was_there_is_replaced(station, tmp_path):
    (tmp_path / "a.svg").write_text("before")
    write_graph(station, tmp_path / "a.svg")
    assert b"</svg>" in (tmp_path / "a.svg").read_bytes()
    assert [path.name for path in tmp_path.iterdir()] == ["a.svg"]


@pytest.mark.parametrize(("name", "said"), [("a.jpg", ".jpg"), ("a", "missing"), ("a.svg.gz", ".gz")])
def test_other_suffixes_are_refused_with_the_known_ones(station, tmp_path, name, said):
    line = refused(station, tmp_path / name)
    assert f"its suffix is {said}; choose one of .svg, .png, .pdf, .dot" in line


def test_a_missing_graphviz_is_named(station, tmp_path, monkeypatch):
    monkeypatch.setenv("PATH", "")
    assert "install Graphviz, or choose a file that ends in .dot" in refused(station, tmp_path / "a.svg")


def test_a_graphviz_that_fails_is_named(station, tmp_path, monkeypatch):
    def fail(command, **_):
        raise subprocess.CalledProcessError(1, command)

    monkeypatch.setattr(subprocess, "run", fail)
    assert "install Graphviz" in refused(station, tmp_path / "a.png")


@pytest.mark.parametrize("name", ["a.dot", pytest.param("a.svg", marks=needs_graphviz)])
def test_an_unwritable_folder_is_refused(station, tmp_path, name):
    assert "existing folder" in refused(station, tmp_path / "missing" / name)
