"""Learning curves: medians and bands in centimetres."""

import numpy as np

from wam_cast.evaluation.figures.learning_curves import LearningCurve, draw_learning_curves

N = np.array([25.0, 100.0, 1300.0])
MEDIAN = np.array([np.nan, 0.02, 0.002])


def test_medians_bands_and_the_papers_value_are_in_centimetres(axes, line_of, legend_of):
    curves = {
        "kernel ridge": LearningCurve(MEDIAN, MEDIAN / 2, MEDIAN * 2),
        "polynomial": LearningCurve(*[MEDIAN] * 3),
    }
    draw_learning_curves(axes, N, curves, paper=0.0224)
    np.testing.assert_allclose(line_of(axes, "kernel ridge"), np.column_stack([N, [np.nan, 2, 0.2]]))
    np.testing.assert_allclose(line_of(axes, "paper: 2.24 cm"), [[1300, 2.24]])
    band = axes.collections[0].get_paths()[0].get_extents()
    np.testing.assert_allclose(band.extents, [100, 0.1, 1300, 4])
    assert legend_of(axes) == ["kernel ridge", "polynomial", "paper: 2.24 cm"]
    assert axes.get_xscale() == axes.get_yscale() == "log"
