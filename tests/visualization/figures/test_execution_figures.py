"""Landings about the cup's middle: in millimetres, each failure by its own marker, and none of the casts left out."""

import math

import numpy as np
import pytest
from matplotlib.patches import Ellipse, Polygon

from wam_cast.planning.landing_distribution import clearance, clearance_across
from wam_cast.scenario import Scenario
from wam_cast.simulation.outcome import Status
from wam_cast.visualization.figures.execution_figures import (
    MARKERS,
    draw_landing_scatter,
    draw_miss_distribution,
    draw_performance,
    draw_rim_clear_entry,
)

# --- performance

CUPS = np.array([0.3, 0.5, 0.7, 0.9])
PREDICTED = np.array([0.001, -0.002, 0.02, 0.0])
EXECUTED = np.array([0.002, -0.001, 0.05, np.nan])
STATUSES = ["caught", "caught", "rim_bounce", "never_crossed"]


@pytest.fixture
def performance(axes):
    draw_performance(axes, CUPS, PREDICTED, EXECUTED, STATUSES, cup_radius=0.03, ball_radius=0.02)
    return axes


def test_offsets_are_shown_in_millimetres_by_status(performance, line_of, legend_of):
    np.testing.assert_allclose(line_of(performance, "predicted"), np.column_stack([CUPS, 1000 * PREDICTED]))
    np.testing.assert_allclose(line_of(performance, "caught"), [[0.3, 2], [0.5, -1]])
    np.testing.assert_allclose(line_of(performance, "rim bounce"), [[0.7, 50]])
    labels = {"predicted", "caught", "rim bounce", "never crossed", "clears the rim"}
    assert labels < set(legend_of(performance))


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


# --- noise


def test_deviations_are_in_millimetres_beside_the_room_in_the_cup(axes, line_of, legend_of, assert_hides_nothing):
    along, across = np.array([0.003, 0.0, np.nan]), np.array([-0.004, 0.001, np.nan])
    draw_landing_scatter(axes, along, across, clear_radius=0.01)
    np.testing.assert_allclose(line_of(axes, "casts"), [[3, -4], [0, 1], [np.nan, np.nan]], atol=1e-9)
    (circle,) = axes.patches
    assert circle.get_radius() == 10
    assert circle.get_zorder() > max(line.get_zorder() for line in axes.lines)
    assert legend_of(axes) == ["casts", "clears the rim"]
    assert_hides_nothing(axes)


# --- clear entry

ANGLE = math.radians(30)
CUP, BALL = 0.030, 0.020
SWEPT = (BALL / math.cos(ANGLE), BALL)
ALONG = np.linspace(-0.03, 0.03, 601)
HALF = clearance_across(Scenario(), ANGLE, ALONG)


@pytest.fixture
def entry(axes):
    axes.figure.set_size_inches(3.6, 4.8)
    landings = np.array([0.001, -0.002]), np.array([0.0, 0.003])
    expected = {"std": (0.005, 0.002), "predicted": (-0.009, 0.001)}
    draw_rim_clear_entry(axes, cup_radius=CUP, ball=SWEPT, clear=(ALONG, HALF), **expected, landings=landings)
    return axes


def patch_of(axes, kind, label):
    (patch,) = [one for one in axes.patches if one.get_label() == label]
    assert isinstance(patch, kind)
    return patch


def test_shapes_are_as_large_as_they_are(entry, line_of):
    rim = patch_of(entry, Ellipse, "cup's rim")
    assert (rim.width, rim.height, rim.center) == (pytest.approx(60), pytest.approx(60), (0, 0))
    swept = patch_of(entry, Ellipse, "swept by the ball")
    assert (swept.width, swept.height) == pytest.approx((40 / math.cos(ANGLE), 40))
    spread = patch_of(entry, Ellipse, "2 standard deviations")
    assert (spread.width, spread.height) == pytest.approx((20, 8))
    assert spread.center == pytest.approx((-9, 1))
    assert swept.center == (0, 0)
    np.testing.assert_allclose(line_of(entry, "executed"), [[1, 0], [-2, 3]])
    assert entry.get_aspect() == 1


def test_the_region_is_where_the_swept_ellipse_fits_into_the_cup(entry):
    region = patch_of(entry, Polygon, "landings that clear the rim")
    around = np.linspace(0, 2 * math.pi, 400)
    ellipse = 1e3 * np.column_stack([SWEPT[0] * np.cos(around), SWEPT[1] * np.sin(around)])
    offsets = np.stack(np.meshgrid(np.linspace(-11, 11, 45), np.linspace(-11, 11, 45)), axis=-1).reshape(-1, 2)
    farthest = np.linalg.norm(offsets[:, None] + ellipse, axis=2).max(axis=1)
    clearly = np.abs(farthest - 30) > 0.1  # not on the verge
    inside = region.get_path().contains_points(offsets)
    np.testing.assert_array_equal(inside[clearly], farthest[clearly] < 30)
    assert np.ptp(region.get_xy()[:, 0]) == pytest.approx(2e3 * clearance(Scenario(), ANGLE), abs=0.2)


def test_it_reads_well(entry, legend_of, assert_reads_well, assert_apart, assert_hides_nothing):
    names = ["landings that clear the rim", "cup's rim", "swept by the ball", "2 standard deviations", "executed"]
    assert legend_of(entry) == names
    assert_reads_well(entry.figure)
    assert_apart(entry.figure)
    assert_hides_nothing(entry)


def test_a_ball_that_cannot_enter_clear_has_no_region(axes, legend_of):
    nowhere = ALONG, np.full_like(ALONG, -np.inf)
    draw_rim_clear_entry(axes, cup_radius=CUP, ball=(0.031, 0.02), clear=nowhere, std=(0.005, 0.002))
    assert legend_of(axes) == ["cup's rim", "swept by the ball", "2 standard deviations"]
