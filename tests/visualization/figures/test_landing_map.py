"""Landing maps of the reference model: contours where it says, labels in sight, one scale for all."""

import numpy as np
import pytest
from matplotlib.figure import Figure

from wam_cast.cast import cast_bounds, is_allowed
from wam_cast.learning.reference import reference_model
from wam_cast.visualization.figures.landing_map import draw_landing_map, draw_landing_scale
from wam_cast.visualization.style import figure_style

LEVELS = np.arange(0.2, 1.11, 0.1)
WAITS = (0.0, 0.2, 0.4)


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
        axes = figure.subplots(1, len(WAITS), sharey=True)
        for panel, wait in zip(axes, WAITS, strict=True):
            rows = np.add(casts, [0, 0, wait]).reshape(-1, 3)
            landing = reference_model().predict(rows)[:, 0].reshape(allowed.shape)
            known = reference_model().known_casts[:50]
            draw_landing_map(
                panel, distance, speed, landing, is_allowed=allowed, wait=wait, levels=LEVELS, casts=known
            )
            panel.label_outer()
        draw_landing_scale(list(axes), LEVELS)
    return axes


def test_labels_stand_on_contours_of_what_they_say_and_can_be_seen(row, grid):
    for panel, wait in zip(row, WAITS, strict=True):
        labels = [text for text in panel.texts if text.get_text()]
        assert len(labels) >= 3
        for label in labels:
            cast = np.array([*label.get_position(), wait])
            extent = np.ptp(grid[0]), np.ptp(grid[1])
            room = np.array([[x * extent[0], y * extent[1], 0] for x in (-0.06, 0.06) for y in (-0.06, 0.06)])
            assert np.all(is_allowed(reference_model().scenario, cast + room))
            assert reference_model().predict(cast[None])[0, 0] == pytest.approx(
                float(label.get_text()), abs=0.02
            )


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
    hatched = path.contains_points(
        np.stack(np.meshgrid(distance, speed), axis=-1).reshape(-1, 2), radius=1e-9
    )
    inner = np.s_[1:-1, 1:-1]  # points on the rim count to neither side
    np.testing.assert_array_equal(hatched.reshape(allowed.shape)[inner], ~allowed[inner])


def test_known_casts_are_dots(row):
    (dots,) = row[0].lines
    np.testing.assert_array_equal(dots.get_xydata(), reference_model().known_casts[:50, :2])
