"""What the explorer draws: the arm before a cast, the hand's way and the predicted landing, and what became of a cast."""

from __future__ import annotations

import math

import numpy as np
from pydrake.geometry import Cylinder, MeshcatAnimation, Rgba
from pydrake.math import RigidTransform, RotationMatrix

from wam_cast.arm.arm_model import arm_model
from wam_cast.arm.posture import starting_posture
from wam_cast.cast import Cast
from wam_cast.motion.stages import Stage
from wam_cast.planning.landing_distribution import LandingStd
from wam_cast.robot.drake_types import translation
from wam_cast.scenario import Scenario
from wam_cast.simulation.recording import CastRecording
from wam_cast.types import Array, Position
from wam_cast.visualization.recorded import box_corners, frame_moments, mount_box, stage_pieces
from wam_cast.visualization.scene import CastScene
from wam_cast.visualization.style import STAGE_COLORS, Color, stage_name
from wam_cast.visualization.viewer import (
    BALL_PATH_RADIUS,
    HAND_PATH_RADIUS,
    draw_tube,
    keep,
    open_meshcat,
    place_camera,
    ring_points,
)

PREDICTED: Color = (0.95, 0.62, 0.05)
EXECUTED: Color = (0.78, 0.05, 0.22)
PLANE: Color = (0.35, 0.36, 0.38)
WITHIN_REACH: Color = (0.70, 0.78, 0.72)
"""Of the predicted and the executed landing, the casting plane's line on the floor, and the floor where cups can be reached."""

ELEVATION = math.radians(28)
"""From which the floor is seen at first."""

SEEN_WELL = math.radians(45)
"""By how much the casting plane's bearing may differ from the one that the camera was placed for."""

WIDTH, HEIGHT = 0.0035, 0.0005
"""Radius of the tubes that lines and markers on the floor are made of [m], and how high its colours lie, so as to be seen [m]."""

DOT_RADIUS = 0.011
"""Of the executed landing [m]: it fits into the predicted one's ring."""

N_DEVIATIONS = 2
"""Standard deviations by which the ring of the predicted landing is wider than the ball."""

FRAME_RATE = 24
"""Frames for each second of a cast; the browser moves the bodies straight from one to the next."""

ROOT = "/explorer"
"""Path in Meshcat's tree of all that is drawn here, but for the bodies."""


