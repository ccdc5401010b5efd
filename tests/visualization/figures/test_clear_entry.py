"""The cup from above: what may land where, in millimetres."""

import math

import numpy as np
import pytest
from matplotlib.patches import Circle, Ellipse, Polygon

from wam_cast.planning.landing_distribution import clear_half_width, clear_offset
from wam_cast.scenario import Scenario
from wam_cast.visualization.figures.execution_figures import draw_clear_entry

ANGLE = math.radians(30)
CUP, BALL = 0.030, 0.020
SWEPT = (BALL / math.cos(ANGLE), BALL)
ALONG = np.linspace(-0.03, 0.03, 601)
HALF = clear_half_width(Scenario(), ANGLE, ALONG)


@pytest.fixture
def entry(axes):
    axes.figure.set_size_inches(3.6, 4.8)
    landings = np.array([0.001, -0.002]), np.array([0.0, 0.003])
    expected = {"spread": (0.005, 0.002), "predicted": (-0.009, 0.001)}
    draw_clear_entry(axes, cup_radius=CUP, ball=SWEPT, clear=(ALONG, HALF), **expected, landings=landings)
    return axes


def patch_of(axes, kind, label):
    (patch,) = [one for one in axes.patches if one.get_label() == label]
    assert isinstance(patch, kind)
    return patch


def test_shapes_are_as_large_as_they_are(entry, line_of):
    assert patch_of(entry, Circle, "cup's rim").radius == pytest.approx(30)
    swept = patch_of(entry, Ellipse, "swept by the ball")
    assert (swept.width, swept.height) == pytest.approx((40 / math.cos(ANGLE), 40))
    spread = patch_of(entry, Ellipse, "2 standard deviations")
    assert (spread.width, spread.height) == pytest.approx((20, 8))
    assert spread.center == pytest.approx((-9, 1))
    assert swept.center == (0, 0)
    np.testing.assert_allclose(line_of(entry, "executed"), [[1, 0], [-2, 3]])
    assert entry.get_aspect() == 1


def test_the_region_is_where_the_swept_ellipse_fits_into_the_cup(entry):
    region = patch_of(entry, Polygon, "landings that enter clear")
    around = np.linspace(0, 2 * math.pi, 400)
    ellipse = 1e3 * np.column_stack([SWEPT[0] * np.cos(around), SWEPT[1] * np.sin(around)])
    offsets = np.stack(np.meshgrid(np.linspace(-11, 11, 45), np.linspace(-11, 11, 45)), axis=-1).reshape(
        -1, 2
    )
    farthest = np.linalg.norm(offsets[:, None] + ellipse, axis=2).max(axis=1)
    clearly = np.abs(farthest - 30) > 0.1  # not on the verge
    inside = region.get_path().contains_points(offsets)
    np.testing.assert_array_equal(inside[clearly], farthest[clearly] < 30)
    assert np.ptp(region.get_xy()[:, 0]) == pytest.approx(2e3 * clear_offset(Scenario(), ANGLE), abs=0.2)


def test_it_reads_well(entry, legend_of, assert_reads_well, assert_apart, assert_hides_nothing):
    names = [
        "landings that enter clear",
        "cup's rim",
        "swept by the ball",
        "2 standard deviations",
        "executed",
    ]
    assert legend_of(entry) == names
    assert_reads_well(entry.figure)
    assert_apart(entry.figure)
    assert_hides_nothing(entry)


def test_a_ball_that_cannot_enter_clear_has_no_region(axes, legend_of):
    nowhere = ALONG, np.full_like(ALONG, -np.inf)
    draw_clear_entry(axes, cup_radius=CUP, ball=(0.031, 0.02), clear=nowhere, spread=(0.005, 0.002))
    assert legend_of(axes) == ["cup's rim", "swept by the ball", "2 standard deviations"]
