"""Comparisons: errors with their intervals in the order given, the paper's values beside them."""

import numpy as np
import pytest

from wam_cast.visualization.figures.estimator_figures import draw_comparison, draw_polynomials

NAMES = ["kernel ridge", "polynomial", "linear"]
RMSE = np.array([0.002, 0.217, np.nan])


def test_errors_stand_in_order_with_intervals_and_values(axes, line_of, legend_of):
    draw_comparison(axes, NAMES, RMSE, RMSE / 2, RMSE * 2, paper={"polynomial": 0.3, "unknown": 1.0})
    np.testing.assert_allclose(line_of(axes, "test RMSE and interval"), [[0.2, 0], [21.7, 1], [np.nan, 2]])
    np.testing.assert_allclose(line_of(axes, "paper"), [[30, 1]])
    assert [label.get_text() for label in axes.get_yticklabels()] == NAMES
    assert axes.yaxis_inverted()
    assert [text.get_text() for text in axes.texts] == ["0.200 cm", "21.7 cm", "none"]
    intervals = axes.collections[0].get_segments()
    np.testing.assert_allclose(intervals[0], [[0.1, 0], [0.4, 0]])
    assert legend_of(axes) == ["test RMSE and interval", "paper"]


def test_large_values_have_no_stray_point(axes):
    draw_comparison(axes, ["linear"], *[np.array([2.17])] * 3)
    assert [text.get_text() for text in axes.texts] == ["217 cm"]


def test_polynomials_are_drawn_over_whole_degrees(axes, line_of, legend_of, texts_of):
    degrees = np.arange(1, 4)
    curves = {"training": 0.1 / degrees, "validation": 0.2 / degrees, "test": 0.3 / degrees}
    draw_polynomials(axes, degrees, curves, paper=0.217)
    np.testing.assert_allclose(line_of(axes, "test"), np.column_stack([degrees, 30 / degrees]))
    np.testing.assert_allclose(line_of(axes, "paper, test: 21.7 cm"), [[12, 21.7]])
    assert legend_of(axes) == ["training", "validation", "test", "paper, test: 21.7 cm"]
    axes.figure.draw_without_rendering()
    assert all(float(tick).is_integer() for tick in axes.get_xticks())


def test_errors_that_vanish_are_marked_at_the_edge_and_stretch_no_axis(axes, line_of, assert_hides_nothing):
    curves = {"training": np.array([0.1, 0.002, 1e-15, 0.0]), "test": np.array([0.1, 0.01, 0.2, np.nan])}
    draw_polynomials(axes, np.arange(1, 5), curves)
    np.testing.assert_allclose(line_of(axes, "training")[:, 1], [10, 0.2, np.nan, np.nan])
    np.testing.assert_allclose(line_of(axes, "training, below 0.01 cm"), [[3, 0], [4, 0]])
    low, high = axes.get_ylim()
    assert low == pytest.approx(0.01)
    assert 20 < high < 100
    assert_hides_nothing(axes)


def test_axis_is_not_stretched_down_to_where_nothing_is(axes, legend_of):
    draw_polynomials(axes, np.arange(1, 4), {"test": np.array([0.1, 0.02, 0.03])})
    assert axes.get_ylim()[0] > 1
    assert legend_of(axes) == ["test"]
