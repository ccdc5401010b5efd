"""What is drawn over time is what was recorded, up to the beginning of the hold, and its stages are named."""

import dataclasses

import numpy as np
import pytest
from matplotlib.figure import Figure

from wam_cast.motion.stages import Stage
from wam_cast.visualization.figures.motion_figures import HOLD_SHOWN, draw_motion, draw_over_time
from wam_cast.visualization.recorded import without_turn
from wam_cast.visualization.side_view import in_casting_plane
from wam_cast.visualization.style import figure_style

pytestmark = pytest.mark.slow

# --- over time


@pytest.fixture
def wide_axes():
    with figure_style():
        yield Figure(figsize=(6.3, 2.8)).subplots()


def test_curves_are_the_given_ones_until_the_hold(wide_axes, caught, line_of, legend_of, assert_reads_well):
    recording = without_turn(caught)
    curves = {f"joint {i + 1}": recording.states[:, i] for i in range(7)}
    draw_over_time(wide_axes, recording, curves, ylabel="angle [rad]")
    end = recording.times[recording.stages == Stage.HOLD][0] + HOLD_SHOWN
    for name, values in curves.items():
        line = line_of(wide_axes, name)
        np.testing.assert_array_equal(line[:, 0], recording.times[: len(line)])
        np.testing.assert_array_equal(line[:, 1], values[: len(line)])
        assert line[-1, 0] == pytest.approx(end, abs=0.002)
    assert legend_of(wide_axes) == list(curves)
    assert [text.get_text() for text in wide_axes.texts] == ["move", "wait", "drop", "hold"]
    assert_reads_well(wide_axes.figure)


def test_legend_is_beside_the_curves_and_one_curve_has_none(caught, legend_of, assert_hides_nothing, wide_axes):
    draw_over_time(wide_axes, caught, {"a": caught.times, "b": -caught.times}, ylabel="time [s]")
    assert_hides_nothing(wide_axes)
    with figure_style():
        alone = Figure().subplots()
    draw_over_time(alone, caught, {"a": caught.times}, ylabel="time [s]", is_named=False)
    assert legend_of(alone) == []
    assert not alone.texts


def test_recording_that_ends_before_the_hold_is_shown_to_its_end(landed, wide_axes):
    draw_over_time(wide_axes, landed, {"a": landed.times}, ylabel="time [s]")
    assert wide_axes.get_xlim() == (0.0, landed.times[-1])


# --- motion


def draw(recording):
    with figure_style():
        figure = Figure(figsize=(6.3, 5.4))
        axes = figure.subplot_mosaic([["path", "radius"], ["path", "height"]])
        draw_motion(*axes.values(), recording)
    return axes


@pytest.mark.parametrize("size", [(7.2, 4.6), (6.3, 9.0)])
def test_legends_touch_no_label_of_an_axis(caught, size):
    with figure_style():
        figure = Figure(figsize=size, layout="constrained")
        left, right = figure.subfigures(1, 2)
        path, (radius, height) = left.subplots(), right.subplots(2, 1)
        draw_motion(path, radius, height, caught)
        figure.draw_without_rendering()
    for axes in (path, height):
        gap = axes.xaxis.label.get_window_extent().y0 - axes.get_legend().get_window_extent().y1
        assert 2 < gap < 40


@pytest.mark.parametrize("name", ["missed", "landed"])
def test_motion_is_the_recorded_one(name, request, line_of, assert_reads_well, legend_of):
    recording = request.getfixturevalue(name)
    axes = draw(recording)
    recording = without_turn(recording)
    bearing = recording.cast.bearing
    paths = {"hand": recording.p_WE, "hand, desired": recording.p_WE_desired, "ball": recording.p_WL}
    for label, path in paths.items():
        for column, panel in enumerate(("radius", "height")):
            times, values = line_of(axes[panel], label).T
            np.testing.assert_allclose(times, recording.times[: len(times)], atol=1e-12)
            assert times[-1] == pytest.approx(axes[panel].get_xlim()[1], abs=1e-12)
            np.testing.assert_array_equal(values, in_casting_plane(path, bearing)[: len(times), column])
            landing = line_of(axes[panel], "landing")
            np.testing.assert_array_equal(landing[:, 0], recording.outcome.crossing_time)
    assert {"hand", "hand, desired", "ball", "landing", "rim plane"} == set(legend_of(axes["height"]))
    assert_reads_well(axes["path"].figure)


def test_stages_are_named_where_they_are(caught, assert_apart, texts_of):
    axes = draw(caught)["radius"]
    assert_apart(axes.figure)
    names = {text.get_text(): text.xy[0] for text in axes.texts}
    assert list(names) == ["move", "wait", "drop", "hold"]
    for name, time in names.items():
        assert Stage(caught.stages[np.searchsorted(caught.times, time)]).name.lower() == name
        assert axes.get_xlim()[0] < time < axes.get_xlim()[1]


def test_cast_that_never_landed_has_no_landing(landed, legend_of):
    outcome = dataclasses.replace(landed.outcome, crossing_time=np.nan, landing_along=np.nan)
    p_WL = landed.p_WL.copy()
    p_WL[-20:] = np.nan
    axes = draw(dataclasses.replace(landed, outcome=outcome, p_WL=p_WL))
    assert "landing" not in legend_of(axes["height"])
    assert axes["height"].get_xlim()[1] == landed.times[-21]
