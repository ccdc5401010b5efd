"""The cup's shape for the eye: a smooth surface of revolution, where contact knows a ring of boxes."""

from __future__ import annotations

from itertools import pairwise

import numpy as np
from pydrake.common import MemoryFile
from pydrake.geometry import InMemoryMesh, Mesh

from wam_cast.scenario import Cup

N_SIDES = 48


def cup_profile(cup: Cup) -> list[tuple[float, float]]:
    """Return the (radius, height above the rim) [m] of the profile's corners, from the foot's centre out, up, in and down."""
    floor = cup.bottom_thickness - cup.height
    return [
        (0.0, -cup.height),
        (cup.outer_radius, -cup.height),
        (cup.outer_radius, 0.0),
        (cup.inner_radius, 0.0),
        (cup.inner_radius, floor),
        (0.0, floor),
    ]


def cup_mesh(cup: Cup) -> Mesh:
    """Return the cup's surface as a Drake `Mesh` in the cup's frame C, round about its axis and sharp at its edges."""
    corners = cup_profile(cup)
    bands = [_band(*pair, 2 * N_SIDES * i) for i, pair in enumerate(pairwise(corners))]
    obj = MemoryFile("\n".join(bands), ".obj", "cup.obj")
    return Mesh(InMemoryMesh(mesh_file=obj))


def _band(start: tuple[float, float], end: tuple[float, float], n_before: int) -> str:
    """Return one turn of the profile's edge from `start` to `end` in the OBJ format, after `n_before` earlier vertices."""
    dr, dz = np.subtract(end, start) / np.hypot(*np.subtract(end, start))
    lines = []
    for angle in 2 * np.pi / N_SIDES * np.arange(N_SIDES):
        c, s = np.cos(angle), np.sin(angle)
        for radius, height in (start, end):
            lines.append(f"v {radius * c:.6f} {radius * s:.6f} {height:.6f}")
            lines.append(f"vn {dz * c:.6f} {dz * s:.6f} {-dr:.6f}")
    first = n_before + 1 + 2 * np.arange(N_SIDES)
    for here, there in zip(first, np.roll(first, -1), strict=True):
        quad = (here, there, there + 1, here + 1)
        lines += [f"f {a}//{a} {b}//{b} {c}//{c}" for a, b, c in (quad[:3], (quad[0], *quad[2:]))]
    return "\n".join(lines)
