"""CastStation: the diagram of the whole robot, its parts by name and its exported ports: how they are wired, started and logged."""

from __future__ import annotations

import inspect
import math
from collections.abc import Callable
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray
from pydrake.geometry import Meshcat, MeshcatVisualizer, MeshcatVisualizerParams
from pydrake.math import RotationMatrix
from pydrake.systems.framework import Context, Diagram, DiagramBuilder, LeafSystem, System
from pydrake.systems.primitives import LinearSystem, LogVectorOutput

from wam_cast.arm.arm_chain import arm_chain, encoder_resolution
from wam_cast.arm.arm_meshes import check_meshes
from wam_cast.arm.arm_model import arm_model
from wam_cast.arm.posture import starting_posture
from wam_cast.cast import Cast
from wam_cast.casting_plane import to_casting_plane
from wam_cast.errors import InputError
from wam_cast.motion.in_flight import InFlight
from wam_cast.motion.noise_draws import executed_cast, swing_at_start
from wam_cast.motion.stages import CastMotion, cast_motion
from wam_cast.robot.controller import CastController
from wam_cast.robot.drake_types import add_system, evaluate, own_context, translation
from wam_cast.robot.encoders import Encoders
from wam_cast.robot.forces import add_plant
from wam_cast.robot.kinematics import BallTracker
from wam_cast.robot.motors import Motors, delay_line, fill
from wam_cast.robot.noise import TorqueNoise
from wam_cast.robot.plant import HOOK, hanging_positions
from wam_cast.robot.station_state import StationState
from wam_cast.scenario import Scenario
from wam_cast.types import Array, Position, checks_types

CONTROLLER_PORTS = ("hand", "hand_desired", "stage")
"""Output ports of the controller that are exported if it has them."""


class Log(NamedTuple):
    """Samples of a simulation, one a control period.

    Attributes
    ----------
    times
        From the start of the turn [s], shape (n,).
    states
        Positions and velocities of the plant, shape (n, n_x).
    torques
        Of the motors [N m], shape (n, 7): what was held up to each time.
    """

    times: Array
    states: Array
    torques: Array

    def part(self, samples: slice | NDArray[np.bool_]) -> Log:
        """Return some of the samples."""
        return Log(*(values[samples] for values in self))

    def followed_by(self, later: Log) -> Log:
        """Return these samples and then those of another log."""
        return Log(*map(np.concatenate, zip(self, later, strict=True)))


def believed(scenario: Scenario, belief: Scenario | None) -> Scenario:
    """Return what a controller knows: the `belief`, if there is one, with the controller's values of the robot itself."""
    return scenario if belief is None else belief.model_copy(update={"controller": scenario.controller})


