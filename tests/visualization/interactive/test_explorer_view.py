"""What the explorer's page shows and where: meshes and poses as Meshcat has them, without a browser."""

import math
from dataclasses import replace

import msgpack
import numpy as np
import pytest

from wam_cast.cast import Cast
from wam_cast.planning.landing_distribution import LandingStd
from wam_cast.scenario import Scenario
from wam_cast.visualization.interactive.explorer_view import WIDTH, ExplorerView
from wam_cast.visualization.viewer import HAND_PATH_RADIUS

REACH = (0.3, 0.9)


class Seen:
    """A view and what its Meshcat holds."""

    def __init__(self, scenario):
        self.view = ExplorerView(scenario, REACH, farthest=1.3)
        self._meshcat = self.view.meshcat

    def vertices(self, name):
        """Return a mesh's vertices in the frame of its path, shape (n, 3)."""
        (geometry,) = self._unpack("Object", path=f"/explorer/{name}")["object"]["geometries"]
        array = geometry["data"]["attributes"]["position"]["array"]
        return np.frombuffer(array.data, dtype=np.float32).reshape(-1, 3)

    def box(self, name):
        """Return the lowest and the highest corner of a mesh's bounding box, shape (2, 3)."""
        vertices = self.vertices(name)
        return np.array([vertices.min(axis=0), vertices.max(axis=0)])

    def pose(self, name):
        """Return the pose of a path in its parent's frame, shape (4, 4)."""
        return np.reshape(self._unpack("Transform", path=f"/explorer/{name}")["matrix"], (4, 4)).T

    def camera(self):
        """Return the camera's place in the world; its own frame has y up."""
        packed = self._unpack("Property", path="/Cameras/default/rotated/<object>", property="position")
        x, up, back = packed["value"]
        return np.array([x, -back, up])

    def _unpack(self, what, **where):
        return msgpack.unpackb(getattr(self._meshcat, f"_GetPacked{what}")(**where))


@pytest.fixture(scope="module")
def seen():
    return Seen(Scenario())


def test_floor_that_plans_reach_is_drawn_from_the_nearest_to_the_farthest(seen):
    x, y, z = seen.vertices("reach").T
    np.testing.assert_allclose(sorted(set(np.hypot(x, y).round(5))), REACH)
    assert 0 < z.min() == z.max() < 0.001


def test_hands_way_goes_out_at_the_starting_height_and_down_at_its_end(seen):
    motion = seen.view.scenario.motion
    for distance in (0.3, 0.2):
        seen.view.show_setting(Cast(distance, 0.6, 0.1, bearing=0.5), (0.6, 0.1))
        near, far = motion.start_radius, motion.start_radius + distance
        high, low = motion.start_height, motion.start_height - motion.drop_distance
        for name, ends in (("move", [[near, 0, high], [far, 0, high]]), ("drop", [[far, 0, low], [far, 0, high]])):
            np.testing.assert_allclose(seen.box(f"plane/{name}"), ends, atol=HAND_PATH_RADIUS + 1e-6)
    c, s = math.cos(0.5), math.sin(0.5)
    np.testing.assert_allclose(seen.pose("plane")[:3, :3], [[c, -s, 0], [s, c, 0], [0, 0, 1]], atol=1e-12)


def test_rings_of_the_prediction_are_wider_than_the_ball_by_two_deviations(seen):
    for spread in (LandingStd(0.02, 0.03), LandingStd(0.04, 0.01)):
        seen.view.show_prediction(np.array([0.5, 0.2]), spread, 0.0)
        half_axes = seen.view.scenario.ball.radius + 2 * np.array(spread)
        for height in ("floor", "rim"):
            low, high = seen.box(f"predicted/{height}")
            np.testing.assert_allclose(high[:2], half_axes, atol=WIDTH + 1e-6)
            np.testing.assert_allclose(low[:2], -half_axes, atol=WIDTH + 1e-6)
            np.testing.assert_allclose([low[2], high[2]], 0.0, atol=WIDTH + 1e-6)


def test_markers_stand_at_the_landing_on_the_floor_and_in_the_rim_plane(seen, landed):
    seen.view.show_prediction(np.array([0.5, 0.2]), LandingStd(0.02, 0.03), 0.3)
    seen.view.show_execution(landed)
    rim = seen.view.scenario.cup.rim_height
    for marker, landing in (("predicted", [0.5, 0.2]), ("executed", landed.outcome.landing)):
        np.testing.assert_allclose(seen.pose(marker)[:3, 3], [*landing, 0.0], atol=1e-12)
        np.testing.assert_allclose(seen.pose(f"{marker}/rim")[:3, 3], [0, 0, rim], atol=1e-12)
        np.testing.assert_allclose(seen.pose(f"{marker}/stem")[:3, 3], [0, 0, rim / 2], atol=1e-12)
    assert seen.pose("predicted")[1, 0] == pytest.approx(math.sin(0.3))


def test_camera_goes_round_to_a_casting_plane_that_it_does_not_see_from_the_side(seen, landed):
    def cast_at(degrees):
        cast = replace(landed.cast, bearing=math.radians(degrees))
        seen.view.show_execution(replace(landed, cast=cast))
        to_the_right = np.array([math.sin(cast.bearing), -math.cos(cast.bearing), 0.0])
        camera = seen.camera()
        return camera, camera @ to_the_right / np.linalg.norm(camera[:2])

    first, square = cast_at(0)
    assert square > 0.85
    near, _ = cast_at(30)
    np.testing.assert_array_equal(near, first)
    for degrees in (90, -90):
        there, square = cast_at(degrees)
        assert square > 0.85
        assert np.linalg.norm(there - first) > 1.0


@pytest.mark.parametrize("mount", [{}, {"mount": "floor", "mount_height": 0.1}])
def test_arm_of_any_mount_is_shown_in_the_casting_plane(mount):
    motion = {"start_radius": 0.40, "start_height": 0.85} if mount else {}
    bounds = {"distance": [0.05, 0.33]}
    scenario = Scenario.from_dict({"arm": mount, "motion": motion, "bounds": bounds})
    view = ExplorerView(scenario, REACH, farthest=1.3)
    view.show_setting(Cast(0.2, 0.5, 0.1, bearing=0.7), (0.5, 0.3))
    radius = scenario.motion.start_radius
    hand = [radius * math.cos(0.7), radius * math.sin(0.7), scenario.motion.start_height]
    np.testing.assert_allclose(view._scene.position("tool_plate"), hand, atol=1e-9)


def test_markers_stand_on_what_the_cup_stands_on():
    table = {
        "cup": {"base_height": 0.4, "rim_height": 0.52},
        "arm": {"mount_height": 1.746},
        "motion": {"start_height": 1.2},
    }
    on_table = Seen(Scenario.from_dict(table))
    assert on_table.pose("predicted/rim")[2, 3] == pytest.approx(0.52)
    assert on_table.pose("predicted/floor")[2, 3] == pytest.approx(0.4)
    assert on_table.pose("predicted/stem")[2, 3] == pytest.approx(0.46)
