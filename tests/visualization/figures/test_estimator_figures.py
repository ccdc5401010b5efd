"""Errors over hyperparameters, training casts and degrees, and comparisons: centimetres on logarithmic axes."""

import numpy as np
import pytest

from wam_cast.visualization.figures.estimator_figures import (
    APART,
    LearningCurve,
    draw_comparison,
    draw_error_curve,
    draw_learning_curves,
    draw_polynomials,
)

# --- error curves

SIGMA = np.array([0.1, 1.0, 10.0])
RMSE_OF_SIGMA = np.array([0.02, 0.002, np.nan])


def test_curves_path_and_marks_are_where_they_belong(axes, line_of, legend_of):
    curves = {"validation": RMSE_OF_SIGMA, "leave-one-out": 2 * RMSE_OF_SIGMA}
    descents = [(np.array([0.5, 0.8]), np.array([0.01, 0.003])), (np.array([3.0, 0.9]), np.array([0.02, 0.004]))]
    chosen = {"leave-one-out": 0.8, "validation": 0.35}
    draw_error_curve(axes, SIGMA, curves, xlabel="σ [1]", descents=descents, chosen=chosen)
    marks = ["chosen by leave-one-out: 0.8", "chosen by validation: 0.35"]
    assert legend_of(axes) == ["validation", "leave-one-out", "descents", *marks]
    np.testing.assert_allclose(line_of(axes, "validation"), np.column_stack([SIGMA, [2, 0.2, np.nan]]))
    np.testing.assert_allclose(line_of(axes, "leave-one-out")[:, 1], [4, 0.4, np.nan])
    np.testing.assert_allclose(line_of(axes, "descents"), [[0.5, 1.0], [0.8, 0.3]])
    np.testing.assert_allclose(line_of(axes, "_"), [[3.0, 2.0], [0.9, 0.4]])
    np.testing.assert_allclose(line_of(axes, marks[0])[:, 0], 0.8)
    np.testing.assert_allclose(line_of(axes, marks[1])[:, 0], 0.35)
    drawn = [line for line in axes.get_legend().get_lines() if line.get_marker() == "None"][-2:]
    assert len({str(line._unscaled_dash_pattern) for line in drawn}) == 2
    assert axes.get_xscale() == axes.get_yscale() == "log"
    assert (axes.get_xlabel(), axes.get_ylabel()) == ("σ [1]", "RMSE [cm]")


def test_marks_are_left_out_unless_given(axes, legend_of):
    draw_error_curve(axes, SIGMA, {"validation": RMSE_OF_SIGMA}, xlabel="σ [1]")
    assert legend_of(axes) == ["validation"]


def test_one_descent_is_called_so_and_the_legend_hides_nothing(axes, line_of, legend_of, assert_hides_nothing):
    draw_error_curve(
        axes,
        SIGMA,
        {"validation": RMSE_OF_SIGMA},
        xlabel="σ [1]",
        descents=[(SIGMA, RMSE_OF_SIGMA)],
        chosen={"validation": 1.0},
    )
    assert legend_of(axes) == ["validation", "descent", "chosen by validation: 1"]
    assert_hides_nothing(axes)


def test_ticks_of_a_few_decades_are_plain_numbers(axes, texts_of):
    draw_error_curve(axes, SIGMA, {"validation": np.array([0.02, 0.002, 0.001])}, xlabel="σ [1]")
    ticks = {text.get_text() for text, _ in texts_of(axes.figure)}
    assert {"0.1", "1", "10", "0.2", "2"} <= ticks


def test_ticks_of_many_decades_are_powers(axes, texts_of):
    draw_error_curve(axes, np.array([1e-12, 1e-6, 1e-1]), {"validation": RMSE_OF_SIGMA}, xlabel="λ [1]")
    assert any("10^{-" in text.get_text() for text, _ in texts_of(axes.figure))


# --- learning curves

N = np.array([25.0, 100.0, 1300.0])
MEDIAN = np.array([np.nan, 0.02, 0.002])


def test_medians_ranges_and_the_papers_value_are_in_centimetres(axes, line_of, legend_of, assert_hides_nothing):
    curves = {
        "kernel ridge": LearningCurve(MEDIAN, MEDIAN / 2, MEDIAN * 2),
        "Gaussian process": LearningCurve(*[MEDIAN] * 3),
        "polynomial": LearningCurve(*[MEDIAN] * 3),
    }
    draw_learning_curves(axes, N, curves, ylabel="validation RMSE [cm]", paper=0.0224)
    shown = [np.nan, 2, 0.2]
    np.testing.assert_allclose(line_of(axes, "kernel ridge"), np.column_stack([N / APART, shown]))
    np.testing.assert_allclose(line_of(axes, "Gaussian process"), np.column_stack([N, shown]))
    np.testing.assert_allclose(line_of(axes, "polynomial"), np.column_stack([N * APART, shown]))
    np.testing.assert_allclose(line_of(axes, "paper, test: 2.24 cm"), [[1300, 2.24]])
    bars = axes.collections[0].get_segments()
    x = 100 / APART, 1300 / APART
    np.testing.assert_allclose(bars[1:], [[[x[0], 1], [x[0], 4]], [[x[1], 0.1], [x[1], 0.4]]])
    assert legend_of(axes) == [*curves, "paper, test: 2.24 cm"]
    assert axes.get_ylabel() == "validation RMSE [cm]"
    assert_hides_nothing(axes)
    assert axes.get_xscale() == axes.get_yscale() == "log"


# --- comparison

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
