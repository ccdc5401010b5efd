"""Parity and residuals are drawn as they are, in metres and millimetres."""

import numpy as np

from wam_cast.visualization.figures.model_figures import draw_parity, draw_residuals

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
