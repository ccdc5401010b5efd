"""The scene of any laboratory: what the arm is mounted on, what the cup stands on, and cameras that see all of it."""

import shutil

import numpy as np
import pytest
from matplotlib.colors import to_rgb
from matplotlib.figure import Figure
from matplotlib.patches import Rectangle

from wam_cast.arm.arm_model import models_directory
from wam_cast.arm.posture import starting_posture
from wam_cast.cast import Cast
from wam_cast.robot.plant import STAND_COLOR
from wam_cast.scenario import Scenario
from wam_cast.simulation.simulator import CastSimulator
from wam_cast.visualization.camera import Camera, view_rotation
from wam_cast.visualization.film_strip import choose_moments, render_frames
from wam_cast.visualization.recorded import mount_box, points_to_show
from wam_cast.visualization.scene import CastScene
from wam_cast.visualization.side_view import draw_side_view

ON_FLOOR = {
    "arm": {"mount": "floor", "mount_height": 0.0},
    "motion": {"start_radius": 0.40, "start_height": 0.85},
    "bounds": {"distance": [0.05, 0.33]},
}
ON_PEDESTAL = ON_FLOOR | {
    "arm": {"mount": "floor", "mount_height": 0.3},
    "motion": {"start_radius": 0.40, "start_height": 1.0},
}
ON_WALL = {
    "arm": {"mount": "wall", "mount_height": 1.2},
    "motion": {"start_radius": 0.4, "start_height": 0.85},
    "bounds": {"distance": [0.05, 0.3]},
}
ON_TABLE = {
    "cup": {"base_height": 0.4, "rim_height": 0.52, "base_radius": 0.3},
    "arm": {"mount_height": 1.746},
    "motion": {"start_height": 1.2},
}
LABORATORIES = {"reference": {}, "floor": ON_FLOOR, "pedestal": ON_PEDESTAL, "wall": ON_WALL, "table": ON_TABLE}


@pytest.fixture(scope="module")
def on_table():
    """Return a recorded cast into a cup on a table, which is not quite where it is said to be."""
    scenario = Scenario.from_dict(ON_TABLE | {"cup": ON_TABLE["cup"] | {"offset": [0.01, -0.005]}})
    simulator, cast = CastSimulator(scenario), Cast(0.3, 0.6, 0.1)
    landing = simulator.simulate(cast).landing
    recording = simulator.record(cast, (landing[0] - 0.01, landing[1] + 0.005), returns=False)
    assert recording.outcome.is_caught
    np.testing.assert_allclose(recording.cup, landing)  # where it does stand
    return recording


def at_start(scenario, **options):
    scene = CastScene(scenario, None, **options)
    scene.set_posture(starting_posture(scenario))
    return scene


def visual_names(scene, body):
    """Return the names of what is drawn of a body."""
    plant = scene.plant
    ids = plant.GetVisualGeometriesForBody(body)
    inspector = scene._scene_graph.model_inspector()
    return {inspector.GetName(one).rpartition("::")[2]: inspector.GetPoseInFrame(one) for one in ids}


@pytest.mark.parametrize(("changes", "is_drawn"), [({}, True), (ON_FLOOR, False), (ON_PEDESTAL, True), (ON_WALL, True)])
def test_arm_is_mounted_on_something_that_is_seen_if_it_is_not_the_floor(changes, is_drawn):
    scenario = Scenario.from_dict(changes)
    scene = at_start(scenario)
    drawn = visual_names(scene, scene.plant.world_body())
    assert ("mount" in drawn) == is_drawn
    low, high = mount_box(scenario.arm)
    if is_drawn:
        np.testing.assert_allclose(drawn["mount"].translation(), (low + high) / 2)
    p_WB = scene.position("base")
    # The base touches it: it is on the box's face.
    face = {"ceiling": (2, low[2]), "floor": (2, high[2]), "wall": (0, high[0])}[scenario.arm.mount]
    assert p_WB[face[0]] == pytest.approx(face[1], abs=1e-12)
    assert np.all((p_WB >= low - 1e-12) & (p_WB <= high + 1e-12))


@pytest.mark.parametrize("name", LABORATORIES)
def test_camera_sees_all_of_the_arm(name):
    scenario = Scenario.from_dict(LABORATORIES[name])
    scene = at_start(scenario)
    points = scene.arm_points()
    links = np.array([scene.position(f"link{i}") for i in range(1, 8)])
    assert np.all(links > points.min(axis=0)) and np.all(links < points.max(axis=0))
    hand = scene.position("tool_plate")
    np.testing.assert_allclose(hand, [scenario.motion.start_radius, 0, scenario.motion.start_height], atol=1e-9)
    assert np.all(hand > points.min(axis=0) - 0.01) and np.all(hand < points.max(axis=0) + 0.01)


