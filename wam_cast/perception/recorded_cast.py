"""A recorded cast as cameras see it: its scene moved through the recording, and what is observed of it."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray
from pydrake.geometry import SceneGraph
from pydrake.multibody.plant import MultibodyPlant
from pydrake.systems.analysis import Simulator
from pydrake.systems.framework import Context, DiagramBuilder, EventStatus
from pydrake.systems.primitives import TrajectorySource
from pydrake.systems.rendering import MultibodyPositionToGeometryPose
from pydrake.trajectories import PiecewisePolynomial, Trajectory

from wam_cast.arm.arm_chain import arm_chain, encoder_resolution
from wam_cast.errors import InputError
from wam_cast.motion.stages import Stage
from wam_cast.perception.ball_filter import Landing
from wam_cast.perception.ball_observer import Look, add_eyes
from wam_cast.robot.controller import MeasuredArm
from wam_cast.robot.drake_types import add_system
from wam_cast.robot.encoders import Encoders
from wam_cast.robot.plant import N_ARM, fill_plant, make_arm_plant
from wam_cast.scenario import Scenario
from wam_cast.simulation.recording import CastRecording
from wam_cast.types import Array, checks_types

Path: Any = PiecewisePolynomial
"""The stubs take sequences alone, and no arrays."""

BEFORE_DROP = 0.1
"""How long before the hand drops the cameras begin to look [s]: the string's last swing, from which the ball's speed is known."""


@dataclass(frozen=True, eq=False)
class Sighting:
    """What the cameras saw of a cast.

    Attributes
    ----------
    looks
        In order, until the ball was down.
    """

    looks: tuple[Look, ...]

    @property
    def landing(self) -> Landing | None:
        """Where the ball came down through the rim plane; none if they saw too little of it, or it did not."""
        return self.looks[-1].belief.landing if self.looks else None

    @property
    def times(self) -> Array:
        """Of the pictures [s], from the start of the recording, shape (n,)."""
        return np.array([look.time for look in self.looks])

    @property
    def p_WL(self) -> Array:
        """Where the ball was then, by all that had been seen [m], shape (n, 3); nan before it was seen, and when it was down."""
        ball = [None if look.belief.is_down else look.belief.mean for look in self.looks]
        return np.array([np.full(3, np.nan) if one is None else one[:3] for one in ball]).reshape(-1, 3)

    @property
    def n_seen(self) -> NDArray[np.int_]:
        """In how many pictures each camera found the ball, shape (n_cameras,)."""
        found = np.array([np.isfinite(look.detections[:, 0]) for look in self.looks])
        return np.asarray(found.sum(axis=0))


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
    source = plant.RegisterAsSourceForSceneGraph(scene_graph)
    fill_plant(plant, scenario, cup=None if recording.cup is None else scenario.place_of_cup(recording.cup))
    q = recording.states[:, : plant.num_positions()]
    states = add_system(builder, "recorded_positions", TrajectorySource(Path.FirstOrderHold(recording.times, q.T)))
    poses = add_system(builder, "poses", MultibodyPositionToGeometryPose(plant))
    builder.Connect(states.get_output_port(), poses.get_input_port())
    builder.Connect(poses.get_output_port(), scene_graph.get_source_pose_port(source))
    path = _hand_path(recording, belief or scenario, start - cameras.exposure)
    hand = add_system(builder, "hand", TrajectorySource(path, output_derivative_order=1))
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
    simulator.AdvanceTo(max(end, start + 1 / cameras.frame_rate))
    return Sighting(eyes.observer.looks(eyes.observer.GetMyContextFromRoot(simulator.get_context())))


def _drop_time(recording: CastRecording) -> float:
    """Return when the hand began to drop, or the recording's end if it did not [s]."""
    return float(recording.times[min(int(np.sum(recording.stages < Stage.DROP)), len(recording.times) - 1)])


def _hand_path(recording: CastRecording, belief: Scenario, start: float) -> Trajectory:
    """Return the hand's path from `start` [s] on, in the arm's own opinion: what its encoders read, by its believed kinematics."""
    robot, n_q = recording.scenario, recording.states.shape[1] // 2
    some = slice(max(int(np.searchsorted(recording.times, start)) - 1, 0), None)
    resolution = encoder_resolution(arm_chain(robot.arm), robot.noise.encoder_counts)
    encoders = Encoders(resolution, robot.controller.period, np.array(robot.arm.encoder_offset))
    arm, hand = MeasuredArm(make_arm_plant(belief)), []
    for state in recording.states[some]:
        arm.measure(encoders.measured(state[np.r_[:N_ARM, n_q : n_q + N_ARM]]))
        hand.append((arm.p_WE, arm.v_WE))
    p_WE, v_WE = np.transpose(hand, (1, 2, 0))
    path: Trajectory = Path.CubicHermite(recording.times[some], p_WE, v_WE)
    return path
