"""JointSliders: the robot in a Meshcat page, with a slider for each joint of its arm.

Drake's own `JointSliders` aborts the process if another thread collects it, as a notebook's kernel may, and names no unit.
"""

from __future__ import annotations

import asyncio
from collections.abc import Mapping

import numpy as np
from pydrake.geometry import Meshcat

from wam_cast.arm.posture import starting_posture
from wam_cast.robot.plant import N_ARM, make_arm_plant
from wam_cast.scenario import Scenario
from wam_cast.types import Array
from wam_cast.visualization.figures.robot_figures import AXIS_COLORS, AXIS_LENGTH, room_of
from wam_cast.visualization.scene import CastScene
from wam_cast.visualization.viewer import check_main_thread, draw_tube, place_camera

STEP = 0.001
"""Of a slider [rad]."""

TUBE_RADIUS = 0.004
"""Of a frame's axes [m]."""

PERIOD = 0.05
"""Polling interval of the sliders [s]."""


class JointSliders:
    """Shows the robot at rest in the posture that its sliders say, the starting posture at first; in the main thread alone.

    Parameters
    ----------
    meshcat
        Where to show it.
    scenario
        What is shown.
    frames
        By letter, the plant's name of each frame to be drawn.
    """

    def __init__(self, meshcat: Meshcat, scenario: Scenario, frames: Mapping[str, str] | None = None) -> None:
        check_main_thread("JointSliders")
        self._meshcat = meshcat
        self._scene = CastScene(scenario, None, meshcat=meshcat)
        self._frames = {letter: self._scene.plant.GetFrameByName(name) for letter, name in (frames or {}).items()}
        for letter in self._frames:
            for name, axis, color in zip("xyz", AXIS_LENGTH * np.eye(3), AXIS_COLORS, strict=True):
                draw_tube(meshcat, f"/frames/{letter}/{name}", np.array([0 * axis, axis]), TUBE_RADIUS, color)
        arm = make_arm_plant(scenario)
        limits = arm.GetPositionLowerLimits(), arm.GetPositionUpperLimits()
        start = starting_posture(scenario)
        self._names = [f"joint {number} [rad]" for number in range(1, N_ARM + 1)]
        for name, low, high, value in zip(self._names, *limits, start, strict=True):
            meshcat.AddSlider(name, low, high, STEP, value)
        self._shown = np.full(N_ARM, np.nan)
        self._following: asyncio.Task[None] | None = None
        self.update()
        place_camera(meshcat, room_of(scenario), 0.0)

    @property
    def q_arm(self) -> Array:
        """The joint angles that the sliders say [rad], shape (7,)."""
        return np.array([self._meshcat.GetSliderValue(name) for name in self._names])

    def update(self) -> None:
        """Show the robot as the sliders say, if they say something new."""
        check_main_thread("JointSliders")
        q_arm = self.q_arm
        if np.array_equal(q_arm, self._shown):
            return
        self._shown = q_arm
        self._scene.set_posture(q_arm)
        self._scene.publish()
        for letter, frame in self._frames.items():
            self._meshcat.SetTransform(f"/frames/{letter}", self._scene.pose(frame))

    def follow(self) -> None:
        """Keep updating until `stop`, in the running event loop, which a notebook's kernel has: between its cells."""
        self.stop()
        self._following = asyncio.get_running_loop().create_task(self._follow())

    def stop(self) -> None:
        """End what `follow` began, if it did."""
        if self._following is not None:
            self._following.cancel()

    async def _follow(self) -> None:
        while True:
            self.update()
            await asyncio.sleep(PERIOD)
