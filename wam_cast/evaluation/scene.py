"""CastScene: what a scenario looks like in one of its states, for whatever wants to draw it, and the light it is rendered in."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
from numpy.typing import NDArray
from pydrake.geometry import (
    Cylinder,
    LightParameter,
    MakeRenderEngineVtk,
    MeshcatVisualizer,
    MeshcatVisualizerParams,
    RenderEngineVtkParams,
)
from pydrake.math import RigidTransform
from pydrake.multibody.plant import AddMultibodyPlantSceneGraph
from pydrake.systems.framework import DiagramBuilder

from wam_cast.evaluation.recorded import CEILING_RADIUS, CEILING_THICKNESS
from wam_cast.evaluation.style import PAPER
from wam_cast.scenario import Scenario
from wam_cast.system.plant import fill_plant, hanging_positions

Array = NDArray[np.float64]

CEILING_COLOR = (0.62, 0.64, 0.67, 1.0)

OUT_OF_SIGHT = (0.0, 0.0, -1.0)
"""Where a cup stands that the cast did not have: below the floor."""


def make_renderer(bearing: float) -> Any:
    """Return an off-screen render engine: one light that casts shadows, two that soften them, all turned to `bearing` [rad]."""
    c, s = math.cos(bearing), math.sin(bearing)
    R_WPlane = np.array([[c, -s, 0], [s, c, 0], [0, 0, 1]])
    key = LightParameter(
        type="spot",
        frame="world",
        position=R_WPlane @ [-0.3, -1.2, 3.6],
        direction=R_WPlane @ [0.65, 1.2, -3.6],
        cone_angle=35.0,
        intensity=0.6,
    )
    fills = [
        LightParameter(type="point", frame="world", position=R_WPlane @ p, intensity=intensity)
        for p, intensity in (([-2.5, -3.0, 1.2], 0.55), ([2.0, -1.5, 2.6], 0.5))
    ]
    settings = RenderEngineVtkParams(
        default_clear_color=PAPER, lights=[key, *fills], cast_shadows=True, shadow_map_size=1024
    )
    return MakeRenderEngineVtk(settings)


class CastScene:
    """The bodies of a scenario and their geometry, without controller or physics.

    Parameters
    ----------
    scenario
        What is shown.
    cup
        World (x, y) of the cup's axis [m]; none hides the cup.
    meshcat
        A Meshcat to show it in, `frame_rate` frames a second [1/s], or none.
    renderers
        Off-screen render engines by name.
    """

    def __init__(
        self,
        scenario: Scenario,
        cup: tuple[float, float] | None,
        *,
        meshcat: Any = None,
        frame_rate: float = 32.0,
        renderers: dict[str, Any] | None = None,
    ) -> None:
        builder = DiagramBuilder()
        self.plant: Any
        self.scene_graph: Any
        self.plant, self.scene_graph = AddMultibodyPlantSceneGraph(builder, time_step=0.0)
        for name, renderer in (renderers or {}).items():
            self.scene_graph.AddRenderer(name, renderer)
        self._add_ceiling(scenario.arm.mount_height)
        fill_plant(self.plant, scenario)
        self.visualizer: Any = None
        if meshcat is not None:
            parameters = MeshcatVisualizerParams(publish_period=1 / frame_rate)
            self.visualizer = MeshcatVisualizer.AddToBuilder(builder, self.scene_graph, meshcat, parameters)
        self.diagram: Any = builder.Build()
        self.context: Any = self.diagram.CreateDefaultContext()
        self._plant_context = self.plant.GetMyMutableContextFromRoot(self.context)
        self._rim_height = scenario.cup.rim_height
        self.stand_cup(cup)

    def _add_ceiling(self, height: float) -> None:
        """Hang the arm from something that can be seen."""
        X_WCeiling = RigidTransform([0.0, 0.0, height + CEILING_THICKNESS / 2])
        patch = Cylinder(CEILING_RADIUS, CEILING_THICKNESS)
        self.plant.RegisterVisualGeometry(
            self.plant.world_body(), X_WCeiling, patch, "ceiling", CEILING_COLOR
        )

    def stand_cup(self, cup: tuple[float, float] | None) -> None:
        """Put the cup's axis at world (x, y) [m], or hide it."""
        p_WC = OUT_OF_SIGHT if cup is None else (*cup, self._rim_height)
        mount = self.plant.GetFrameByName("cup_mount")
        mount.SetPoseInParentFrame(self._plant_context, RigidTransform(p_WC))

    def set_state(self, time: float, state: Array) -> None:
        """Put the scene at `time` [s], with its plant in `state`, shape (n_x,), such as a row of `CastRecording.states`."""
        self.context.SetTime(time)
        self.plant.SetPositionsAndVelocities(self._plant_context, state)

    def set_posture(self, q_arm: Array) -> None:
        """Put the arm at the joint angles `q_arm` [rad], shape (7,), all at rest and the ball hanging."""
        q = hanging_positions(self.plant, q_arm)
        self.set_state(0.0, np.concatenate([q, np.zeros(self.plant.num_velocities())]))

    def pose(self, frame: Any) -> Any:
        """Return the pose of one of the plant's frames in the world, a `RigidTransform` [m]."""
        return frame.CalcPoseInWorld(self._plant_context)

    def position(self, body: str) -> Array:
        """Return where the origin of `body` is in the world [m], shape (3,)."""
        pose = self.plant.GetBodyByName(body).EvalPoseInWorld(self._plant_context)
        return np.asarray(pose.translation())

    def publish(self) -> None:
        """Show the scene as it is, in the Meshcat that it was made with."""
        self.diagram.ForcedPublish(self.context)

    def render(self, camera: Any) -> NDArray[np.uint8]:
        """Return the picture that a `ColorRenderCamera`, placed in the world by its own offset, takes: (height, width, 3)."""
        graph_context = self.scene_graph.GetMyContextFromRoot(self.context)
        query = self.scene_graph.get_query_output_port().Eval(graph_context)
        world = self.scene_graph.world_frame_id()
        image = query.RenderColorImage(camera, world, RigidTransform())
        return np.array(image.data[:, :, :3])
