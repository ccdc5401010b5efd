"""The reliability diagram: what intervals hold over what they should, in per cent."""

import numpy as np

from wam_cast.visualization.figures.model_figures import draw_calibration, draw_errors


def test_coverage_is_in_per_cent_beside_the_diagonal(axes, line_of, legend_of):
    draw_calibration(
        axes, np.array([0.5, 0.95]), {"test": np.array([0.6, 0.9]), "scaled": np.array([0.5, np.nan])}
    )
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
