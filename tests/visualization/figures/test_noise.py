"""Landings that noise moved, in millimetres about where they were."""

import numpy as np

from wam_cast.visualization.figures.execution_figures import draw_landing_scatter


def test_deviations_are_in_millimetres_beside_the_room_in_the_cup(
    axes, line_of, legend_of, assert_hides_nothing
):
    along, across = np.array([0.003, 0.0, np.nan]), np.array([-0.004, 0.001, np.nan])
    draw_landing_scatter(axes, along, across, clear_radius=0.01)
    np.testing.assert_allclose(line_of(axes, "casts"), [[3, -4], [0, 1], [np.nan, np.nan]], atol=1e-9)
    (circle,) = axes.patches
    assert circle.get_radius() == 10
    assert circle.get_zorder() > max(line.get_zorder() for line in axes.lines)
    assert legend_of(axes) == ["casts", "clears the rim"]
    assert_hides_nothing(axes)
