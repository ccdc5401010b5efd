"""Camera: where a picture of a cast is taken from, where a point of the world comes to lie in it, and in what light.

Frame V is the camera's: x to the picture's right, y down, z into the scene.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any, Self

import numpy as np
from pydrake.geometry import (
    ClippingRange,
    ColorRenderCamera,
    DepthRange,
    DepthRenderCamera,
    FrameId,
    LightParameter,
    MakeRenderEngineVtk,
    RenderCameraCore,
    RenderEngine,
    RenderEngineVtkParams,
)
from pydrake.math import RigidTransform, RotationMatrix
from pydrake.systems.sensors import CameraInfo, RgbdSensor

from wam_cast.types import Array
from wam_cast.visualization.style import PAPER

MARGIN = 1.06
"""How much larger than what it must show a picture is."""

RENDERER = "vtk"
"""Name of the render engine that a `Camera` asks for."""

NEAREST, FARTHEST = 0.05, 50.0
"""What a camera sees [m]."""


def make_renderer(bearing: float = 0.0) -> RenderEngine:
    """Return a render engine: one light that casts shadows, three that soften them, all turned to `bearing` [rad].

    The first stands so low that the shadow of the ceiling falls beyond the floor that is drawn, and the arm's beside the ball.
    Drake's own light, at the camera, leaves the floor almost black.
    """
    R_WPlane = RotationMatrix.MakeZRotation(bearing).matrix()
    key = LightParameter(
        type="spot",
        frame="world",
        position=R_WPlane @ [-0.6, -2.4, 2.9],
        direction=R_WPlane @ [1.0, 2.4, -2.5],
        cone_angle=40.0,
        intensity=0.4,
    )
    fills = [
        LightParameter(type="point", frame="world", position=R_WPlane @ p, intensity=intensity)
        for p, intensity in (([-2.5, -3.0, 1.2], 0.45), ([2.0, -1.5, 2.6], 0.45), ([0.3, -0.5, 3.5], 0.3))
    ]
    shadows: Any = {"cast_shadows": True, "shadow_map_size": 2048}
    return MakeRenderEngineVtk(RenderEngineVtkParams(default_clear_color=PAPER, lights=[key, *fills], **shadows))


def view_rotation(bearing: float, turn: float, elevation: float) -> Array:
    """Return R_WV of a camera that looks at the casting plane from its right, so that the cast goes to the picture's right.

    The plane has a `bearing`; the camera stands back of square to it by `turn`, toward the base's side, and looks down by
    `elevation`, all in radians.
    """
    heading = bearing + math.pi / 2 - turn
    z = np.array([math.cos(heading), math.sin(heading), -math.tan(elevation)])
    z /= np.linalg.norm(z)
    x = np.cross(z, [0.0, 0.0, 1.0])
    x /= np.linalg.norm(x)
    return np.column_stack([x, np.cross(z, x), z])


@dataclass(frozen=True)
class Camera:
    """A pinhole camera.

    Attributes
    ----------
    p_WV, R_WV
        Its centre [m], shape (3,), and its axes in the world, shape (3, 3).
    width, height
        Of the picture [pixels].
    field_of_view
        Of the picture's height [rad].
    """

    p_WV: Array
    R_WV: Array
    width: int
    height: int
    field_of_view: float

    @classmethod
    def framing(
        cls, p_WQ: Array, R_WV: Array, size: tuple[int, int] = (480, 640), field_of_view: float = math.radians(28)
    ) -> Self:
        """Return the nearest camera with axes `R_WV` that has all points `p_WQ` [m], shape (n, 3), in its picture.

        The picture is `size` = (width, height) pixels large. The points' extent is centred in it.
        """
        p_WQ_V = p_WQ @ R_WV
        middle = (p_WQ_V.min(axis=0) + p_WQ_V.max(axis=0)) / 2
        right, down, ahead = (p_WQ_V - middle).T
        up_slope = math.tan(field_of_view / 2)
        side_slope = up_slope * size[0] / size[1]
        needed = np.maximum(np.abs(right) / side_slope, np.abs(down) / up_slope)
        distance = float(np.max(needed * MARGIN - ahead))
        return cls(R_WV @ (middle - [0, 0, distance]), R_WV, *size, field_of_view)

    @property
    def _info(self) -> CameraInfo:
        return CameraInfo(self.width, self.height, self.field_of_view)

    def project(self, p_WQ: Array) -> Array:
        """Return where the points `p_WQ` [m], shape (n, 3), lie in the picture: column and row, shape (n, 2), in pixels.

        The middle of the first pixel is (0, 0). Points must be in front of the camera.
        """
        image = (p_WQ - self.p_WV) @ self.R_WV @ np.asarray(self._info.intrinsic_matrix()).T
        return np.asarray(image[:, :2] / image[:, 2:])

    @property
    def _core(self) -> RenderCameraCore:
        return RenderCameraCore(RENDERER, self._info, ClippingRange(NEAREST, FARTHEST), RigidTransform())

    @property
    def X_WV(self) -> RigidTransform:
        """The camera's pose in the world."""
        return RigidTransform(RotationMatrix(self.R_WV), self.p_WV)

    def to_drake(self) -> ColorRenderCamera:
        """Return the same for Drake, to be placed at `X_WV`."""
        return ColorRenderCamera(self._core, False)

    def to_sensor(self, world: FrameId) -> RgbdSensor:
        """Return a block that takes this camera's pictures, colour and depth; `world` is the scene graph's world frame.

        The scene graph needs a render engine of the name `RENDERER`, such as `make_renderer` makes.
        """
        depth = DepthRenderCamera(self._core, DepthRange(NEAREST, FARTHEST))
        return RgbdSensor(world, self.X_WV, self.to_drake(), depth)
