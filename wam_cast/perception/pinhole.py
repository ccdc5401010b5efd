"""Camera: a pinhole camera, where a point of the world comes to lie in its picture, and the same as a Drake sensor.

Frame V is the camera's: x to the picture's right, y down, z into the scene.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Self

import numpy as np
from pydrake.geometry import ClippingRange, ColorRenderCamera, DepthRange, DepthRenderCamera, FrameId, RenderCameraCore
from pydrake.math import RigidTransform, RotationMatrix
from pydrake.systems.sensors import CameraInfo, RgbdSensor

from wam_cast.types import Array

MARGIN = 1.06
"""How much larger than what it must show a picture is."""

RENDERER = "vtk"
"""Name of the render engine that a `Camera` asks for."""

NEAREST, FARTHEST = 0.05, 50.0
"""What a camera sees [m]."""


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

    @classmethod
    def looking_at(
        cls, p_WQ: Sequence[float], p_WV: Sequence[float], size: tuple[int, int], field_of_view: float
    ) -> Self:
        """Return a level camera at `p_WV` with the point `p_WQ` in the middle of its picture, (3,) each [m]."""
        z = np.subtract(p_WQ, p_WV)
        z = z / np.linalg.norm(z)
        x = np.cross(z, [0.0, 0.0, 1.0])
        x /= np.linalg.norm(x)
        return cls(np.array(p_WV, dtype=float), np.column_stack([x, np.cross(z, x), z]), *size, field_of_view)

    @property
    def focal_length(self) -> float:
        """In pixels."""
        return float(self._info.focal_x())

    @property
    def _info(self) -> CameraInfo:
        return CameraInfo(self.width, self.height, self.field_of_view)

    def project(self, p_WQ: Array) -> Array:
        """Return where the points `p_WQ` [m], shape (n, 3), lie in the picture: column and row, shape (n, 2), in pixels.

        They are counted from the outer corner of the first pixel, as Drake draws. Points must be in front of the camera.
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

        The scene graph needs a render engine of the name `RENDERER`, such as `.make_renderer` makes.
        """
        depth = DepthRenderCamera(self._core, DepthRange(NEAREST, FARTHEST))
        return RgbdSensor(world, self.X_WV, self.to_drake(), depth)
