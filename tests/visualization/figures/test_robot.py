"""Frames and joints are drawn where the rendered robot has them."""

import numpy as np
import pytest
from matplotlib.figure import Figure

from wam_cast.scenario import Scenario
from wam_cast.visualization.figures.robot_figures import draw_robot, render_robot
from wam_cast.visualization.style import figure_style

Q_BENT = np.array([0.0, 1.0, 0.0, 1.3, 0.0, -0.3, 0.0])
pytestmark = pytest.mark.slow

FRAMES = {"W": "world", "B": "base", "E": "tool_plate", "L": "ball", "C": "cup"}


@pytest.fixture(scope="module")
def view():
    return render_robot(Scenario(), Q_BENT, cup=(0.6, 0.0), frames=FRAMES, has_joint_axes=True)


def test_ball_is_seen_where_its_frame_is(view):
    column, row = view.frames["L"][0].round().astype(int)
    red, green, blue = view.image[row, column].astype(int)
    assert red > 1.5 * green > 3 * blue


def test_frames_point_where_their_axes_do(view):
    for letter in "WC":
        origin, x, y, z = view.frames[letter]
        assert x[0] > origin[0] + 10, "to the right"
        assert y[1] < origin[1] - 3, "away from the camera, which looks down"
        assert z[1] < origin[1] - 20, "up"
    base, *_, down = view.frames["B"]
    assert down[1] > base[1] + 20, "the base hangs"
    np.testing.assert_allclose(view.frames["W"][0][0], base[0], atol=15)


def test_joints_axes_are_those_of_the_arm(view):
    middles, ends = view.joint_axes[:, 0], view.joint_axes[:, 1]
    directions = (ends - middles) / np.linalg.norm(ends - middles, axis=1, keepdims=True)
    np.testing.assert_allclose(directions[0], [0, 1], atol=0.05, err_msg="joint 1 turns about the base axis")
    for joint in (4, 6):
        np.testing.assert_allclose(
            directions[joint - 1], directions[1], atol=0.1, err_msg="in a planar posture"
        )
    shoulder, elbow = middles[1], middles[3]
    upper_arm = (elbow - shoulder) / np.linalg.norm(elbow - shoulder)
    np.testing.assert_allclose(
        directions[2], upper_arm, atol=0.15, err_msg="joint 3 turns about the upper arm"
    )


def test_drawing_names_all_that_was_asked_for_and_nothing_else(view, assert_reads_well):
    with figure_style():
        figure = Figure(figsize=(9, 5))
        left, right = figure.subplots(1, 2)
    draw_robot(left, view)
    plain = render_robot(Scenario(), Q_BENT)
    draw_robot(right, plain)
    assert [text.get_text() for text in left.texts if text.get_text()] == [*FRAMES, *"1234567"]
    assert not right.texts
    assert_reads_well(figure)
    assert not np.array_equal(plain.image, view.image), "without a cup"
