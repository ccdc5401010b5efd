"""Beliefs about one robot, and its landings: what is drawn where."""

import numpy as np
from matplotlib.patches import Circle

from wam_cast.visualization.figures.adaptation_figures import draw_approach, draw_beliefs

SPEEDS = np.linspace(0.2, 0.8, 4)


def test_a_belief_is_a_mean_in_a_band_of_two_deviations_and_the_truth_is_beside_it(axes, line_of):
    mean, std = 0.01 * SPEEDS, np.full(4, 0.003)
    draw_beliefs(axes, SPEEDS, {"before": (mean, std)}, (SPEEDS[:2], 0.02 * SPEEDS[:2]), xlabel="mean speed [m/s]")
    np.testing.assert_allclose(line_of(axes, "before, ± 2 standard deviations"), np.column_stack([SPEEDS, 1e3 * mean]))
    np.testing.assert_allclose(line_of(axes, "what it does"), np.column_stack([SPEEDS, 20 * SPEEDS])[:2])
    (band,) = axes.collections
    edges = band.get_paths()[0].vertices
    at = np.isclose(edges[:, 0], SPEEDS[2])
    np.testing.assert_allclose(
        [edges[at, 1].min(), edges[at, 1].max()], 1e3 * mean[2] + np.array([-6.0, 6.0]), atol=1e-9
    )


def test_landings_are_numbered_and_all_in_view_and_one_that_never_came_down_is_left_out(axes, line_of, legend_of):
    landings = np.array([[0.06, -0.01], [np.nan, np.nan], [0.004, 0.001]])
    draw_approach(axes, landings, np.array([False, False, True]), cup_radius=0.03)
    np.testing.assert_allclose(line_of(axes, "caught"), [[4.0, 1.0]])
    np.testing.assert_allclose(line_of(axes, "missed")[0], [60.0, -10.0])
    assert [text.get_text() for text in axes.texts] == ["1", "3"]
    (cup,) = [patch for patch in axes.patches if isinstance(patch, Circle)]
    assert cup.radius == 30.0
    assert axes.get_xlim()[1] > 60.0
    assert {"cup", "caught", "missed"} <= set(legend_of(axes))
