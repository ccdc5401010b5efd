"""Histograms, parity, residuals and calibration: every cast is drawn as it is, in the unit that the axis names."""

import numpy as np
import pytest

from wam_cast.learning.reference import reference_dataset
from wam_cast.visualization.figures.model_figures import (
    draw_calibration,
    draw_errors,
    draw_histogram,
    draw_parity,
    draw_residual_map,
    draw_residuals,
    draw_shortest_move,
)

# --- histograms


def test_every_cast_is_counted_in_the_unit_shown(axes):
    data = reference_dataset()
    bounds = data.scenario.bounds.distance
    draw_histogram(axes, data.frame["distance"].to_numpy(), label="distance [cm]", scale=100, bounds=bounds)
    assert sum(bar.get_height() for bar in axes.patches) == len(data)
    edges = [bar.get_x() for bar in axes.patches]
    np.testing.assert_allclose([edges[0], edges[-1] + axes.patches[-1].get_width()], [5, 40])
    np.testing.assert_allclose([line.get_xdata()[0] for line in axes.lines], [5, 40])
    assert axes.get_xlabel() == "distance [cm]"


def test_bins_hold_what_is_in_them(axes):
    draw_histogram(axes, np.array([0.0, 0.01, 0.5, 1.0]), label="wait [s]")
    heights = {round(bar.get_x(), 2): bar.get_height() for bar in axes.patches if bar.get_height()}
    assert heights == {0.0: 2, 0.5: 1, 0.95: 1}


def test_values_beyond_the_bounds_are_shown(axes):
    draw_histogram(axes, np.array([0.5, 3.0]), label="wait [s]", bounds=(0.0, 1.0))
    assert sum(bar.get_height() for bar in axes.patches) == 2


def test_casts_without_a_value_are_counted_in_the_legend(axes, legend_of):
    draw_histogram(axes, np.array([0.5, np.nan, np.nan]), label="landing [m]", bounds=(0.0, 1.0))
    assert legend_of(axes) == ["bounds", "2 of 3 casts have no value"]


# --- parity

MEASURED = np.array([0.3, 0.5, np.nan, 0.9])
PREDICTED = np.array([0.31, 0.5, 0.6, 0.88])


def test_parity_is_square_and_holds_all_casts(axes, line_of):
    draw_parity(axes, MEASURED, PREDICTED)
    np.testing.assert_array_equal(line_of(axes, "casts"), np.column_stack([MEASURED, PREDICTED]))
    assert axes.get_xlim() == axes.get_ylim()
    assert axes.get_xlim()[0] < 0.3 < 0.9 < axes.get_xlim()[1]
    assert axes.get_aspect() == 1


def test_residuals_are_in_millimetres(axes, line_of):
    draw_residuals(axes, PREDICTED, PREDICTED - MEASURED)
    np.testing.assert_allclose(line_of(axes, "casts")[:, 1], [10, 0, np.nan, -20], atol=1e-9)
    assert axes.get_ylabel() == "residual [mm]"


# --- where wrong

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
    draw_shortest_move(residual_map, 0.2)
    distance, speed = line_of(residual_map, "move lasts 200 ms").T
    np.testing.assert_allclose(distance, 0.2 * speed)
    assert (residual_map.get_xlim(), residual_map.get_ylim()) == limits
    assert legend_of(residual_map) == ["never landed", "move lasts 200 ms"]


# --- calibration


def test_coverage_is_in_per_cent_beside_the_diagonal(axes, line_of, legend_of):
    draw_calibration(axes, np.array([0.5, 0.95]), {"test": np.array([0.6, 0.9]), "scaled": np.array([0.5, np.nan])})
    np.testing.assert_allclose(line_of(axes, "test"), [[50, 60], [95, 90]])
    np.testing.assert_allclose(line_of(axes, "calibrated"), [[0, 0], [100, 100]])
    assert legend_of(axes) == ["calibrated", "test", "scaled"]
    assert axes.get_xlim() == axes.get_ylim() == (0, 100)
    assert axes.get_aspect() == 1


def test_errors_stand_over_their_standard_deviations_beside_lines_of_one_and_two(
    axes, line_of, legend_of, assert_reads_well, assert_hides_nothing
):
    draw_errors(axes, np.array([0.0002, 0.001, 0.005]), np.array([-0.0001, 0.003, -0.004]))
    np.testing.assert_allclose(line_of(axes, "casts"), [[0.2, 0.1], [1, 3], [5, 4]])
    assert legend_of(axes) == ["casts", "1 standard deviation", "2 standard deviations"]
    for number, line in enumerate(axes.lines[1:], start=1):
        x, y = np.array([line.get_xy1(), line.get_xy2()]).T
        np.testing.assert_allclose(y, number * x)
    assert axes.get_xscale() == axes.get_yscale() == "log"
    assert_reads_well(axes.figure)
    assert_hides_nothing(axes)
