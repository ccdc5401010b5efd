"""The robot in Meshcat goes where the sliders say."""

import gc
import struct
from concurrent.futures import ThreadPoolExecutor

import numpy as np
import pytest

from wam_cast.arm.posture import starting_posture
from wam_cast.errors import InputError
from wam_cast.robot.plant import make_arm_plant
from wam_cast.scenario import Scenario
from wam_cast.visualization.interactive.joint_sliders import STEP, JointSliders
from wam_cast.visualization.viewer import open_meshcat

SCENARIO = Scenario()


@pytest.fixture(scope="module")
def arm():
    return make_arm_plant(SCENARIO)


@pytest.fixture(scope="module")
def meshcat():
    meshcat = open_meshcat()
    yield meshcat
    gc.collect()  # while it is held here: whatever thread collects the scenes would end it there, which it does not bear


@pytest.fixture
def sliders(meshcat):
    meshcat.DeleteAddedControls()
    return JointSliders(meshcat, SCENARIO, {"E": "tool_plate"})


def pose_in(meshcat, path):
    """Return the pose that Meshcat has for a path: 16 numbers of 8 bytes each, by columns, in its packed message."""
    packed = meshcat._GetPackedTransform(path)
    numbers = packed[packed.index(b"matrix") + len(b"matrix") + 3 :]
    return np.array([struct.unpack_from(">d", numbers, 9 * i + 1)[0] for i in range(16)]).reshape(4, 4).T


def hand_pose(arm, q):
    context = arm.CreateDefaultContext()
    arm.SetPositions(context, q)
    return arm.GetFrameByName("tool_plate").CalcPoseInWorld(context).GetAsMatrix4()


def test_robot_starts_as_a_cast_does(sliders, meshcat, arm):
    start = starting_posture(SCENARIO)
    np.testing.assert_allclose(sliders.q_arm, start, atol=STEP)
    np.testing.assert_allclose(pose_in(meshcat, "/frames/E"), hand_pose(arm, sliders.q_arm), atol=1e-12)


def test_hand_and_ball_follow_a_slider(sliders, meshcat, arm):
    meshcat.SetSliderValue("joint 2 [rad]", 0.9)
    meshcat.SetSliderValue("joint 4 [rad]", 1.2)
    sliders.update()
    np.testing.assert_allclose(sliders.q_arm[[1, 3]], [0.9, 1.2], atol=STEP)
    X_WE = hand_pose(arm, sliders.q_arm)
    np.testing.assert_allclose(pose_in(meshcat, "/frames/E"), X_WE, atol=1e-12)
    ball = pose_in(meshcat, "visualizer/ball/ball")[:3, 3]
    np.testing.assert_allclose(X_WE[:3, 3] - ball, [0, 0, SCENARIO.string.length], atol=1e-9)


def test_below_a_low_hand_the_ball_lies_on_the_floor(sliders, meshcat):
    meshcat.SetSliderValue("joint 2 [rad]", 0.4)
    meshcat.SetSliderValue("joint 4 [rad]", 1.3)
    meshcat.SetSliderValue("joint 3 [rad]", 0.5)  # out of the casting plane
    sliders.update()
    hook_height = pose_in(meshcat, "visualizer/string/string_link0")[2, 3]
    assert hook_height < SCENARIO.string.length
    links = [pose_in(meshcat, f"visualizer/string/string_link{i}")[:3, 3] for i in range(SCENARIO.string.n_links)]
    X_WL = pose_in(meshcat, "visualizer/ball/ball")
    ball, radius = X_WL[:3, 3], SCENARIO.ball.radius
    knot = ball - radius * X_WL[:3, 2]  # where the string ends on the ball's surface
    assert ball[2] == pytest.approx(radius, abs=1e-9)
    spans = np.diff([*links, knot, ball], axis=0)
    link = (SCENARIO.string.length - radius) / SCENARIO.string.n_links
    np.testing.assert_allclose(np.linalg.norm(spans, axis=1), [link] * SCENARIO.string.n_links + [radius])
    hanging = int((hook_height - ball[2]) / link)
    np.testing.assert_allclose(spans[:hanging, :2], 0, atol=1e-9)
    np.testing.assert_allclose(spans[hanging + 1 :, 2], 0, atol=1e-9)


def test_sliders_end_at_the_joints_limits(sliders, meshcat, arm):
    for value, limits in ((-10, arm.GetPositionLowerLimits()), (10, arm.GetPositionUpperLimits())):
        for number in range(1, 8):
            meshcat.SetSliderValue(f"joint {number} [rad]", value)
        np.testing.assert_allclose(sliders.q_arm, limits, atol=STEP)


def test_another_thread_is_refused(sliders, meshcat):
    for call in (sliders.update, lambda: JointSliders(meshcat, SCENARIO)):
        with ThreadPoolExecutor(1) as pool, pytest.raises(InputError, match="JointSliders, called in the thread"):
            pool.submit(call).result()
