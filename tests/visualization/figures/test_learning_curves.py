"""Learning curves: medians and ranges in centimetres, each curve beside the others."""

import numpy as np

from wam_cast.visualization.figures.estimator_figures import APART, LearningCurve, draw_learning_curves

N = np.array([25.0, 100.0, 1300.0])
MEDIAN = np.array([np.nan, 0.02, 0.002])


def test_medians_ranges_and_the_papers_value_are_in_centimetres(
    axes, line_of, legend_of, assert_hides_nothing
):
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
