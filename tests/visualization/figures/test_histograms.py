"""Histograms count every cast once, in the unit that they name."""

import numpy as np

from wam_cast.learning.reference import reference_dataset
from wam_cast.visualization.figures.histograms import draw_histogram


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
