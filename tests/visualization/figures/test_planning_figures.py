"""Landing maps and families of casts: contours where the model says, labels in sight, one scale for all."""

import numpy as np
import pytest
from matplotlib.colors import to_rgba
from matplotlib.figure import Figure

from wam_cast.cast import cast_bounds, is_allowed
from wam_cast.learning.reference import reference_model
from wam_cast.visualization.figures.planning_figures import (
    draw_family,
    draw_landing_map,
    draw_landing_scale,
    draw_search,
    draw_wait_scale,
)
from wam_cast.visualization.style import figure_style

# --- landing map

LEVELS = np.arange(0.2, 1.11, 0.1)
MAP_WAITS = (0.0, 0.2, 0.4)


@pytest.fixture(scope="module")
def grid():
    model = reference_model()
    lower, upper = cast_bounds(model.scenario)
    distance, speed = np.linspace(lower[0], upper[0], 40), np.linspace(lower[1], upper[1], 30)
    casts = np.stack([*np.meshgrid(distance, speed), np.zeros((30, 40))], axis=-1)
    return distance, speed, casts, is_allowed(model.scenario, casts)


@pytest.fixture(scope="module")
def row(grid):
    distance, speed, casts, allowed = grid
    with figure_style():
        figure = Figure(figsize=(6.3, 2.4))
        axes = figure.subplots(1, len(MAP_WAITS), sharey=True)
        for panel, wait in zip(axes, MAP_WAITS, strict=True):
            rows = np.add(casts, [0, 0, wait]).reshape(-1, 3)
            landing = reference_model().predict(rows)[:, 0].reshape(allowed.shape)
            draw_landing_map(panel, distance, speed, landing, is_allowed=allowed, wait=wait, levels=LEVELS)
            panel.label_outer()
        draw_landing_scale(list(axes), LEVELS)
    return axes


def test_labels_stand_on_contours_of_what_they_say_and_can_be_seen(row, grid):
    for panel, wait in zip(row, MAP_WAITS, strict=True):
        labels = [text for text in panel.texts if text.get_text()]
        assert len(labels) >= 3
        for label in labels:
            cast = np.array([*label.get_position(), wait])
            extent = np.ptp(grid[0]), np.ptp(grid[1])
            room = np.array([[x * extent[0], y * extent[1], 0] for x in (-0.06, 0.06) for y in (-0.06, 0.06)])
            assert np.all(is_allowed(reference_model().scenario, cast + room))
            assert reference_model().predict(cast[None])[0, 0] == pytest.approx(float(label.get_text()), abs=0.02)


def test_row_reads_well_with_one_colour_bar(row, assert_reads_well, assert_apart):
    assert_reads_well(row[0].figure)
    assert_apart(row[0].figure)
    (bar,) = set(row[0].figure.axes) - set(row)
    assert bar.get_ylabel() == "predicted landing [m]"
    assert [panel.get_title() for panel in row] == ["wait 0 ms", "wait 200 ms", "wait 400 ms"]
    assert (row[0].get_xlabel(), row[0].get_ylabel()) == ("distance [m]", "mean speed [m/s]")


def test_what_is_forbidden_is_hatched(row, grid):
    distance, speed, _, allowed = grid
    (cover,) = [item for item in row[0].collections if item.get_zorder() == 3]
    assert cover.hatches == ["////"]
    (path,) = cover.get_paths()
    hatched = path.contains_points(np.stack(np.meshgrid(distance, speed), axis=-1).reshape(-1, 2), radius=1e-9)
    inner = np.s_[1:-1, 1:-1]  # points on the rim count to neither side
    np.testing.assert_array_equal(hatched.reshape(allowed.shape)[inner], ~allowed[inner])


# --- family

DISTANCE, SPEED = np.linspace(0.1, 0.4, 31), np.linspace(0.2, 0.8, 25)
WAITS = np.array([0.0, 0.25, 0.5])
RADIUS = 0.6
ALLOWED = np.tile(SPEED[:, None] < 0.7, (1, len(DISTANCE)))
PATH = np.array([[0.2, 0.5, 0.0], [0.3, 0.4, 0.25], [0.35, 0.3, 0.5]])


def landing(distance, speed, wait):
    return 2 * distance + 0.1 * speed + 0.4 * wait


@pytest.fixture
def family():
    """Draw the family of a plane, twice, with a search in the first one; return the axes."""
    planes = np.array([landing(DISTANCE, SPEED[:, None], wait) for wait in WAITS])
    with figure_style():
        row = list(Figure(figsize=(7.0, 3.0)).subplots(1, 2, sharey=True))
        for axes in row:
            draw_family(axes, DISTANCE, SPEED, WAITS, planes, radius=RADIUS, is_allowed=ALLOWED)
        draw_search(row[0], PATH, WAITS)
        draw_search(row[0], PATH[:2] + 0.02, WAITS, is_named=False)
        row[1].label_outer()
        draw_wait_scale(row, WAITS)
    return row


def curves_of(axes):
    return [one for one in axes.collections if one.get_zorder() == 2]


def test_each_curve_holds_the_allowed_casts_of_its_wait_that_land_at_the_cup(family):
    curves = curves_of(family[1])
    assert len(curves) == len(WAITS)
    for wait, curve in zip(WAITS, curves, strict=True):
        distance, speed = np.vstack([path.vertices for path in curve.get_paths()]).T
        np.testing.assert_allclose(landing(distance, speed, wait), RADIUS, atol=1e-9)
        assert speed.min() == pytest.approx(0.2)
        assert 0.65 < speed.max() < 0.7


def test_a_wait_with_no_such_cast_has_no_curve(axes):
    planes = np.array([landing(DISTANCE, SPEED[:, None], wait) for wait in WAITS])
    planes[1] += 5.0
    draw_family(axes, DISTANCE, SPEED, WAITS, planes, radius=RADIUS, is_allowed=ALLOWED)
    assert len(curves_of(axes)) == 2


def test_a_cast_has_the_colour_of_the_curve_of_its_wait(family):
    colors = [to_rgba(curve.get_edgecolor()[0]) for curve in curves_of(family[0])]
    start, way, end = [one for one in family[0].collections if one.get_label() in ("start", "on the way", "end")]
    for one, color, cast in zip((start, way, end), colors, PATH, strict=True):
        one.update_scalarmappable()
        np.testing.assert_allclose(one.get_facecolor(), [color], atol=1e-6)
        np.testing.assert_array_equal(one.get_offsets(), [cast[:2]])
    assert len(set(colors)) == 3


def test_only_named_searches_are_in_the_legend(family, legend_of, assert_hides_nothing):
    assert legend_of(family[0]) == ["start", "on the way", "end"]
    assert_hides_nothing(family[0])


def test_row_reads_well_with_one_scale_of_waits(family, assert_reads_well, assert_apart):
    figure = family[0].figure
    assert_reads_well(figure)
    assert_apart(figure)
    (bar,) = set(figure.axes) - set(family)
    assert bar.get_ylabel() == "wait [ms]"
    assert bar.get_ylim() == (0, 500)
