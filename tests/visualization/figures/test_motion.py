"""The motion over time is the recorded one, and its stages are named."""

import dataclasses

import numpy as np
import pytest
from matplotlib.figure import Figure

from wam_cast.motion.stages import Stage
from wam_cast.visualization.figures.motion_figures import draw_motion
from wam_cast.visualization.recorded import without_turn
from wam_cast.visualization.side_view import in_casting_plane
from wam_cast.visualization.style import figure_style


def draw(recording):
    with figure_style():
        figure = Figure(figsize=(6.3, 5.4))
        axes = figure.subplot_mosaic([["path", "radius"], ["path", "height"]])
        draw_motion(*axes.values(), recording)
    return axes


@pytest.mark.slow
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
