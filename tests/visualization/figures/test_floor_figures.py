"""The floor from above and its profiles: everything is drawn where it is, in the right units, and nothing is cut off."""

import math

import numpy as np
import pytest
from matplotlib.collections import PatchCollection
from matplotlib.figure import Figure
from matplotlib.patches import Wedge

import wam_cast as wc
from wam_cast.errors import InputError
from wam_cast.experiments.floor_map import MapSize, map_floor
from wam_cast.experiments.floor_picture import draw_floor_picture, write_floor_picture
from wam_cast.scenario import Noise, Scenario
from wam_cast.visualization.figures.floor_figures import draw_floor, draw_offsets, draw_rim_clear_probability
from wam_cast.visualization.style import figure_style

pytestmark = pytest.mark.slow

RADII, PROBABILITY = np.array([0.2, 0.6, 1.0]), np.array([0.9, 0.5, 0.1])
BEARINGS = (-2.5, 2.5)
CUPS = np.array([[0.2, 0.0], [0.0, 0.6], [0.0, -0.6], [1.0, 0.0]])


@pytest.fixture
def top_view():
    with figure_style():
        figure = Figure(figsize=(4.2, 4.6))
        axes = figure.subplots()
        draw_floor(axes, RADII, PROBABILITY, bearings=BEARINGS, cups=CUPS, share_caught=np.array([1.0, 1.0, 0.5, 0.0]))
        yield axes


@pytest.fixture(params=["clean", "noisy"])
def floor(request, floor_without_physics):
    noise = Noise() if request.param == "clean" else Noise.typical()
    model = wc.reference_model().bound_to(Scenario().model_copy(update={"noise": noise}))
    return map_floor(model, MapSize(5, 4, 2))


# --- from above


def test_rings_have_the_colour_of_their_probability_and_meet_midway(top_view):
    (region,) = [item for item in top_view.collections if isinstance(item, PatchCollection)]
    np.testing.assert_array_equal(region.get_array(), PROBABILITY)
    assert region.get_clim() == (0.0, 1.0)
    # The points between which an arc is drawn may lie a little outside of it.
    extents = [np.linalg.norm(path.to_polygons()[0], axis=1) for path in region.get_paths()]
    ends = [(extent.min(), extent.max()) for extent in extents]
    np.testing.assert_allclose(ends, [(0.2, 0.4), (0.4, 0.8), (0.8, 1.0)], rtol=6e-3)
    for path in region.get_paths():
        bearings = np.arctan2(*path.to_polygons()[0].T[::-1])
        assert bearings.min() == pytest.approx(-2.5)
        assert bearings.max() == pytest.approx(2.5)


def test_the_colours_meaning_is_in_words_with_its_unit(top_view):
    (bar,) = set(top_view.figure.axes) - {top_view}
    assert bar.get_xlabel() == "probability of entering without touching the rim [%]"
    top_view.figure.draw_without_rendering()
    shown = [label.get_text() for label in bar.get_xticklabels()]
    assert (shown[0], shown[-1]) == ("0", "100")


def test_the_blind_sector_is_hatched_and_named(top_view):
    (blind,) = [patch for patch in top_view.patches if isinstance(patch, Wedge)]
    assert blind.get_hatch()
    assert (blind.theta1, blind.theta2) == pytest.approx((math.degrees(2.5), 360 - math.degrees(2.5)))
    assert (blind.r, blind.r - blind.width) == pytest.approx((1.0, 0.2))
    (name,) = [text for text in top_view.texts if "not turn" in text.get_text()]
    x, y = name.get_position()
    assert (math.hypot(x, y) < 1.0, x < 0, y) == (True, True, pytest.approx(0.0, abs=1e-9))
    assert "base axis" in [text.get_text() for text in top_view.texts]


def test_cups_are_marked_by_what_became_of_their_casts(top_view, line_of, legend_of):
    np.testing.assert_array_equal(line_of(top_view, "caught"), CUPS[:2])
    np.testing.assert_array_equal(line_of(top_view, "some caught"), CUPS[2:3])
    np.testing.assert_array_equal(line_of(top_view, "missed"), CUPS[3:])
    assert legend_of(top_view) == ["caught", "some caught", "missed"]


def test_the_floor_is_to_scale_and_all_of_it_in_view(top_view, assert_reads_well, assert_hides_nothing):
    assert top_view.get_aspect() == 1.0
    assert top_view.get_xlim() == top_view.get_ylim()
    assert top_view.get_xlim()[1] > 1.0
    assert_reads_well(top_view.figure)
    assert_hides_nothing(top_view)


