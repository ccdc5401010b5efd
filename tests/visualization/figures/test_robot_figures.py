"""What is drawn into the rendered robot and set-up is where the picture has it."""

import dataclasses

import numpy as np
import pytest
from matplotlib.figure import Figure

from wam_cast.scenario import Scenario
from wam_cast.visualization.figures.robot_figures import LEFT, draw_robot, draw_set_up, render_robot, render_set_up
from wam_cast.visualization.style import figure_style

pytestmark = pytest.mark.slow

# --- set up

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


# --- robot

Q_BENT = np.array([0.0, 1.0, 0.0, 1.3, 0.0, -0.3, 0.0])

FRAMES = {"W": "world", "B": "base", "E": "tool_plate", "L": "ball", "C": "cup"}


@pytest.fixture(scope="module")
def robot_view():
    return render_robot(Scenario(), Q_BENT, cup=(0.6, 0.0), frames=FRAMES, has_joint_axes=True)


def test_ball_is_seen_where_its_frame_is(robot_view):
    column, row = robot_view.frames["L"][0].round().astype(int)
    red, green, blue = robot_view.image[row, column].astype(int)
    assert red > 1.5 * green > 3 * blue


def test_frames_point_where_their_axes_do(robot_view):
    for letter in "WC":
        origin, x, y, z = robot_view.frames[letter]
        assert x[0] > origin[0] + 10, "to the right"
        assert y[1] < origin[1] - 3, "away from the camera, which looks down"
        assert z[1] < origin[1] - 20, "up"
    base, *_, down = robot_view.frames["B"]
    assert down[1] > base[1] + 20, "the base hangs"
    np.testing.assert_allclose(robot_view.frames["W"][0][0], base[0], atol=15)


def test_joints_axes_are_those_of_the_arm(robot_view):
    middles, ends = robot_view.joint_axes[:, 0], robot_view.joint_axes[:, 1]
    directions = (ends - middles) / np.linalg.norm(ends - middles, axis=1, keepdims=True)
    np.testing.assert_allclose(directions[0], [0, 1], atol=0.05, err_msg="joint 1 turns about the base axis")
    for joint in (4, 6):
        np.testing.assert_allclose(directions[joint - 1], directions[1], atol=0.1, err_msg="in a planar posture")
    shoulder, elbow = middles[1], middles[3]
    upper_arm = (elbow - shoulder) / np.linalg.norm(elbow - shoulder)
    np.testing.assert_allclose(directions[2], upper_arm, atol=0.15, err_msg="joint 3 turns about the upper arm")


def test_drawing_names_all_that_was_asked_for_and_nothing_else(robot_view, assert_reads_well):
    with figure_style():
        figure = Figure(figsize=(9, 5))
        left, right = figure.subplots(1, 2)
    draw_robot(left, robot_view)
    plain = render_robot(Scenario(), Q_BENT)
    draw_robot(right, plain)
    assert [text.get_text() for text in left.texts if text.get_text()] == [*FRAMES, *"1234567"]
    assert not right.texts
    assert_reads_well(figure)
    assert not np.array_equal(plain.image, robot_view.image), "without a cup"


# --- other laboratories

ON_FLOOR = {"arm": {"mount": "floor", "mount_height": 0.0}, "motion": {"start_radius": 0.40, "start_height": 0.85}}
ON_WALL = {"arm": {"mount": "wall", "mount_height": 1.2}, "motion": {"start_radius": 0.40, "start_height": 0.85}}
ON_TABLE = {
    "cup": {"base_height": 0.4, "rim_height": 0.52, "base_radius": 0.3},
    "arm": {"mount_height": 1.746},
    "motion": {"start_height": 1.2},
}


@pytest.mark.parametrize(
    ("changes", "part", "dimension", "without"),
    [
        (ON_FLOOR, "floor mount", "cup 0.75 m from the base axis", "base 0 m"),
        (ON_WALL, "wall mount", "base axis 1.2 m", "ceiling 1.2 m"),
        (ON_TABLE, "stand", "rim 0.52 m", "rim 0.12 m"),
    ],
    ids=["floor", "wall", "table"],
)
def test_set_up_of_another_laboratory_names_what_it_has(changes, part, dimension, without):
    view = render_set_up(Scenario.from_dict({"bounds": {"distance": [0.05, 0.30]}} | changes), (0.75, 0.0))
    assert part in view.parts
    assert dimension in view.dimensions
    assert without not in view.dimensions
    height, width, _ = view.image.shape
    for points in (*view.parts.values(), *view.dimensions.values()):
        assert np.all((points >= -0.5) & (points <= [width - 0.5, height - 0.5]))
    with figure_style():
        axes = Figure(figsize=(6.3, 5.0)).subplots()
        draw_set_up(axes, view)
    assert part in {text.get_text() for text in axes.texts}
