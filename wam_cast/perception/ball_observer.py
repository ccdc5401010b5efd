"""BallObserver: the filter as a block, and the whole chain from a scene to a landing wired into a diagram."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from pydrake.common.value import AbstractValue
from pydrake.geometry import LightParameter, MakeRenderEngineVtk, RenderEngine, RenderEngineVtkParams, SceneGraph
from pydrake.systems.framework import BasicVector, Context, DiagramBuilder, EventStatus, OutputPort, State
from pydrake.systems.sensors import RgbdSensor
from scipy.spatial.transform import Rotation

from wam_cast.arm.arm_meshes import drawn_meshes
from wam_cast.perception.ball_detector import N_VALUES, BallDetector
from wam_cast.perception.ball_filter import BallBelief, BallFilter
from wam_cast.perception.pinhole import RENDERER, Camera
from wam_cast.perception.shutter import Shutter
from wam_cast.robot.drake_types import add_system, evaluate, held
from wam_cast.robot.python_system import PythonSystem
from wam_cast.scenario import Cameras, Scenario
from wam_cast.types import Array

READOUT = 1e-4
"""How long after the shutter has closed a picture is looked at [s]."""

BACKDROP = (0.93, 0.93, 0.91)
"""Colour of all that is beyond the scene."""


def believed_cameras(cameras: Cameras) -> list[Camera]:
    """Return the cameras that look, where they are said to stand."""
    size = (cameras.width, cameras.height)
    places = list(zip(cameras.targets, cameras.positions, strict=True))[: cameras.number]
    return [Camera.looking_at(target, position, size, cameras.field_of_view) for target, position in places]


def true_cameras(cameras: Cameras) -> list[Camera]:
    """Return them where they do stand."""
    return [
        Camera(
            camera.p_WV + offset,
            camera.R_WV @ Rotation.from_rotvec(turn).as_matrix(),
            camera.width,
            camera.height,
            camera.field_of_view,
        )
        for camera, offset, turn in zip(believed_cameras(cameras), cameras.offsets, cameras.turns, strict=False)
    ]


def make_camera_light() -> RenderEngine:
    """Return a render engine with a lamp at each camera and no shadows: what it sees has no dark side, in a third of the time."""
    lamp = LightParameter(type="point", frame="camera", intensity=1.0)
    return MakeRenderEngineVtk(RenderEngineVtkParams(default_clear_color=BACKDROP, lights=[lamp]))


@dataclass(frozen=True, eq=False)
class Look:
    """A picture of each camera, and what is known after it.

    Attributes
    ----------
    time
        When they were taken [s].
    detections
        What was found in each, see `.Detection`, shape (n_cameras, 4); nan where nothing was.
    hand
        p_WE [m] and v_WE [m/s] in the arm's own opinion, (6,).
    belief
        What is known of the ball then.
    """

    time: float
    detections: Array
    hand: Array
    belief: BallBelief


class BallObserver(PythonSystem):
    """A `.BallFilter` that takes a picture of each camera in each period.

    Ports: detection0, detection1, ... (4) each, see `.BallDetector`, and hand (6): p_WE [m] and v_WE [m/s] in the arm's own opinion
    -> position [m] (3), where the ball is, nan before it was seen, and landing (5): world x and y [m], variances of both and their
    covariance [m^2], nan until the ball has come down or if it never does.

    Parameters
    ----------
    scenario, belief
        Its cameras take the pictures, and are believed to stand as it says; the rest is as the belief says.
    start
        Of the first picture [s].
    """

    def __init__(self, scenario: Scenario, belief: Scenario, start: float) -> None:
        super().__init__()
        cameras, period = scenario.cameras, 1 / scenario.cameras.frame_rate
        self._filter = BallFilter(belief, believed_cameras(cameras), period, cameras.calibration_std)
        self._detections = [
            self.DeclareVectorInputPort(f"detection{i}", N_VALUES) for i in range(scenario.cameras.number)
        ]
        self._hand = self.DeclareVectorInputPort("hand", 6)
        self._looks = self.DeclareAbstractState(AbstractValue.Make(()))
        self._late = cameras.exposure / 2 + READOUT
        self.DeclarePeriodicUnrestrictedUpdateEvent(period, start + self._late, self._look)
        state = {self.abstract_state_ticket(self._looks)}
        self.DeclareVectorOutputPort("position", 3, self._calc_position, state)
        self.DeclareVectorOutputPort("landing", 5, self._calc_landing, state)

    def looks(self, context: Context) -> tuple[Look, ...]:
        """Return all that was seen up to now, in this system's own `context`."""
        looks: tuple[Look, ...] = held(context.get_abstract_state(int(self._looks)))
        return looks

    def belief(self, context: Context) -> BallBelief:
        """Return what is known now, in this system's own `context`."""
        looks = self.looks(context)
        return looks[-1].belief if looks else BallBelief()

    def _look(self, context: Context, state: State) -> EventStatus:
        detections = np.array([evaluate(port, context) for port in self._detections])
        hand = evaluate(self._hand, context).copy()
        later = self._filter.after(self.belief(context), detections, hand)
        look = Look(context.get_time() - self._late, detections, hand, later)
        state.get_mutable_abstract_state(int(self._looks)).set_value((*self.looks(context), look))
        return EventStatus.Succeeded()

    def _calc_position(self, context: Context, output: BasicVector) -> None:
        mean = self.belief(context).mean
        output.SetFromVector(np.full(3, math.nan) if mean is None else mean[:3])

    def _calc_landing(self, context: Context, output: BasicVector) -> None:
        landing = self.belief(context).landing
        values = np.full(5, math.nan)
        if landing is not None:
            values[:2], C = landing.position, landing.covariance
            values[2:] = C[0, 0], C[1, 1], C[0, 1]
        output.SetFromVector(values)


