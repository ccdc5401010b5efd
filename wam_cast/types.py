"""Types that all of the package shares."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
"""Real numbers; docstrings say of which shape and unit."""

Position = tuple[float, float]
"""World (x, y) on the floor [m], such as that of a cup's axis."""
