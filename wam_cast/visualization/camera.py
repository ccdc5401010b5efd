"""From where a picture of a cast is taken, by a `.Camera`, and in what light.

Frame V is the camera's: x to the picture's right, y down, z into the scene.
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np
from pydrake.geometry import LightParameter, MakeRenderEngineVtk, RenderEngine, RenderEngineVtkParams
from pydrake.math import RotationMatrix

from wam_cast.perception.pinhole import MARGIN, RENDERER, Camera
from wam_cast.types import Array
from wam_cast.visualization.style import PAPER

__all__ = ["MARGIN", "RENDERER", "Camera", "make_renderer", "view_rotation"]


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