class CastStation:
    """The arm, the string, the ball and the cup under a controller, as a Drake diagram.

    The diagram's default context is `.default_cast` at its start, without noise, and with a cup at `.default_cup`: run it in a
    `Simulator`, alone or in a larger diagram, whose context the methods here take as well.

    Exported output ports: `state` (all positions and velocities), `arm_state` (q and v of the arm, 14), `ball_position` and
    `ball_velocity` (p_WL, v_WL), `torque` (the motors', held between samples, 7), of the controller's, if it has them, `hand` and
    `hand_desired` (p_WE and v_WE, 6; `hand` as the controller measures it) and `stage` (1), and `query_object` of the scene, for
    cameras. Exported input port: `applied_spatial_force`, for forces on any body; it may stay unconnected. Logs of `state` and
    `torque`, a sample per control period, are what outcomes are made from.

    Parameters
    ----------
    scenario
        What is built.
    belief
        The robot as it is believed to be: what the controller's own model of the arm and its motion are made from. By default the
        same scenario. Gains and timing of the controller are the robot's own, whatever is believed.
    has_scene
        With geometry: the cup and the floor, contact, and what can be seen. Without, the plant is the same but the ball touches
        nothing, which simulates faster.
    has_ball
        With string and ball. Without, the arm is alone.
    controller
        In place of `.CastController`: an `.ArmController`, or any LeafSystem with the ports `arm_state` and `actuation`, and a
        method `set_cast(context, cast)` that takes the cast into its own context. If that also takes `start_bearing` and
        `cup_radius` by name, it is told them as `.CastMotion` is.
    meshcat
        Where to show the station, or none.

    Attributes
    ----------
    scenario, belief
        As given; `belief` with the controller's values of `scenario`.
    diagram, plant, scene_graph, controller, motors, hold, ball_tracker
        The diagram and its parts; `scene_graph` is none without geometry, `ball_tracker` without a ball.
    encoders, delay, torque_noise
        Parts that only some scenarios have, else none.
    """

    @checks_types
    def __init__(
        self,
        scenario: Scenario,
        *,
        belief: Scenario | None = None,
        has_scene: bool = True,
        has_ball: bool = True,
        controller: LeafSystem | None = None,
        meshcat: Meshcat | None = None,
    ) -> None:
        self.scenario, self.belief = scenario, believed(scenario, belief)
        controller = controller or CastController(self.belief)
        set_cast: Callable[..., None] | None = getattr(controller, "set_cast", None)
        if set_cast is None:
            raise InputError(
                f"controller {type(controller).__name__}: has no method set_cast(context, cast), by which it is told the cast; "
                "add one (it may do nothing)"
            )
        self._set_cast = set_cast
        self._is_told_places = {"start_bearing", "cup_radius"} <= set(inspect.signature(set_cast).parameters)
        builder = DiagramBuilder()
        self.plant, self.scene_graph = add_plant(builder, scenario, has_scene=has_scene, has_ball=has_ball)
        self.encoders: Encoders | None = None
        self.delay: LinearSystem | None = None
        self.torque_noise: TorqueNoise | None = None
        # The robot goes to where its encoders read the starting posture.
        self._q_start = starting_posture(self.belief) - scenario.arm.encoder_offset
        self.plant.SetDefaultPositions(hanging_positions(self.plant, self._q_start))
        self.controller: LeafSystem = add_system(builder, "controller", controller)
        self.motors = add_system(builder, "motors", Motors(self.plant, scenario.arm))
        self.hold = add_system(builder, "hold", delay_line(1, scenario.controller.period))
        self.ball_tracker = add_system(builder, "ball_tracker", BallTracker(self.plant)) if has_ball else None
        self._connect(builder)
        self._export(builder)
        self._add_logs(builder)
        self.visualizer: MeshcatVisualizer | None = None
        if meshcat is not None:
            if self.scene_graph is None:
                raise InputError("meshcat: a station without geometry has nothing to show; leave has_scene=False out")
            parameters = MeshcatVisualizerParams(publish_period=1 / 64)
            check_meshes(scenario.arm)
            self.visualizer = MeshcatVisualizer.AddToBuilder(builder, self.scene_graph, meshcat, parameters)
        self.diagram: Diagram = builder.Build()
        self.diagram.set_name("cast_station")
        self._hold_first_torque_by_default()

    def _connect(self, builder: DiagramBuilder) -> None:
        plant, robot, period = self.plant, self.scenario, self.scenario.controller.period
        self._arm = plant.GetModelInstanceByName("wam7")
        arm_state = measured = plant.get_state_output_port(self._arm)
        commanded = self.controller.GetOutputPort("actuation")
        offset = np.array(robot.arm.encoder_offset)
        if robot.noise.encoder_counts > 0 or np.any(offset):
            resolution = encoder_resolution(arm_chain(robot.arm), robot.noise.encoder_counts)
            self.encoders = add_system(builder, "encoders", Encoders(resolution, period, offset))
            builder.Connect(measured, self.encoders.get_input_port())
            measured = self.encoders.get_output_port()
        if robot.controller.delay > 0:
            self.delay = add_system(builder, "delay", delay_line(robot.controller.delay, period))
            builder.Connect(commanded, self.delay.get_input_port())
            commanded = self.delay.get_output_port()
        if robot.noise.torque > 0:
            noise = TorqueNoise(robot.noise.torque, self.motors.limits, period)
            self.torque_noise = add_system(builder, "torque_noise", noise)
            builder.Connect(commanded, noise.get_input_port())
            commanded = noise.get_output_port()
        builder.Connect(measured, self.controller.GetInputPort("arm_state"))
        builder.Connect(commanded, self.motors.GetInputPort("commanded"))
        if robot.arm.knee_speed < 1:
            builder.Connect(arm_state, self.motors.GetInputPort("arm_state"))
        builder.Connect(self.motors.get_output_port(), self.hold.get_input_port())
        builder.Connect(self.hold.get_output_port(), plant.get_actuation_input_port())
        if self.ball_tracker is not None:
            for name in ("body_poses", "body_spatial_velocities"):
                builder.Connect(plant.GetOutputPort(name), self.ball_tracker.GetInputPort(name))

    def _export(self, builder: DiagramBuilder) -> None:
        builder.ExportInput(self.plant.get_applied_spatial_force_input_port(), "applied_spatial_force")
        builder.ExportOutput(self.plant.get_state_output_port(), "state")
        builder.ExportOutput(self.plant.get_state_output_port(self._arm), "arm_state")
        if self.ball_tracker is not None:
            builder.ExportOutput(self.ball_tracker.GetOutputPort("position"), "ball_position")
            builder.ExportOutput(self.ball_tracker.GetOutputPort("velocity"), "ball_velocity")
        for name in filter(self.controller.HasOutputPort, CONTROLLER_PORTS):
            builder.ExportOutput(self.controller.GetOutputPort(name), name)
        builder.ExportOutput(self.hold.get_output_port(), "torque")
        if self.scene_graph is not None:
            builder.ExportOutput(self.scene_graph.get_query_output_port(), "query_object")

    def _add_logs(self, builder: DiagramBuilder) -> None:
        ports = {"state": self.plant.get_state_output_port(), "torque": self.hold.get_output_port()}
        period = self.scenario.controller.period
        self._logs = {name: LogVectorOutput(port, builder, publish_period=period) for name, port in ports.items()}
        for name, log in self._logs.items():
            log.set_name(f"{name}_log")

    def executed_motion(
        self, cast: Cast, cup: Position | None = None, *, noise_seed: int = 0, start_bearing: float = 0.0
    ) -> CastMotion:
        """Return the motion that the arm executes when `cast` is commanded; see `set_start`."""
        executed = executed_cast(self.scenario.noise, cast, noise_seed)
        radius = _cup_radius(cast, cup)
        return cast_motion(self.belief, executed, start_bearing=start_bearing, cup_radius=radius)

    def set_start(
        self,
        context: Context,
        cast: Cast,
        cup: Position | None = None,
        *,
        noise_seed: int = 0,
        start_bearing: float = 0.0,
    ) -> None:
        """Put the diagram's `context` at the start of `cast`: time 0, the ball hanging at rest, all other state as when new.

        The arm is in the plane of `start_bearing` [rad], from which the cast turns to its own. `cup` is the world (x, y) [m] of
        the cup's axis; without one, a cup stands at `.default_cup`. `noise_seed` draws the scenario's noise,
        if it has any: which cast is executed, how the ball swings, what the torques do.
        """
        motion = self.executed_motion(cast, cup, noise_seed=noise_seed, start_bearing=start_bearing)
        self.begin(context, motion, None if cup is None else self.scenario.place_of_cup(cup), noise_seed=noise_seed)

    def begin(self, context: Context, motion: CastMotion, cup: Position | None = None, *, noise_seed: int = 0) -> None:
        """Put the diagram's `context` at the start of a `motion`, as `set_start` does for a cast, with the cup standing at `cup`.

        A controller whose `set_cast` takes the cast alone is told no more; it cannot start elsewhere than at home.
        """
        self.check_bearing(motion.cast.bearing, is_first=motion.start_bearing == 0)
        self.diagram.SetDefaultContext(own_context(self.diagram, context))
        context.SetTime(0.0)
        plant_context = self.plant.GetMyMutableContextFromRoot(context)
        q_arm = self._q_start.copy()
        q_arm[0] += arm_model(self.belief.arm).joint_1_turn * motion.start_bearing
        q, v = hanging_positions(self.plant, q_arm), np.zeros(self.plant.num_velocities())
        if self.scenario.noise.swing > 0 and self.ball_tracker is not None:
            angles, rates = swing_at_start(self.scenario, noise_seed)
            q[HOOK] += angles
            v[HOOK] += rates
        self.plant.SetPositions(plant_context, q)
        self.plant.SetVelocities(plant_context, v)
        self._tell_controller(context, motion.cast, motion.start_bearing, motion.cup_radius)
        if self.torque_noise is not None:
            self.torque_noise.set_seed(self.torque_noise.GetMyMutableContextFromRoot(context), noise_seed)
        if cup is not None and self.scene_graph is not None:
            self.set_cup(context, cup)
        self._hold_first_torque(context)
        for log in self._logs.values():
            log.FindMutableLog(context).Clear()

    def state_in_flight(self, motion: CastMotion, since: InFlight, *, noise_seed: int = 0) -> StationState:
        """Return the state of this station in the midst of a `motion` from home, whatever engine has simulated it up to there."""
        context = self.diagram.CreateDefaultContext()
        self.begin(context, motion, noise_seed=noise_seed)
        context.SetTime(since.time)
        plant_context = self.plant.GetMyMutableContextFromRoot(context)
        self.plant.SetPositions(plant_context, since.q)
        self.plant.SetVelocities(plant_context, since.v)
        self.hold.GetMyMutableContextFromRoot(context).SetDiscreteState(since.torque)
        if self.delay is not None:
            self.delay.GetMyMutableContextFromRoot(context).SetDiscreteState(since.waiting.ravel())
        return self.state(context)

    def _hold_first_torque(self, context: Context) -> None:
        """Hold in the diagram's `context` the torque that the controller wants there, as if it had wanted it ever since."""
        if self.delay is not None:
            first = evaluate(self.controller.GetOutputPort("actuation"), self.controller.GetMyContextFromRoot(context))
            self.delay.GetMyMutableContextFromRoot(context).SetDiscreteState(fill(self.delay, first))
        given = evaluate(self.motors.get_output_port(), self.motors.GetMyContextFromRoot(context))
        self.hold.GetMyMutableContextFromRoot(context).SetDiscreteState(given)

    def _hold_first_torque_by_default(self) -> None:
        context = self.diagram.CreateDefaultContext()
        self._hold_first_torque(context)
        for line in filter(None, (self.delay, self.hold)):
            line.configure_default_state(line.GetMyContextFromRoot(context).get_discrete_state_vector().CopyToVector())

    def set_cast(
        self, context: Context, cast: Cast, cup: Position | None = None, *, start_bearing: float = 0.0
    ) -> None:
        """Set the controller's cast in the diagram's `context`, and nothing else: see `set_start`."""
        self.check_bearing(cast.bearing, is_first=start_bearing == 0)
        self._tell_controller(context, cast, start_bearing, _cup_radius(cast, cup))

    def _tell_controller(self, context: Context, cast: Cast, start_bearing: float, cup_radius: float | None) -> None:
        places = {"start_bearing": start_bearing, "cup_radius": cup_radius} if self._is_told_places else {}
        self._set_cast(self.controller.GetMyMutableContextFromRoot(context), cast, **places)

    def check_bearing(self, bearing: float, *, is_first: bool) -> None:
        """Raise `.InputError` if joint 1 cannot turn to `bearing` [rad], or the controller start a cast at home alone."""
        starting_posture(self.belief, bearing)
        if not is_first and not self._is_told_places:
            raise InputError(
                f"controller {type(self.controller).__name__}: cannot go from cup to cup, since its set_cast takes no "
                "start_bearing; let it take start_bearing and cup_radius by name, as CastController's does"
            )

    def set_cup(self, context: Context, cup: Position) -> None:
        """Stand the cup at world (x, y) [m] in the diagram's `context`.

        It is turned to face the base axis: so the flat boxes that make up its wall favour no bearing.
        """
        mount: Any = self.plant.GetFrameByName("cup_mount")  # a FixedOffsetFrame, which the stubs do not know
        R_WC = RotationMatrix.MakeZRotation(math.atan2(cup[1], cup[0]))
        X_WC = translation([*cup, self.scenario.cup.rim_height], R_WC)
        mount.SetPoseInParentFrame(self.plant.GetMyMutableContextFromRoot(context), X_WC)

    def state(self, context: Context) -> StationState:
        """Return the time in the diagram's `context`, and the state of plant, controller, delayed and held torque."""
        return StationState.of(context, self._systems_with_state)

    def set_state(self, context: Context, state: StationState) -> None:
        """Give the diagram's `context` the state that one of this station or of another kind had; its time stays."""
        state.put_into(context, self._systems_with_state)

    @property
    def _systems_with_state(self) -> tuple[System, ...]:
        systems: tuple[System, ...] = (self.plant, self.controller, self.hold)
        return systems if self.delay is None else (*systems, self.delay)

    def logged(self, context: Context) -> Log:
        """Return the logs in `context`."""
        states, torques = (log.FindLog(context) for log in self._logs.values())
        return Log(states.sample_times().copy(), states.data().T.copy(), torques.data().T.copy())

    def desired_path(self, motion: CastMotion, times: Array) -> Array:
        """Return p_WE [m], shape (n, 3), that the controller wants of the hand at `times` [s], shape (n,).

        It says so by a method `hand_desired(time, motion)`, as an `.ArmController` does; nan if it has none. Asked afterwards, it
        costs the simulation nothing.
        """
        hand_desired = getattr(self.controller, "hand_desired", None)
        if hand_desired is None:
            return np.full((len(times), 3), np.nan)
        return np.array([hand_desired(t, motion)[0] for t in times])

    def graph(self) -> str:
        """Return a drawing of the diagram in Graphviz's language: parts, ports and connections, without the logs' inside."""
        text: str = self.diagram.GetGraphvizString(max_depth=1)
        return text


def _cup_radius(cast: Cast, cup: Position | None) -> float | None:
    """Return the distance [m] of the cup's axis from the base axis along the casting plane, none without a cup."""
    return None if cup is None else to_casting_plane(np.array(cup), cast.bearing)[0]
