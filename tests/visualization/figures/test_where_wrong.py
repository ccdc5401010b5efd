"""The map of residuals: the worst are the largest, the darkest and on top."""

import numpy as np
import pytest

from wam_cast.visualization.figures.model_figures import draw_residual_map, draw_shortest_move

X = np.array([0.1, 0.2, 0.3, 0.4])
Y = np.array([0.5, 0.6, 0.7, 0.8])
RESIDUALS = np.array([-0.02, 0.0001, np.nan, 0.002])


@pytest.fixture
def residual_map(axes):
    draw_residual_map(axes, X, Y, RESIDUALS, xlabel="distance [m]", ylabel="speed [m/s]")
    return axes


def test_the_worst_are_on_top_the_largest_and_the_darkest(residual_map):
    (dots,) = residual_map.collections
    np.testing.assert_allclose(dots.get_offsets(), [[0.2, 0.6], [0.4, 0.8], [0.1, 0.5]])
    np.testing.assert_allclose(dots.get_array(), [0.1, 2, 20])
    assert np.all(np.diff(dots.get_sizes()) > 0)
    # A tenth of the worst residual is told from it by its size alone; 1600 casts do not cover each other.
    assert dots.get_sizes()[1] < dots.get_sizes()[2] / 2
    assert dots.get_sizes()[2] <= 40
    dots.update_scalarmappable()
    assert np.all(np.diff(dots.get_facecolors()[:, :3] @ [0.299, 0.587, 0.114]) < 0)


def test_colour_bar_is_in_millimetres_beside_the_axes(residual_map):
    axes, bar = residual_map.figure.axes
    assert bar.get_ylabel() == "|residual| [mm]"
    assert bar.get_yscale() == "log"
    residual_map.figure.draw_without_rendering()
    assert bar.get_position().x0 > axes.get_position().x1


def test_casts_that_never_landed_are_crosses(residual_map, line_of, legend_of):
    np.testing.assert_array_equal(line_of(residual_map, "never landed"), [[0.3, 0.7]])
    assert "never landed" in legend_of(residual_map)


def test_shortest_move_is_a_line_through_the_origin_that_changes_no_limits(residual_map, line_of, legend_of):
    limits = residual_map.get_xlim(), residual_map.get_ylim()
    draw_shortest_move(residual_map, 0.2, scale=100)
    distance, speed = line_of(residual_map, "move lasts 200 ms").T
    np.testing.assert_allclose(distance, 100 * 0.2 * speed)
    assert (residual_map.get_xlim(), residual_map.get_ylim()) == limits
    assert legend_of(residual_map) == ["never landed", "move lasts 200 ms"]