# --- profiles


def test_offsets_are_in_millimetres_about_the_prediction(axes, line_of, legend_of):
    cups, executed = np.array([0.2, 0.2, 1.0, 1.0]), np.array([0.001, -0.002, 0.012, np.nan])
    is_caught = np.array([True, True, False, False])
    predicted, spread = np.array([0.001, 0.0, 0.0]), np.array([0.002, 0.003, 0.004])
    draw_offsets(axes, RADII, predicted, spread, cups, executed, is_caught=is_caught, direction="miss along")
    np.testing.assert_allclose(line_of(axes, "predicted"), np.column_stack([RADII, [1, 0, 0]]))
    np.testing.assert_allclose(line_of(axes, "caught"), [[0.2, 1], [0.2, -2]])
    np.testing.assert_allclose(line_of(axes, "missed"), [[1.0, 12], [1.0, np.nan]])
    (band,) = axes.collections
    heights = band.get_paths()[0].vertices[:, 1]
    assert (heights.min(), heights.max()) == pytest.approx((-4.0, 4.0))
    assert axes.get_ylabel() == "miss along [mm]"
    low, high = axes.get_ylim()
    assert low == -high
    assert high > 12


def test_tiny_offsets_are_not_blown_up(axes):
    nothing, tiny = np.zeros(3), np.full(3, 1e-6)
    draw_offsets(axes, RADII, nothing, tiny, RADII, tiny, is_caught=tiny > 0, direction="miss lateral")
    assert axes.get_ylim() == (-1.0, 1.0)


def test_chances_and_rates_are_in_percent_with_their_intervals(axes, line_of, legend_of, assert_reads_well):
    rate = np.array([1.0, 0.5, 0.0])
    draw_rim_clear_probability(axes, RADII, PROBABILITY, rate, np.array([0.7, 0.2, 0.0]), np.array([1.0, 0.8, 0.3]))
    np.testing.assert_allclose(line_of(axes, "rim-clear entry, predicted"), np.column_stack([RADII, [90, 50, 10]]))
    (container,) = axes.containers
    np.testing.assert_allclose(container[0].get_xydata(), np.column_stack([RADII, [100, 50, 0]]))
    (bars,) = container[2]
    ends = [segment[:, 1] for segment in bars.get_segments()]
    np.testing.assert_allclose(ends, [[70, 100], [20, 80], [0, 30]], atol=1e-9)
    assert legend_of(axes) == ["rim-clear entry, predicted", "caught, 95 % interval"]
    assert_reads_well(axes.figure)


# --- the picture


def test_the_picture_shows_all_cups_and_casts_and_reads_well(
    floor, line_of, assert_reads_well, assert_apart, assert_hides_nothing
):
    with figure_style():
        figure = draw_floor_picture(floor)
        assert_reads_well(figure)
        assert_apart(figure)
        top, along, lateral, chances = (axes for axes in figure.axes if axes.lines)
        for axes in (top, along, chances):
            assert_hides_nothing(axes)
            legend = axes.get_legend().get_window_extent()
            assert legend.x1 <= figure.bbox.x1
            assert legend.y1 <= figure.bbox.y1
    assert sum(len(line_of(top, label)) for label in ("caught", "missed")) == 5 * 4
    assert (along.get_ylabel(), lateral.get_ylabel()) == ("miss along [mm]", "miss lateral [mm]")
    for axes, value in ((along, 3.5 if floor.is_noisy else 3.0), (lateral, 2.0)):
        dots = line_of(axes, "caught")
        assert len(dots) == floor.n_caught
        np.testing.assert_allclose(dots[:, 1], value, atol=0.5 * floor.is_noisy * (axes is along) + 1e-9)
    expected = floor.rings[["radius", "rim_clear_probability"]] * [1, 100]
    np.testing.assert_allclose(line_of(chances, "rim-clear entry, predicted"), expected)


@pytest.fixture
def small_map(floor_without_physics):
    return map_floor(wc.reference_model(), MapSize(2, 2))


def test_the_picture_is_written_in_the_format_that_its_name_asks_for(small_map, tmp_path):
    for suffix, start in {"png": b"\x89PNG", "pdf": b"%PDF", "svg": b"<?xml"}.items():
        write_floor_picture(small_map, tmp_path / f"map.{suffix}")
        assert (tmp_path / f"map.{suffix}").read_bytes().startswith(start)


def test_another_format_is_refused(small_map, tmp_path):
    with pytest.raises(InputError, match="choose one of"):
        write_floor_picture(small_map, tmp_path / "map.jpg")
    assert not list(tmp_path.iterdir())
