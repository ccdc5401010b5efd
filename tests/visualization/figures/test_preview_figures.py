"""The side view of a scenario: what is drawn where."""

import math

import numpy as np
import pytest
from matplotlib.figure import Figure
from matplotlib.patches import Polygon, Rectangle

from wam_cast.scenario import Scenario
from wam_cast.visualization.figures.preview_figures import SideOfScenario, draw_scenario
from wam_cast.visualization.style import figure_style

START, DOWN = np.array([[0.0, 1.7], [0.1, 0.9], [0.2, 1.2]]), np.array([[0.0, 1.7], [0.3, 0.9], [0.6, 0.75]])


def view_of(**changes):
    table = {
        "cup": {"base_height": 0.4, "rim_height": 0.5},
        "motion": {"start_height": 1.2},
        "arm": {"mount_height": 1.75},
    }
    settings = {
        "scenario": Scenario.from_dict(table),
        "postures": {"arm at the start": START, "arm farthest down": DOWN},
        "hand_radii": (0.25, 0.6),
        "hand_heights": (0.75, 1.2),
        "landings": np.array([0.4, 0.7, 0.9, math.nan]),
        "is_good": np.array([True, True, False, False]),
        "cups": (0.4, 0.7),
        "cup": 0.55,
    }
    return SideOfScenario(**settings | changes)


@pytest.fixture
def draw():
    def drawn(view):
        axes = Figure(figsize=(7.2, 4.4), layout="constrained").subplots()
        draw_scenario(axes, view)
        return axes

    with figure_style():
        yield drawn


def test_all_is_where_it_is_and_named(draw, line_of, legend_of, assert_reads_well, assert_hides_nothing):
    axes = draw(view_of())
    np.testing.assert_array_equal(line_of(axes, "arm at the start"), START)
    np.testing.assert_array_equal(line_of(axes, "arm farthest down"), DOWN)
    np.testing.assert_allclose(line_of(axes, "landing, good for a cup"), [[0.4, 0.5], [0.7, 0.5]])
    np.testing.assert_allclose(line_of(axes, "landing, not good"), [[0.9, 0.5]])
    np.testing.assert_allclose(line_of(axes, "where a cup can stand"), [[0.4, 0.4], [0.7, 0.4]])
    np.testing.assert_allclose(line_of(axes, "string and ball at the start"), [[0.2, 1.2], [0.2, 0.6]])
    assert "where the hand goes down" in legend_of(axes)
    region, stand = [patch.get_bbox() for patch in axes.patches if isinstance(patch, Rectangle)]
    np.testing.assert_allclose(region.extents, [0.25, 0.75, 0.6, 1.2])
    np.testing.assert_allclose(stand.extents, [0.49, 0.0, 0.61, 0.4])
    (cup,) = [patch for patch in axes.patches if isinstance(patch, Polygon)]
    corners = cup.get_xy()
    assert (corners[:, 1].min(), corners[:, 1].max()) == pytest.approx((0.4, 0.5))
    assert corners[:, 0].mean() == pytest.approx(0.55, abs=0.01)
    assert axes.get_aspect() == 1.0
    assert_reads_well(axes.figure)
    assert_hides_nothing(axes)


def test_what_there_is_not_is_not_named(draw, legend_of):
    nowhere = view_of(landings=np.full(4, math.nan), is_good=np.zeros(4, bool), cups=(math.nan, math.nan))
    names = legend_of(draw(nowhere))
    assert not [name for name in names if "landing" in name or "cup" in name]
