"""Performance: offsets in millimetres, each failure by its own marker, and none of the casts left out."""

import numpy as np
import pytest

from wam_cast.simulation.outcome import Status
from wam_cast.visualization.figures.execution_figures import MARKERS, draw_miss_distribution, draw_performance

CUPS = np.array([0.3, 0.5, 0.7, 0.9])
PREDICTED = np.array([0.001, -0.002, 0.02, 0.0])
EXECUTED = np.array([0.002, -0.001, 0.05, np.nan])
STATUSES = ["caught", "caught", "rim_bounce", "never_crossed"]


@pytest.fixture
def performance(axes):
    draw_performance(
        axes, CUPS, PREDICTED, EXECUTED, STATUSES, cup_radius=0.03, ball_radius=0.02, reach=(0.26, 0.98)
    )
    return axes


def test_offsets_are_shown_in_millimetres_by_status(performance, line_of, legend_of):
    np.testing.assert_allclose(line_of(performance, "predicted"), np.column_stack([CUPS, 1000 * PREDICTED]))
    np.testing.assert_allclose(line_of(performance, "caught"), [[0.3, 2], [0.5, -1]])
    np.testing.assert_allclose(line_of(performance, "rim bounce"), [[0.7, 50]])
    labels = {"predicted", "caught", "rim bounce", "never crossed", "reach", "clears the rim"}
    assert labels < set(legend_of(performance))
    np.testing.assert_allclose(line_of(performance, "reach")[:, 0], 0.26)


def test_cast_that_never_landed_is_marked_within_the_axes_at_their_lower_edge(performance):
    (mark,) = [line for line in performance.lines if line.get_marker() == MARKERS[Status.NEVER_CROSSED]][1:]
    performance.figure.draw_without_rendering()
    column, row = mark.get_transform().transform(mark.get_xydata())[0]
    assert performance.transData.inverted().transform((column, row))[0] == pytest.approx(0.9)
    half = (mark.get_markersize() + mark.get_markeredgewidth()) / 2 / 72 * performance.figure.dpi
    bottom, top = performance.get_window_extent().intervaly
    assert bottom < row - half
    assert row + half < bottom + 0.2 * (top - bottom)


def test_label_says_what_is_measured_and_the_legend_hides_nothing(performance, assert_hides_nothing):
    assert performance.get_ylabel().replace("\n", " ") == "signed distance from the cup's middle [mm]"
    performance.figure.set_size_inches(6.3, 3.0)
    assert_hides_nothing(performance)


def test_bands_are_the_cup_and_the_room_that_it_leaves_the_ball(performance):
    bands = {patch.get_label(): patch.get_extents() for patch in performance.patches}
    to_mm = performance.transData.inverted().transform
    for label, half in (("cup's radius", 30), ("clears the rim", 10)):
        box = to_mm(bands[label])
        np.testing.assert_allclose(box[:, 1], [-half, half], atol=1e-6)


def test_every_status_has_a_marker_and_no_two_failures_the_same():
    assert set(MARKERS) == set(Status)
    failures = [marker for status, marker in MARKERS.items() if status not in (Status.CAUGHT, Status.LANDED)]
    assert len(set(failures)) == len(failures)


def test_miss_distribution_counts_those_that_never_landed(axes, line_of):
    draw_miss_distribution(axes, {"program": np.array([0.004, 0.001, np.nan, 0.002])})
    expected = [[1, 0], [1, 25], [2, 50], [4, 75]]
    np.testing.assert_allclose(line_of(axes, "program"), expected)
    assert axes.get_xscale() == "log"
    assert "[mm]" in axes.get_xlabel()
    assert "[%]" in axes.get_ylabel()


def test_axes_take_the_room_that_they_have(performance):
    performance.figure.set_size_inches(6.3, 3.0)
    performance.figure.draw_without_rendering()
    label = performance.yaxis.label.get_window_extent()
    assert label.x0 < 0.02 * performance.figure.bbox.width