@pytest.mark.slow
def test_frames_show_the_elbow_of_an_arm_that_stands():
    scenario = Scenario.from_dict(ON_FLOOR)
    recording = CastSimulator(scenario).record(Cast(0.3, 0.6, 0.1, bearing=0.3))
    scene = CastScene(scenario, None)
    heights = points_to_show(recording)[:, 2]
    samples = choose_moments(recording)
    seen = scene.points_to_show(recording, samples)
    scene.show(recording, samples[0])
    elbow = scene.position("link4")
    assert elbow[2] > heights.max() - 0.05  # what the paths alone would not show
    for sample in samples:
        scene.show(recording, sample)
        assert np.all(seen.min(axis=0) < scene.arm_points().max(axis=0))
        assert seen[:, 2].max() >= scene.position("link4")[2] + 0.05
    (frame,) = render_frames(recording, samples[:1], (120, 160))
    column, row = frame.camera.project(elbow[None])[0]
    assert 0 < column < 120
    assert 0 < row < 160


# ---------------------------------------------------------------- the ball


@pytest.mark.parametrize("name", LABORATORIES)
def test_ball_hangs_a_string_s_length_below_the_hand(name):
    scenario = Scenario.from_dict(LABORATORIES[name])
    scene = at_start(scenario)
    span = scene.position("tool_plate") - scene.position("ball")
    np.testing.assert_allclose(span, [0, 0, scenario.string.length], atol=1e-9)
    string = scene.string()
    assert len(string) == scenario.string.n_links + 1
    assert np.linalg.norm(string[-1] - scene.position("ball")) == pytest.approx(scenario.ball.radius)


# ---------------------------------------------------------------- the cup on a table


def test_table_stays_below_the_cup_when_it_is_lit(on_table):
    scene = CastScene(on_table.scenario, on_table.cup)
    for sample in (0, int(np.searchsorted(on_table.times, on_table.outcome.end_time))):
        scene.show(on_table, sample)
        seen = [name for name in ("cup", "lit_cup") if scene.position(name)[2] > 0]
        assert seen == (["cup"] if sample == 0 else ["lit_cup"])
        body = scene.plant.GetBodyByName(seen[0])
        X_CStand = visual_names(scene, body)["stand"]
        p_WStand = scene.position(seen[0]) + X_CStand.translation()
        np.testing.assert_allclose(p_WStand, [*on_table.cup, 0.2], atol=1e-12)


def test_film_strip_s_table_is_seen_where_it_stands(on_table):
    (frame,) = render_frames(on_table, [0], (240, 320))
    x, y = on_table.cup
    column, row = frame.camera.project(np.array([[x, y - 0.3, 0.2]]))[0].round().astype(int)  # of its side, in front
    red, _, blue = frame.image[row, column].astype(float)
    assert red > 1.1 * blue  # brown, where the floor is grey
    low, high = points_to_show(on_table).min(axis=0), points_to_show(on_table).max(axis=0)
    assert high[0] == pytest.approx(x + 0.3)
    assert low[2] == 0


def test_side_view_has_the_table_to_scale(on_table):
    axes = Figure().subplots()
    draw_side_view(axes, on_table)
    (table,) = [patch for patch in axes.patches if isinstance(patch, Rectangle)]
    assert (table.get_x() + table.get_width() / 2, table.get_y()) == pytest.approx((on_table.cup[0], 0.0))
    assert (table.get_width(), table.get_height()) == pytest.approx((0.6, 0.4))
    assert to_rgb(table.get_facecolor()) == pytest.approx(STAND_COLOR[:3])


def test_side_view_of_a_cup_on_the_floor_has_no_table(caught):
    axes = Figure().subplots()
    draw_side_view(axes, caught)
    assert not [patch for patch in axes.patches if isinstance(patch, Rectangle)]


def test_hidden_cup_is_out_of_the_picture_with_its_table(on_table):
    hidden = CastScene(on_table.scenario, None, light_bearing=0.0)
    hidden.show(on_table, 0)
    hidden.stand_cup(None)
    camera = Camera.framing(points_to_show(on_table), view_rotation(0.0, 0.2, 0.15), (240, 320))
    image = hidden.render(camera).astype(float)
    x, y = on_table.cup
    column, row = camera.project(np.array([[x, y - 0.3, 0.2]]))[0].round().astype(int)
    red, _, blue = image[row, column]
    assert red < 1.1 * blue


def test_arm_whose_folder_has_a_space_is_drawn(tmp_path):
    folder = tmp_path / "my robot"
    shutil.copytree(models_directory() / "meshes", folder / "meshes")
    shutil.copy(models_directory() / "wam7.urdf", folder)
    scene = at_start(Scenario.from_dict({"arm": {"urdf": str(folder / "wam7.urdf")}}))
    assert visual_names(scene, scene.plant.GetBodyByName("link1"))
