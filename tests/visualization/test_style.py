"""The style sheet is applied, left again, and makes the same figure the same file, with text as text."""

from contextlib import nullcontext

import matplotlib as mpl
import pytest
from matplotlib.figure import Figure

from wam_cast.visualization.picture_files import write_figure
from wam_cast.visualization.style import STYLE_SHEET, figure_style


def test_style_sheet_is_applied_whatever_the_user_set_and_left_again():
    with mpl.rc_context({"axes.labelsize": 30, "axes.grid": True}):
        before = dict(mpl.rcParams)
        with figure_style():
            assert mpl.rcParams["axes.labelsize"] == 8.5
            assert not mpl.rcParams["axes.grid"]
        assert dict(mpl.rcParams) == before


def test_style_sheet_is_beside_its_module():
    assert STYLE_SHEET.name == "wam_cast.mplstyle"
    assert STYLE_SHEET.is_file()


@pytest.fixture(params=[True, False], ids=["in the style", "in another"])
def make_figure(request):
    def make():
        with figure_style() if request.param else nullcontext():
            figure = Figure(figsize=(3, 2))
            axes = figure.subplots()
            axes.plot([1, 2], [3, 4], label="a curve of σ")
            axes.legend()
        return figure

    return make


@pytest.mark.parametrize("suffix", ["pdf", "png", "svg"])
def test_same_figure_is_the_same_file(suffix, make_figure, tmp_path, monkeypatch):
    for number in range(2):
        monkeypatch.setattr("time.time", lambda now=number: 1e9 + 1e6 * now)
        write_figure(make_figure(), tmp_path / f"{number}.{suffix}")
    content = (tmp_path / f"0.{suffix}").read_bytes()
    assert content == (tmp_path / f"1.{suffix}").read_bytes()
    assert b"CreationDate" not in content
    assert b"dc:date" not in content


def test_text_stays_text(make_figure, tmp_path):
    write_figure(make_figure(), tmp_path / "figure.svg")
    assert ">a curve of σ</text>" in (tmp_path / "figure.svg").read_text(encoding="utf-8")
    write_figure(make_figure(), tmp_path / "figure.pdf")
    content = (tmp_path / "figure.pdf").read_bytes()
    assert b"/FontFile2" in content
    assert b"/Type3" not in content


def test_resolution_is_what_was_asked_for(make_figure, tmp_path):
    for dpi in (50, 100):
        write_figure(make_figure(), tmp_path / f"{dpi}.png", dpi=dpi)
    widths = [int.from_bytes((tmp_path / f"{dpi}.png").read_bytes()[16:20], "big") for dpi in (50, 100)]
    assert widths == [150, 300]
