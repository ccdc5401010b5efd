"""The casting plane's axes."""

import numpy as np
import pytest

from wam_cast.casting_plane import to_casting_plane


def test_casting_planes_axes_point_outward_and_to_the_left():
    assert to_casting_plane(np.array([0.3, 0.1]), 0.0) == pytest.approx((0.3, 0.1))
    assert to_casting_plane(np.array([0.0, 0.5]), np.pi / 2) == pytest.approx((0.5, 0.0))
    assert to_casting_plane(np.array([-0.1, 0.5]), np.pi / 2) == pytest.approx((0.5, 0.1))
