"""CastScene: what a scenario looks like in one of its states, for whatever wants to draw it."""

from __future__ import annotations

from collections.abc import Iterable
from contextlib import nullcontext

import numpy as np
from numpy.typing import NDArray
from pydrake.geometry import Box, Cylinder, Meshcat, MeshcatAnimation, MeshcatVisualizer, MeshcatVisualizerParams
from pydrake.math import RigidTransform
from pydrake.multibody.plant import AddMultibodyPlantSceneGraph
from pydrake.multibody.tree import FixedOffsetFrame, Frame, SpatialInertia
from pydrake.systems.framework import DiagramBuilder

from wam_cast.arm.arm_meshes import drawn_meshes
from wam_cast.robot.cup_mesh import cup_mesh
from wam_cast.robot.drake_types import translation
from wam_cast.robot.plant import N_ARM, add_stand_visual, fill_plant, hanging_positions
from wam_cast.scenario import Arm, Cup, Scenario
from wam_cast.simulation.recording import CastRecording
from wam_cast.types import Array, Position
from wam_cast.visualization.camera import RENDERER, Camera, make_renderer
from wam_cast.visualization.recorded import box_corners, holds_ball, mount_box, points_to_show

MOUNT_COLORS = {"ceiling": (0.62, 0.64, 0.67, 1.0), "floor": (0.62, 0.64, 0.67, 1.0), "wall": (0.90, 0.90, 0.88, 1.0)}

LIT_CUP_COLOR = (1.0, 0.78, 0.10, 0.40)
"""Of the cup while it holds the ball."""

OUT_OF_SIGHT = (0.0, 0.0, -5.0)
"""Where a cup stands that is not to be seen, with its stand: far below the floor."""

ARM_RADIUS = 0.08
"""Of the arm about the origins of its links [m], for pictures that must show all of it."""


