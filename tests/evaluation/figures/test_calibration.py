"""The reliability diagram: what intervals hold over what they should, in per cent."""

import numpy as np

from wam_cast.evaluation.figures.calibration import draw_calibration


def test_coverage_is_in_per_cent_beside_the_diagonal(axes, line_of, legend_of):
    draw_calibration(
        axes, np.array([0.5, 0.95]), {"test": np.array([0.6, 0.9]), "scaled": np.array([0.5, np.nan])}
    )
    np.testing.assert_allclose(line_of(axes, "test"), [[50, 60], [95, 90]])
    np.testing.assert_allclose(line_of(axes, "calibrated"), [[0, 0], [100, 100]])
    assert legend_of(axes) == ["calibrated", "test", "scaled"]
    assert axes.get_xlim() == axes.get_ylim() == (0, 100)
    assert axes.get_aspect() == 1
