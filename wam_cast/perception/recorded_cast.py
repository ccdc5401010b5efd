"""A recorded cast as cameras see it: its scene moved through the recording, and what is observed of it."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from pydrake.geometry import SceneGraph
from pydrake.multibody.plant import MultibodyPlant
from pydrake.systems.analysis import Simulator
from pydrake.systems.framework import Context, DiagramBuilder, EventStatus
from pydrake.systems.primitives import TrajectorySource
from pydrake.systems.rendering import MultibodyPositionToGeometryPose
from pydrake.trajectories import PiecewisePolynomial

from wam_cast.errors import InputError
from wam_cast.motion.stages import Stage
from wam_cast.perception.ball_detector import N_VALUES
from wam_cast.perception.ball_filter import Landing
from wam_cast.perception.ball_observer import add_eyes
from wam_cast.robot.drake_types import add_system
from wam_cast.robot.plant import fill_plant
from wam_cast.scenario import Scenario
from wam_cast.simulation.recording import CastRecording
from wam_cast.types import Array, checks_types

BEFORE_DROP = 0.15
"""How long before the hand drops the cameras begin to look [s]: the string's last swing, from which the ball's speed is known."""


@dataclass(frozen=True, eq=False)
class Sighting:
    """What the cameras saw of a cast.

    Attributes
    ----------
    landing
        Where the ball came down through the rim plane; none if they saw too little of it, or it did not.
    times
        Of the pictures [s], from the start of the recording, shape (n,).
    p_WL
        Where the ball was then, in the filter's opinion after each [m], shape (n, 3); nan before it was seen.
    detections
        What was found in each picture of each camera, see `.Detection`, shape (n, n_cameras, 4); nan where nothing was.
    """

    landing: Landing | None
    times: Array
    p_WL: Array
    detections: Array

    @property
    def n_seen(self) -> NDArray[np.int_]:
        """In how many pictures each camera found the ball, shape (n_cameras,)."""
        return np.asarray(np.isfinite(self.detections[..., 0]).sum(axis=0))


@checks_types
def observe_cast(recording: CastRecording, *, belief: Scenario | None = None, noise_seed: int = 0) -> Sighting:
    """Return what the cameras of a recording's scenario saw of it, from before the hand drops until the ball is at the rim.

    The pictures are rendered, which takes 0.05 s or so each.

    Parameters
    ----------
    recording
        Of the cast; `CastSimulator.record(..., returns=False)` has all that is looked at.
    belief
        What is known of string, ball and gravity; by default the recording's scenario.
    noise_seed
        Draws the pixels' noise.

    Raises
    ------
    InputError
        If the scenario has no cameras.
    """
    scenario = recording.scenario
    if not scenario.cameras.number:
        raise InputError("cameras.number = 0: nothing looks at the ball; let 1 or 2 cameras look")
    cameras, end = scenario.cameras, float(recording.times[-1])
    start = max(_drop_time(recording) - BEFORE_DROP, cameras.exposure)
    builder = DiagramBuilder()
    scene_graph = add_system(builder, "scene_graph", SceneGraph())
    plant = MultibodyPlant(time_step=0.0)
    plant.RegisterAsSourceForSceneGraph(scene_graph)
    fill_plant(plant, scenario, cup=None if recording.cup is None else scenario.place_of_cup(recording.cup))
    positions = PiecewisePolynomial.FirstOrderHold(recording.times, recording.states[:, : plant.num_positions()].T)
    states = add_system(builder, "recorded_positions", TrajectorySource(positions))
    poses = add_system(builder, "poses", MultibodyPositionToGeometryPose(plant))
    builder.Connect(states.get_output_port(), poses.get_input_port())
    builder.Connect(poses.get_output_port(), scene_graph.get_source_pose_port(plant.get_source_id()))
    hand = add_system(builder, "hand", TrajectorySource(_hand_path(recording), output_derivative_order=1))
    eyes = add_eyes(
        builder,
        scenario,
        scene_graph,
        scene_graph.get_query_output_port(),
        hand.get_output_port(),
        belief=belief,
        start=start,
        noise_seed=noise_seed,
    )
    simulator = Simulator(builder.Build())
    simulator.get_mutable_context().SetTime(start - cameras.exposure)

    def is_down(root: Context) -> EventStatus:
        is_over = eyes.observer.belief(eyes.observer.GetMyContextFromRoot(root)).is_down
        return EventStatus.ReachedTermination(eyes.observer, "the ball is down") if is_over else EventStatus.Succeeded()

    simulator.set_monitor(is_down)
    simulator.AdvanceTo(max(end, start))
    looks = eyes.observer.looks(eyes.observer.GetMyContextFromRoot(simulator.get_context()))
    beliefs = [look.belief for look in looks]
    p_WL = [np.full(3, np.nan) if one.mean is None else one.mean[:3] for one in beliefs]
    return Sighting(
        beliefs[-1].landing if looks else None,
        np.array([look.time for look in looks]),
        np.array(p_WL).reshape(-1, 3),
        np.array([look.detections for look in looks]).reshape(-1, cameras.number, N_VALUES),
    )


def _drop_time(recording: CastRecording) -> float:
    """Return when the hand began to drop, or the recording's end if it did not [s]."""
    return float(recording.times[min(int(np.sum(recording.stages < Stage.DROP)), len(recording.times) - 1)])


def _hand_path(recording: CastRecording) -> PiecewisePolynomial:
    """Return where the controller wants the hand, or where it is if the controller does not say."""
    path = recording.p_WE_desired if np.isfinite(recording.p_WE_desired).all() else recording.p_WE
    return PiecewisePolynomial.CubicHermite(recording.times, path.T, np.gradient(path, recording.times, axis=0).T)
