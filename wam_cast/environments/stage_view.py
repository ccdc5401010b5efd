"""StageView: what an environment's `render` shows: a picture taken off screen, or a page of Meshcat in real time."""

from __future__ import annotations

import logging
import time
from typing import TYPE_CHECKING, Literal, get_args

import numpy as np
from numpy.typing import NDArray

from wam_cast.casting_plane import to_polar
from wam_cast.errors import InputError, quoted
from wam_cast.scenario import Scenario
from wam_cast.types import Array, Position

if TYPE_CHECKING:
    from pydrake.geometry import Meshcat

    from wam_cast.visualization.camera import Camera
    from wam_cast.visualization.scene import CastScene

RenderMode = Literal["human", "rgb_array"]

RENDER_MODES: tuple[RenderMode, ...] = get_args(RenderMode)

FRAME_RATE = 50.0
"""Frames a second of the page [1/s]."""

SIZE = (480, 480)
"""Width and height of a picture [pixels]."""

TURN, ELEVATION = 0.45, 0.2
"""Of the camera, about the casting plane toward the cup [rad]."""

_logger = logging.getLogger(__name__)


def checked_render_mode(mode: str | None) -> RenderMode | None:
    """Return a render mode, or none. Raises `.InputError` if it is not known."""
    for known in RENDER_MODES:
        if mode == known:
            return known
    if mode is not None:
        raise InputError(f"render_mode = {quoted(mode)} must be {' or '.join(RENDER_MODES)}, or None")
    return None


class StageView:
    """Shows a scenario's robot, ball and cup in one of the `RENDER_MODES`, or not at all.

    The scene is made when it is first shown, so that whoever learns without looking loads none of it.
    """

    def __init__(self, scenario: Scenario, mode: RenderMode | None) -> None:
        self._scenario, self._mode = scenario, mode
        self._cup: Position | None = None
        self._scene: CastScene | None = None
        self._meshcat: Meshcat | None = None
        self._camera: Camera | None = None
        self._due = 0.0

    def begin(self, cup: Position) -> None:
        """Show the cup at world (x, y) [m], and the arm at home with the ball hanging."""
        if self._mode is None:
            return
        # Most who make an environment look at nothing.
        from wam_cast.arm.posture import starting_posture
        from wam_cast.visualization.camera import Camera, view_rotation
        from wam_cast.visualization.figures.robot_figures import room_of

        bearing = to_polar(cup)[1]
        R_WV = view_rotation(bearing, TURN, ELEVATION)
        c, s = np.cos(bearing), np.sin(bearing)
        room = room_of(self._scenario) @ np.array([[c, s, 0.0], [-s, c, 0.0], [0.0, 0.0, 1.0]])
        self._camera = Camera.framing(room, R_WV, SIZE)
        self._cup = cup
        self._made_scene.stand_cup(cup)
        self._made_scene.set_posture(starting_posture(self._scenario))
        self._due = time.monotonic()
        self._publish()

    @property
    def _made_scene(self) -> CastScene:
        if self._scene is None:
            from wam_cast.visualization.scene import CastScene

            if self._mode == "human":
                from wam_cast.visualization.viewer import check_main_thread, take_page

                check_main_thread('render_mode="human"')
                self._meshcat = take_page()
                _logger.warning("the environment is shown at %s", self._meshcat.web_url())
                self._scene = CastScene(self._scenario, None, meshcat=self._meshcat, frame_rate=FRAME_RATE)
            else:
                self._scene = CastScene(self._scenario, None, light_bearing=0.0)
        return self._scene

    def put(self, state: Array) -> None:
        """Show a state of the plant, shape (n_x,); the page not before its time, `1 / FRAME_RATE` after the last one."""
        if self._mode is None:
            return
        self._made_scene.set_state(0.0, state)
        if self._mode == "human":
            self._due = max(self._due + 1 / FRAME_RATE, time.monotonic() - 1 / FRAME_RATE)
            time.sleep(max(0.0, self._due - time.monotonic()))
            self._publish()

    def play(self, times: Array, states: Array) -> None:
        """Show states of the plant, shape (n, n_x), that it had at `times` [s], shape (n,), in real time."""
        frames = np.arange(times[0], times[-1], 1 / FRAME_RATE)
        for sample in [*np.searchsorted(times, frames), len(times) - 1]:
            self.put(states[sample])

    def _publish(self) -> None:
        if self._mode == "human":
            self._made_scene.publish()

    def render(self) -> NDArray[np.uint8] | None:
        """Return the picture, shape (height, width, 3), from 0 to 255, in the mode `rgb_array`; else none."""
        if self._mode != "rgb_array" or self._camera is None:
            return None
        return self._made_scene.render(self._camera)

    def close(self) -> None:
        """Let go of the scene, and leave its page to the next view."""
        if self._meshcat is not None:
            from wam_cast.visualization.viewer import give_back

            give_back(self._meshcat)
        self._scene = self._meshcat = self._camera = None