@dataclass(frozen=True, eq=False)
class Eyes:
    """The blocks of an observer in a diagram.

    Attributes
    ----------
    observer
        Says where the ball is, and where it lands.
    sensors, shutters, detectors
        One of each for each camera.
    """

    observer: BallObserver
    sensors: list[RgbdSensor]
    shutters: list[Shutter]
    detectors: list[BallDetector]

    def set_seed(self, context: Context, noise_seed: int) -> None:
        """Set in the diagram's `context` what the pixels' noise is drawn from; by default it is 0."""
        for shutter in self.shutters:
            shutter.set_seed(shutter.GetMyMutableContextFromRoot(context), noise_seed)


def add_eyes(
    builder: DiagramBuilder,
    scenario: Scenario,
    scene_graph: SceneGraph,
    query_object: OutputPort,
    hand: OutputPort,
    *,
    belief: Scenario | None = None,
    start: float = 0.1,
) -> Eyes:
    """Add a scenario's cameras to a diagram, and what finds the ball in their pictures: camera, shutter, detector, observer.

    Parameters
    ----------
    builder
        Of the diagram.
    scenario
        Whose `cameras` look.
    scene_graph, query_object
        What they look at: the scene graph, which gets a light if it has none for them, and its port or one that exports it.
    hand
        p_WE [m] and v_WE [m/s], (6,), such as the port `hand` of a `.CastStation`.
    belief
        What is known of string, ball and gravity; by default the same scenario.
    start
        Of the first pictures [s], later than half an exposure.
    """
    if not scene_graph.HasRenderer(RENDERER):
        with drawn_meshes(scenario.arm):
            scene_graph.AddRenderer(RENDERER, make_camera_light())
    cameras, world = scenario.cameras, scene_graph.world_frame_id()
    observer = add_system(builder, "ball_observer", BallObserver(scenario, belief or scenario, start))
    builder.Connect(hand, observer.GetInputPort("hand"))
    eyes = Eyes(observer, [], [], [])
    for i, camera in enumerate(true_cameras(cameras)):
        sensor = add_system(builder, f"camera{i}", camera.to_sensor(world))
        shutter = add_system(builder, f"shutter{i}", Shutter(cameras, i, start))
        detector = add_system(builder, f"detector{i}", BallDetector(cameras))
        builder.Connect(query_object, sensor.query_object_input_port())
        builder.Connect(sensor.color_image_output_port(), shutter.get_input_port())
        builder.Connect(shutter.get_output_port(), detector.get_input_port())
        builder.Connect(detector.get_output_port(), observer.GetInputPort(f"detection{i}"))
        eyes.sensors.append(sensor)
        eyes.shutters.append(shutter)
        eyes.detectors.append(detector)
    return eyes
