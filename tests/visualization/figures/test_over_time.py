"""Curves over time are what was given, up to the beginning of the hold."""

import numpy as np
import pytest
from matplotlib.figure import Figure

from wam_cast.motion.stages import Stage
from wam_cast.visualization.figures.motion_figures import HOLD_SHOWN, draw_over_time
from wam_cast.visualization.recorded import without_turn
from wam_cast.visualization.style import figure_style


@pytest.fixture
def axes():
    with figure_style():
        yield Figure(figsize=(6.3, 2.8)).subplots()


def test_curves_are_the_given_ones_until_the_hold(axes, caught, line_of, legend_of, assert_reads_well):
    recording = without_turn(caught)
    curves = {f"joint {i + 1}": recording.states[:, i] for i in range(7)}
    draw_over_time(axes, recording, curves, ylabel="angle [rad]")
    end = recording.times[recording.stages == Stage.HOLD][0] + HOLD_SHOWN
    for name, values in curves.items():
        line = line_of(axes, name)
        np.testing.assert_array_equal(line[:, 0], recording.times[: len(line)])
        np.testing.assert_array_equal(line[:, 1], values[: len(line)])
        assert line[-1, 0] == pytest.approx(end, abs=0.002)
    assert legend_of(axes) == list(curves)
    assert [text.get_text() for text in axes.texts] == ["move", "wait", "drop", "hold"]
    assert_reads_well(axes.figure)


def test_legend_is_beside_the_curves_and_one_curve_has_none(caught, legend_of, assert_hides_nothing, axes):
    draw_over_time(axes, caught, {"a": caught.times, "b": -caught.times}, ylabel="time [s]")
    assert_hides_nothing(axes)
    with figure_style():
        alone = Figure().subplots()
    draw_over_time(alone, caught, {"a": caught.times}, ylabel="time [s]", is_named=False)
    assert legend_of(alone) == []
    assert not alone.texts


def test_recording_that_ends_before_the_hold_is_shown_to_its_end(landed, axes):
    draw_over_time(axes, landed, {"a": landed.times}, ylabel="time [s]")
    assert axes.get_xlim() == (0.0, landed.times[-1])
