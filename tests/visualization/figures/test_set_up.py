"""The picture of the set-up names what is there, where it is, and measures what the scenario says."""

import dataclasses

import numpy as np
import pytest
from matplotlib.figure import Figure

from wam_cast.scenario import Scenario
from wam_cast.visualization.figures.robot_figures import LEFT, draw_set_up, render_set_up
from wam_cast.visualization.style import figure_style

CUPS = {"ahead": (0.75, 0.0), "near and aside": (0.25, -0.2)}
HIGH = Scenario.from_dict(
    {"arm": {"mount_height": 1.496}, "motion": {"start_height": 0.95}, "string": {"length": 0.75}}
)


@pytest.fixture(scope="module", params=CUPS)
def view(request):
    return render_set_up(Scenario(), CUPS[request.param])


@pytest.fixture
def drawn(view):
    with figure_style():
        axes = Figure(figsize=(6.3, 5.0)).subplots()
        draw_set_up(axes, view)
        return axes


def test_ball_is_where_it_is_named(view):
    red, green, blue = np.moveaxis(view.image.astype(float), -1, 0)
    rows, columns = np.nonzero((red > 20) & (red > 1.8 * green) & (red > 3 * blue))
    assert np.linalg.norm(view.parts["ball"] - [columns.mean(), rows.mean()]) < 2


def test_cup_is_where_it_is_named(view):
    column, row = np.rint(view.parts["cup"]).astype(int)
    red, _, blue = view.image[row, column].astype(int)
    assert blue > red + 20


def test_parts_stand_in_their_order(view):
    rows = [view.parts[name][1] for name in ("ceiling mount", "hand", "string", "ball", "cup")]
    assert rows == sorted(rows)
    assert view.parts["cup"][0] > view.parts["hand"][0] + 10
    np.testing.assert_allclose(view.parts["string"][0], view.parts["hand"][0], atol=2)


def test_dimensions_say_what_the_scenario_says_and_are_drawn_to_scale(view):
    spans = {text.split()[0]: (text, ends) for text, ends in view.dimensions.items()}
    for name, length in (("ceiling", 1.346), ("string", 0.6), ("hand", 0.8), ("rim", 0.12)):
        text, ends = spans[name]
        assert f"{length:g} m" in text
        # Perspective and the camera's elevation take little of it.
        scale = np.linalg.norm(np.diff(spans["string"][1], axis=0)) / 0.6
        assert np.linalg.norm(np.diff(ends, axis=0)) == pytest.approx(scale * length, rel=0.12)
    assert spans["cup"][0] in ("cup 0.75 m from the base axis", "cup 0.32 m from the base axis")


def test_all_that_is_named_is_in_the_picture(view):
    height, width, _ = view.image.shape
    for points in (*view.parts.values(), *view.dimensions.values()):
        assert np.all((points >= -0.5) & (points <= [width - 0.5, height - 0.5]))


def test_names_can_be_read_and_do_not_overlap(drawn, view, assert_apart, assert_reads_well, texts_of):
    assert_apart(drawn.figure)
    assert_reads_well(drawn.figure)
    assert {text.get_text() for text, _ in texts_of(drawn.figure)} == {*view.parts, *view.dimensions}
    np.testing.assert_array_equal(drawn.images[0].get_array(), view.image)


@pytest.mark.parametrize("scenario", [Scenario(), HIGH], ids=["reference", "high"])
def test_no_leader_comes_near_what_a_dimension_says_and_none_is_longer_than_its_line(scenario, texts_of):
    view = render_set_up(scenario, (0.75, 0.0))
    with figure_style():
        axes = Figure(figsize=(10, 5.8)).subplots(1, 2)[0]
        draw_set_up(axes, view)
    boxes = {text.get_text(): box for text, box in texts_of(axes.figure)}
    for text, ends in view.dimensions.items():
        box = boxes[text]
        for name, point in view.parts.items():
            column, row = axes.transData.transform(point)
            is_crossed = column > box.x0 if name in LEFT else column < box.x1
            assert not (is_crossed and box.y0 - 10 < row < box.y1 + 10), f"{name} through {text}"
        assert box.height < np.ptp(axes.transData.transform(ends), axis=0).max(), text


def test_a_view_is_frozen(view):
    with pytest.raises(dataclasses.FrozenInstanceError):
        view.image = None