class CastScene:
    """The bodies of a scenario and their geometry, without controller or physics.

    Parameters
    ----------
    scenario
        What is shown.
    cup
        World (x, y) of the cup's axis [m]; none hides the cup. A second cup, which looks lit, takes its place where told.
    meshcat
        A Meshcat to show it in, `frame_rate` frames a second [1/s], or none.
    light_bearing
        Where the light of rendered pictures comes from: a casting plane's bearing [rad]; without one there are none.

    Raises
    ------
    InputError
        If it is to be drawn, and a mesh of the arm cannot be.
    """

    def __init__(
        self,
        scenario: Scenario,
        cup: Position | None,
        *,
        meshcat: Meshcat | None = None,
        frame_rate: float = 32.0,
        light_bearing: float | None = None,
    ) -> None:
        builder = DiagramBuilder()
        self.plant, self._scene_graph = AddMultibodyPlantSceneGraph(builder, time_step=0.0)
        if light_bearing is not None:
            self._scene_graph.AddRenderer(RENDERER, make_renderer(light_bearing))
        self._add_mount(scenario.arm)
        self._add_lit_cup(scenario.cup)
        is_drawn = meshcat is not None or light_bearing is not None
        with drawn_meshes(scenario.arm) if is_drawn else nullcontext():
            fill_plant(self.plant, scenario)
        if meshcat is not None:
            parameters = MeshcatVisualizerParams(publish_period=1 / frame_rate)
            self._visualizer = MeshcatVisualizer.AddToBuilder(builder, self._scene_graph, meshcat, parameters)
        self._diagram = builder.Build()
        self._context = self._diagram.CreateDefaultContext()
        self._plant_context = self.plant.GetMyMutableContextFromRoot(self._context)
        self._scenario, self._frame_rate = scenario, frame_rate
        self.stand_cup(cup)

    def _add_mount(self, arm: Arm) -> None:
        """Mount the arm on something that can be seen, if it does not stand on the floor itself."""
        low, high = mount_box(arm)
        size = high - low
        if np.all(size > 0):
            shape = Box(*size) if arm.mount == "wall" else Cylinder(size[0] / 2, size[2])
            X_WMount = translation((low + high) / 2)
            self.plant.RegisterVisualGeometry(
                self.plant.world_body(), X_WMount, shape, "mount", MOUNT_COLORS[arm.mount]
            )

    def _add_lit_cup(self, cup: Cup) -> None:
        """Add a cup for the eye alone: a geometry's colour cannot change, so that two cups change places."""
        model = self.plant.AddModelInstance("lit_cup")
        body = self.plant.AddRigidBody("lit_cup", model, SpatialInertia.SolidSphereWithMass(0.1, cup.outer_radius))
        mount = FixedOffsetFrame("lit_cup_mount", self.plant.world_frame(), RigidTransform(), model)
        self.plant.WeldFrames(self.plant.AddFrame(mount), body.body_frame())
        self.plant.RegisterVisualGeometry(body, RigidTransform(), cup_mesh(cup), "lit_cup", LIT_CUP_COLOR)
        add_stand_visual(self.plant, body, cup)

    def stand_cup(self, cup: Position | None, *, is_lit: bool = False) -> None:
        """Put the axis of the cup, or of the one that is lit, at world (x, y) [m], or hide it."""
        p_WC = OUT_OF_SIGHT if cup is None else (*cup, self._scenario.cup.rim_height)
        for name, is_seen in (("cup_mount", not is_lit), ("lit_cup_mount", is_lit)):
            X_WMount = translation(p_WC if is_seen else OUT_OF_SIGHT)
            self.plant.GetFrameByName(name).SetPoseInParentFrame(self._plant_context, X_WMount)

    def set_state(self, time: float, state: Array) -> None:
        """Put the scene at `time` [s], with its plant in `state`, shape (n_x,), such as a row of `.CastRecording.states`."""
        self._context.SetTime(time)
        self.plant.SetPositionsAndVelocities(self._plant_context, state)

    def set_posture(self, q_arm: Array) -> None:
        """Put the arm at the joint angles `q_arm` [rad], shape (7,), all at rest and the ball hanging.

        Below a hand that is too low for that, the ball lies on the floor, and so does what is left of the string.
        """
        at_rest = np.zeros(self.plant.num_velocities())
        q = hanging_positions(self.plant, q_arm)
        self.set_state(0.0, np.concatenate([q, at_rest]))
        string, ball = self._scenario.string, self._scenario.ball
        lengths = np.append(np.full(string.n_links, string.link_length(ball)), ball.radius)
        room = self.pose(self.plant.GetFrameByName("hook")).translation()[2] - ball.radius
        below = np.cumsum(lengths) - lengths
        # The angle from the vertical of each link and of the ball; turned about its y axis, level as long as none is tilted.
        tilts = np.arccos(np.clip((room - below) / lengths, 0.0, 1.0))
        q[N_ARM + 1 :: 2] += np.diff(tilts, prepend=0.0)
        self.set_state(0.0, np.concatenate([q, at_rest]))

    def pose(self, frame: Frame) -> RigidTransform:
        """Return the pose of one of the plant's frames in the world [m]."""
        return frame.CalcPoseInWorld(self._plant_context)

    def show(self, recording: CastRecording, sample: int, time: float | None = None) -> None:
        """Put the scene in the state of a recording's `sample`, its cup lit while it holds the ball.

        `time` [s] is the scene's, of the sample without it.
        """
        self.stand_cup(recording.cup, is_lit=bool(holds_ball(recording, slice(sample, sample + 1))[0]))
        self.set_state(recording.times[sample] if time is None else time, recording.states[sample])

    def position(self, body: str) -> Array:
        """Return where the origin of `body` is in the world [m], shape (3,)."""
        return np.asarray(self.pose(self.plant.GetBodyByName(body).body_frame()).translation())

    def positions(self) -> Array:
        """Return where the origins of all bodies are in the world [m], shape (n, 3)."""
        poses = self.plant.get_body_poses_output_port().Eval(self._plant_context)
        return np.array([pose.translation() for pose in poses])

    def string(self) -> Array:
        """Return points along the string in the world [m], from the hand to the ball's surface, shape (n_links + 1, 3)."""
        links = self.plant.GetBodyIndices(self.plant.GetModelInstanceByName("string"))
        knot = self.pose(self.plant.GetFrameByName("knot")).translation()
        return np.array([*(self.position(self.plant.get_body(link).name()) for link in links), knot])

    def arm_points(self) -> Array:
        """Return points about the arm in the world [m], shape (n, 3): a picture with all of them in it shows all of it."""
        p_WQ = [self.position(f"link{number}") for number in range(1, N_ARM + 1)]
        return np.vstack([box_corners(p - ARM_RADIUS, p + ARM_RADIUS) for p in p_WQ])

    def points_to_show(self, recording: CastRecording, samples: Iterable[int]) -> Array:
        """Return points p_WQ [m], shape (n, 3), such that a picture with all of them in it shows the whole cast.

        The arm is where it is in `samples`.
        """
        points = [points_to_show(recording)]
        for sample in samples:
            self.show(recording, sample)
            points.append(self.arm_points())
        return np.vstack(points)

    def publish(self) -> None:
        """Show the scene as it is, in the Meshcat that it was made with."""
        self._diagram.ForcedPublish(self._context)

    def record(self, frames: Iterable[tuple[int, CastRecording, int]]) -> MeshcatAnimation:
        """Return an animation for the Meshcat: in each frame, by its number, a sample of a recording."""
        self._visualizer.DeleteRecording()
        animation = self._visualizer.StartRecording(False)
        try:
            for frame, recording, sample in frames:
                # In the frame's middle: Drake rounds down.
                self.show(recording, sample, (frame + 0.5) / self._frame_rate)
                self.publish()
        finally:  # or, in a notebook that was interrupted, nothing would be shown any more
            self._visualizer.StopRecording()
        return animation

    def render(self, camera: Camera) -> NDArray[np.uint8]:
        """Return the picture that a camera takes off screen, shape (height, width, 3), from 0 to 255."""
        graph_context = self._scene_graph.GetMyContextFromRoot(self._context)
        query = self._scene_graph.get_query_output_port().Eval(graph_context)
        world = self._scene_graph.world_frame_id()
        image = query.RenderColorImage(camera.to_drake(), world, camera.X_WV)
        return np.array(image.data[:, :, :3])
