"""The style sheet is applied, left again, and makes the same figure the same file, with text as text."""

from contextlib import nullcontext

import matplotlib as mpl
import pytest
from matplotlib.figure import Figure

from wam_cast.experiments.floor_map import MapSize, map_floor
from wam_cast.experiments.floor_picture import write_floor_picture
from wam_cast.learning.reference import reference_model
from wam_cast.visualization.film import write_animation
from wam_cast.visualization.film_strip import write_picture
from wam_cast.visualization.picture_files import write_figure
from wam_cast.visualization.style import STYLE_SHEET, figure_style, picture_style


def test_style_sheet_is_applied_whatever_the_user_set_and_left_again():
    with mpl.rc_context({"axes.labelsize": 30, "axes.grid": True}):
        before = dict(mpl.rcParams)
        with figure_style():
            assert mpl.rcParams["axes.labelsize"] == 8.5
            assert not mpl.rcParams["axes.grid"]
        assert dict(mpl.rcParams) == before


USERS = {
    "text.usetex": True,
    "font.size": 30,
    "axes.prop_cycle": mpl.cycler(color=["red"]),
    "savefig.bbox": "tight",
    "image.origin": "lower",
    "lines.dashed_pattern": [9, 9],
}
"""What somebody may have in a `matplotlibrc`, who has no LaTeX."""


@pytest.mark.parametrize("context", [figure_style, picture_style])
def test_figures_start_from_matplotlibs_defaults(context):
    with mpl.rc_context(mpl.rcParamsDefault), context():
        expected = dict(mpl.rcParams)
    with mpl.rc_context(USERS), context():
        assert dict(mpl.rcParams) == expected


@pytest.mark.slow
@pytest.mark.parametrize("name", ["floor.svg", "strip.svg", "film.gif"])
def test_the_users_settings_change_no_picture(tmp_path, name, landed, floor_without_physics, monkeypatch):
    monkeypatch.setattr("wam_cast.visualization.film.FRAME_RATE", 3)  # a few frames are enough
    monkeypatch.setattr("wam_cast.visualization.film_strip.choose_moments", lambda _: [0, 150])

    def write(path):
        if name.startswith("strip"):
            write_picture(landed, path)
        elif name.startswith("film"):
            write_animation(landed, path)
        else:
            write_floor_picture(map_floor(reference_model(), MapSize(2, 2)), path)

    write(tmp_path / name)
    with mpl.rc_context(USERS):
        write(tmp_path / f"2{name}")
    assert (tmp_path / name).read_bytes() == (tmp_path / f"2{name}").read_bytes()


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


@pytest.mark.slow
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
