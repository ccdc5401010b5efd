"""CastScene: what a recorded cast looks like at one of its samples, for whatever wants to draw it."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray
from pydrake.geometry import Cylinder, MeshcatVisualizer, MeshcatVisualizerParams
from pydrake.math import RigidTransform
from pydrake.multibody.plant import AddMultibodyPlantSceneGraph
from pydrake.systems.framework import DiagramBuilder

from wam_cast.evaluation.recorded import CEILING_RADIUS, CEILING_THICKNESS
from wam_cast.system.plant import fill_plant
from wam_cast.system.simulation import CastRecording

Array = NDArray[np.float64]

CEILING_COLOR = (0.62, 0.64, 0.67, 1.0)

OUT_OF_SIGHT = (0.0, 0.0, -1.0)
"""Where a cup stands that the cast did not have: below the floor."""


class CastScene:
    """The bodies of a recorded cast and their geometry, without controller or physics.

    Parameters
    ----------
    recording
        Whose scenario and cup are shown.
    meshcat
        A Meshcat to show it in, `frame_rate` frames a second [1/s], or none.
    renderers
        Off-screen render engines by name.
    """

    def __init__(
        self,
        recording: CastRecording,
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
        self._add_ceiling(recording.scenario.arm.mount_height)
        fill_plant(self.plant, recording.scenario)
        self.visualizer: Any = None
        if meshcat is not None:
            parameters = MeshcatVisualizerParams(publish_period=1 / frame_rate)
            self.visualizer = MeshcatVisualizer.AddToBuilder(builder, self.scene_graph, meshcat, parameters)
        self.diagram: Any = builder.Build()
        self.context: Any = self.diagram.CreateDefaultContext()
        self._plant_context = self.plant.GetMyMutableContextFromRoot(self.context)
        self._stand_cup(recording)

    def _add_ceiling(self, height: float) -> None:
        """Hang the arm from something that can be seen."""
        X_WCeiling = RigidTransform([0.0, 0.0, height + CEILING_THICKNESS / 2])
        patch = Cylinder(CEILING_RADIUS, CEILING_THICKNESS)
        self.plant.RegisterVisualGeometry(
            self.plant.world_body(), X_WCeiling, patch, "ceiling", CEILING_COLOR
        )

    def _stand_cup(self, recording: CastRecording) -> None:
        rim_height = recording.scenario.cup.rim_height
        p_WC = OUT_OF_SIGHT if recording.cup is None else (*recording.cup, rim_height)
        mount = self.plant.GetFrameByName("cup_mount")
        mount.SetPoseInParentFrame(self._plant_context, RigidTransform(p_WC))

    def set_state(self, time: float, state: Array) -> None:
        """Put the scene's context at `time` [s] and at one row of `CastRecording.states`, shape (n_x,)."""
        self.context.SetTime(time)
        self.plant.SetPositionsAndVelocities(self._plant_context, state)

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
