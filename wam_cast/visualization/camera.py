"""Camera: where a picture of a cast is taken from, and where a point of the world comes to lie in it.

Frame V is the camera's: x to the picture's right, y down, z into the scene.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Self

import numpy as np
from pydrake.geometry import ClippingRange, ColorRenderCamera, RenderCameraCore
from pydrake.math import RigidTransform, RotationMatrix
from pydrake.systems.sensors import CameraInfo

from wam_cast.types import Array

MARGIN = 1.06
"""How much larger than what it must show a picture is."""


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

    def to_drake(self, renderer: str) -> ColorRenderCamera:
        """Return the same for the render engine of that name, placed in the world by its own offset."""
        X_WV = RigidTransform(RotationMatrix(self.R_WV), self.p_WV)
        core = RenderCameraCore(renderer, self._info, ClippingRange(0.05, 50.0), X_WV)
        return ColorRenderCamera(core, False)
