"""A recorded cast as cameras see it: its scene moved through the recording, and what is observed of it."""

from __future__ import annotations

import threading
from dataclasses import dataclass, replace
from functools import lru_cache
from typing import Any

import numpy as np
from numpy.typing import NDArray
from pydrake.geometry import SceneGraph
from pydrake.multibody.plant import MultibodyPlant
from pydrake.systems.analysis import Simulator
from pydrake.systems.framework import Context, DiagramBuilder, EventStatus
from pydrake.systems.primitives import TrajectorySource
from pydrake.systems.rendering import MultibodyPositionToGeometryPose
from pydrake.trajectories import PiecewisePolynomial

from wam_cast.arm.arm_chain import arm_chain, encoder_resolution
from wam_cast.arm.arm_model import arm_model
from wam_cast.errors import InputError, checked_integer
from wam_cast.motion.stages import Stage
from wam_cast.perception.ball_filter import ObservedLanding
from wam_cast.perception.ball_observer import Look, add_eyes
from wam_cast.robot.controller import MeasuredArm
from wam_cast.robot.drake_types import add_system
from wam_cast.robot.encoders import Encoders
from wam_cast.robot.plant import N_ARM, fill_plant, make_arm_plant
from wam_cast.scenario import Scenario
from wam_cast.simulation.recording import CastRecording
from wam_cast.types import Array, Position, checks_types

Path: Any = PiecewisePolynomial
"""The stubs take sequences alone, and no arrays."""

START = 0.1
"""When the first pictures are taken, by the clock of the watcher's diagram [s]."""

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
    def landing(self) -> ObservedLanding | None:
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


class CastWatcher:
    """The cameras of a scenario in front of its scene, which moves as a recording says; it serves any number of them.

    Parameters
    ----------
    scenario
        That is recorded; has cameras.
    belief
        What is known of string, ball and gravity; by default the same.
    cup
        World (x, y) of the cup's axis [m], where it does stand; without one, a cup stands at `.default_cup`.
    """

    def __init__(self, scenario: Scenario, belief: Scenario | None = None, cup: Position | None = None) -> None:
        self._scenario = scenario
        self._arm = MeasuredArm(make_arm_plant(belief or scenario))
        builder = DiagramBuilder()
        scene_graph = add_system(builder, "scene_graph", SceneGraph())
        self._plant = MultibodyPlant(time_step=0.0)
        source = self._plant.RegisterAsSourceForSceneGraph(scene_graph)
        fill_plant(self._plant, scenario, cup=cup)
        nowhere = Path.FirstOrderHold(np.array([0.0, 1.0]), np.zeros((self._plant.num_positions(), 2)))
        self._positions = add_system(builder, "recorded_positions", TrajectorySource(nowhere))
        poses = add_system(builder, "poses", MultibodyPositionToGeometryPose(self._plant))
        builder.Connect(self._positions.get_output_port(), poses.get_input_port())
        builder.Connect(poses.get_output_port(), scene_graph.get_source_pose_port(source))
        at_rest = Path.FirstOrderHold(np.array([0.0, 1.0]), np.zeros((3, 2)))
        self._hand = add_system(builder, "hand", TrajectorySource(at_rest, output_derivative_order=1))
        query_object, hand = scene_graph.get_query_output_port(), self._hand.get_output_port()
        self._eyes = add_eyes(builder, scenario, scene_graph, query_object, hand, belief=belief, start=START)
        self._diagram = builder.Build()

    def watch(self, recording: CastRecording, noise_seed: int = 0) -> Sighting:
        """Return what the cameras see of a recording."""
        exposure, period = self._scenario.cameras.exposure, 1 / self._scenario.cameras.frame_rate
        dropped = recording.times[min(int(np.sum(recording.stages < Stage.DROP)), len(recording.times) - 1)]
        late = max(float(dropped) - BEFORE_DROP, exposure) - START  # of the recording's clock
        some = slice(max(int(np.searchsorted(recording.times, late + START - exposure)) - 1, 0), None)
        times, states = recording.times[some] - late, recording.states[some]
        self._positions.UpdateTrajectory(Path.FirstOrderHold(times, states[:, : self._plant.num_positions()].T))
        self._hand.UpdateTrajectory(Path.CubicHermite(times, *self._hand_seen(states)))
        simulator, observer = Simulator(self._diagram), self._eyes.observer
        context = simulator.get_mutable_context()
        context.SetTime(START - exposure)
        self._eyes.set_seed(context, noise_seed)

        def is_down(root: Context) -> EventStatus:
            if observer.belief(observer.GetMyContextFromRoot(root)).is_down:
                return EventStatus.ReachedTermination(observer, "the ball is down")
            return EventStatus.Succeeded()

        simulator.set_monitor(is_down)
        simulator.AdvanceTo(max(float(times[-1]), START + period))
        looks = observer.looks(observer.GetMyContextFromRoot(simulator.get_context()))
        return Sighting(tuple(replace(look, time=look.time + late) for look in looks))

    def _hand_seen(self, states: Array) -> tuple[Array, Array]:
        """Return p_WE and v_WE in the arm's own opinion, (3, n) each: what its encoders read, by its believed kinematics."""
        robot, n_q = self._scenario, self._plant.num_positions()
        resolution = encoder_resolution(arm_chain(robot.arm), robot.noise.encoder_counts)
        encoders, hand = Encoders(resolution, robot.controller.period, np.array(robot.arm.encoder_offset)), []
        for state in states:
            self._arm.measure(encoders.measured(state[np.r_[:N_ARM, n_q : n_q + N_ARM]]))
            hand.append((self._arm.p_WE, self._arm.v_WE))
        p_WE, v_WE = np.transpose(hand, (1, 2, 0))
        return p_WE, v_WE


@lru_cache(maxsize=2)
def _shared_watcher(
    scenario: Scenario, belief: Scenario | None, cup: Position | None, _urdfs: tuple[str, str]
) -> CastWatcher:
    """Return the watcher that this process keeps, unless a URDF has changed."""
    return CastWatcher(scenario, belief, cup)


_one_at_a_time = threading.RLock()


@checks_types
def observe_cast(recording: CastRecording, *, belief: Scenario | None = None, noise_seed: int = 0) -> Sighting:
    """Return what the cameras of a recording's scenario saw of it, from before the hand drops until the ball is at the rim.

    The pictures are rendered, which takes 0.05 s or so each. Threads take turns.

    Parameters
    ----------
    recording
        Of the cast; `CastSimulator.record(..., returns=False)` has all that is looked at.
    belief
        What is known of string, ball and gravity; by default the recording's scenario.
    noise_seed
        Draws the pixels' noise: an integer.

    Raises
    ------
    InputError
        If the scenario has no cameras, or the seed is no integer from 0 on.
    """
    scenario = recording.scenario
    noise_seed = checked_integer("noise_seed", noise_seed, 0)
    if not scenario.cameras.number:
        raise InputError("cameras.number = 0: nothing looks at the ball; let 1 or 2 cameras look")
    with _one_at_a_time:
        urdfs = arm_model(scenario.arm).urdf, arm_model((belief or scenario).arm).urdf
        return _shared_watcher(scenario, belief, recording.cup, urdfs).watch(recording, noise_seed)