class ExplorerView:
    """The scene of a scenario in a Meshcat of its own.

    `reach` are the smallest and largest distance of a cup from the base axis [m] that can be planned for, none if that is not
    known; `farthest` is the largest that must be seen [m]. `host` and `port` as for `.open_meshcat`.
    """

    def __init__(
        self,
        scenario: Scenario,
        reach: tuple[float, float] | None,
        farthest: float,
        *,
        host: str = "localhost",
        port: int = 0,
    ) -> None:
        self.scenario = scenario
        self.meshcat = keep(open_meshcat(host, port))
        self._scene = CastScene(scenario, None, meshcat=self.meshcat, frame_rate=FRAME_RATE)
        self._q_start = starting_posture(scenario)
        self._hand_way: float | None = None
        self._ring: LandingStd | None = None
        self._replays = False
        self._farthest = farthest
        self._look(0.0)
        self._draw_floor(reach)
        self._add_markers()

    def show_setting(self, cast: Cast, cup: Position) -> None:
        """Show the arm at the start of `cast`, the hand's way to come, and the cup at world (x, y) [m]; a replay ends."""
        if self._replays:
            # What plays in the browser would move the bodies away again.
            self.meshcat.SetAnimation(MeshcatAnimation())
            self._replays = False
        self._scene.stand_cup(cup)
        self._scene.set_posture(self._posture(cast.bearing))
        self._scene.publish()
        self.meshcat.SetTransform(f"{ROOT}/plane", _placed((0.0, 0.0), cast.bearing))
        if cast.distance != self._hand_way:
            self._hand_way = cast.distance
            self._draw_hand_way(cast.distance)

    def show_prediction(self, landing: Array, std: LandingStd, bearing: float) -> None:
        """Mark where the ball is predicted to come through the rim plane, world (x, y) [m], shape (2,), and below.

        The rings are wider than the ball by two standard deviations along the casting plane at `bearing` [rad] and across it.
        """
        if std != self._ring:
            self._ring = std
            along, across = (self.scenario.ball.radius + N_DEVIATIONS * one for one in std)
            for height in ("floor", "rim"):
                self._draw_line(f"predicted/{height}", _ellipse(along, across), WIDTH, PREDICTED)
        self._mark("predicted", landing, bearing)

    def show_execution(self, recording: CastRecording) -> None:
        """Mark where the ball of a cast without its turn landed, draw its path, and replay it in the browser.

        The camera goes where the cast is seen from its side, unless it is seen well enough.
        """
        if abs(recording.cast.bearing - self._viewed_bearing) > SEEN_WELL:
            self._look(recording.cast.bearing)
        self._mark("executed", recording.outcome.landing, recording.cast.bearing)
        samples = [sample for _, sample in frame_moments([recording], FRAME_RATE)]
        animation = self._scene.record((frame, recording, sample) for frame, sample in enumerate(samples))
        self.meshcat.Delete(f"{ROOT}/path")
        for stage, piece in stage_pieces(recording.stages):
            points = recording.p_WL[piece]
            points = points[ring_points(points)]
            if len(points) < 2:
                continue
            path = f"path/{stage_name(stage)}"
            self._draw_line(path, points, BALL_PATH_RADIUS, STAGE_COLORS[stage])
            ends = int(np.searchsorted(samples, piece.stop - 1))
            for frame, is_visible in ((0, False), (ends, True), (len(samples) - 1, True)):
                animation.SetProperty(frame, f"{ROOT}/{path}", "visible", is_visible)
        self.meshcat.SetAnimation(animation)
        self._replays = True

    def _look(self, bearing: float) -> None:
        """Place the camera such that the arm and the floor ahead of it are seen, for casts at `bearing` [rad]."""
        self._viewed_bearing = bearing
        angles = bearing + np.linspace(-1.0, 1.0, 9)
        floor = self._farthest * np.column_stack([np.cos(angles), np.sin(angles), np.zeros(9)])
        self._scene.set_posture(self._posture(bearing))
        shown = np.vstack([floor, box_corners(*mount_box(self.scenario.arm)), self._scene.arm_points()])
        place_camera(self.meshcat, shown, bearing, ELEVATION)

    def _posture(self, bearing: float) -> Array:
        """Return the joint angles [rad], (7,), at the start of a cast at `bearing` [rad]."""
        q_arm = self._q_start.copy()
        q_arm[0] += arm_model(self.scenario.arm).joint_1_turn * bearing
        return q_arm

    def _draw_floor(self, reach: tuple[float, float] | None) -> None:
        """Draw where cups can be reached, and the line in which the casting plane meets the floor."""
        if reach is not None:
            angles = np.linspace(*arm_model(self.scenario.arm).bearing_limits, 96)
            x, y = (np.outer(reach, along) for along in (np.cos(angles), np.sin(angles)))
            self.meshcat.PlotSurface(f"{ROOT}/reach", x, y, np.full_like(x, HEIGHT), Rgba(*WITHIN_REACH))
        line = np.array([[0.0, 0.0, 0.0], [self._farthest, 0.0, 0.0]])
        self._draw_line("plane/line", line, WIDTH, PLANE)

    def _draw_hand_way(self, distance: float) -> None:
        """Draw the hand's way in the casting plane: out by `distance` [m], and down."""
        motion = self.scenario.motion
        near, far = motion.start_radius, motion.start_radius + distance
        high, low = motion.start_height, motion.start_height - motion.drop_distance
        corners = np.array([[near, 0, high], [far, 0, high], [far, 0, low]])
        for stage, ends in ((Stage.MOVE, corners[:2]), (Stage.DROP, corners[1:])):
            self._draw_line(f"plane/{stage_name(stage)}", ends, HAND_PATH_RADIUS, STAGE_COLORS[stage])

    def _add_markers(self) -> None:
        """Add the markers, hidden: each with a twin in the rim plane, joined to it by a stem; the prediction's rings come later.

        The lower one is where the cup has its foot: on the floor, or as high as its stand.
        """
        rim, foot = self.scenario.cup.rim_height, self.scenario.cup.base_height
        for name, color in (("predicted", PREDICTED), ("executed", EXECUTED)):
            path = f"{ROOT}/{name}"
            self.meshcat.SetObject(f"{path}/stem", Cylinder(WIDTH / 2, rim - foot), Rgba(*color))
            self.meshcat.SetTransform(f"{path}/stem", translation([0, 0, (rim + foot) / 2]))
            self.meshcat.SetTransform(f"{path}/rim", translation([0, 0, rim]))
            self.meshcat.SetTransform(f"{path}/floor", translation([0, 0, foot]))
            self.meshcat.SetProperty(path, "visible", False)
        for height in ("floor", "rim"):
            dot = Cylinder(DOT_RADIUS, 2 * WIDTH)
            self.meshcat.SetObject(f"{ROOT}/executed/{height}", dot, Rgba(*EXECUTED))

    def _mark(self, marker: str, landing: Array, bearing: float) -> None:
        """Move a marker to world (x, y) [m], shape (2,), or hide it if that is nan."""
        landed = bool(np.all(np.isfinite(landing)))
        if landed:
            self.meshcat.SetTransform(f"{ROOT}/{marker}", _placed(landing, bearing))
        self.meshcat.SetProperty(f"{ROOT}/{marker}", "visible", landed)

    def _draw_line(self, name: str, points: Array, radius: float, color: Color) -> None:
        draw_tube(self.meshcat, f"{ROOT}/{name}", points, radius, color)


def _placed(position: Position | Array, bearing: float) -> RigidTransform:
    """Return the pose of what stands at world (x, y) [m] on the floor, its x axis at `bearing` [rad]."""
    return translation([*position, 0.0], RotationMatrix.MakeZRotation(bearing))


def _ellipse(along: float, across: float) -> Array:
    """Return an ellipse with half axes along x and y [m] as a closed path, shape (n, 3)."""
    around = np.linspace(0.0, 2 * np.pi, 49)
    return np.column_stack([along * np.cos(around), across * np.sin(around), np.zeros(len(around))])
