"""The cup that is seen has the shape of the one that is hit."""

import numpy as np
import pytest
from pydrake.geometry import CalcVolume

from wam_cast.robot.cup_mesh import N_SIDES, cup_mesh
from wam_cast.scenario import Cup


@pytest.mark.parametrize(
    "cup", [Cup(), Cup(rim_height=0.2, inner_radius=0.04, wall_thickness=0.01)], ids=["default", "large"]
)
def test_mesh_is_closed_faces_outward_and_has_the_cups_volume(cup):
    hollow = cup.inner_radius**2 * (cup.rim_height - cup.bottom_thickness)
    squares = cup.outer_radius**2 * cup.rim_height - hollow
    polygon_area = N_SIDES / 2 * np.sin(2 * np.pi / N_SIDES)
    assert CalcVolume(cup_mesh(cup)) == pytest.approx(polygon_area * squares, rel=1e-3)
