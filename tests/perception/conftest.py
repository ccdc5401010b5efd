"""What the tests of perception share: a cast that was rendered once, and a ball drawn without a renderer."""

import numpy as np
import pytest

from wam_cast.cast import Cast
from wam_cast.perception.recorded_cast import observe_cast
from wam_cast.robot.plant import BALL_COLOR
from wam_cast.scenario import Cameras, Scenario
from wam_cast.simulation.simulator import CastSimulator

CAMERAS = Cameras(number=2, width=320, height=240, exposure=0.0, pixel_noise=0.01)
FLOOR = np.array([70.0, 70.0, 69.0])


@pytest.fixture(scope="session")
def seen_cast():
    """Return the recording of a cast into a cup, and what two small cameras saw of it."""
    recording = CastSimulator(Scenario(cameras=CAMERAS)).record(Cast(0.30, 0.60, 0.10), (0.608, 0.0), returns=False)
    return recording, observe_cast(recording, noise_seed=3)


@pytest.fixture
def draw_ball():
    """Return a function that draws a ball on a grey floor: each pixel a mixture by the area that the ball covers of it."""

    def draw(centre, radius=7.0, size=(40, 56), shade=lambda x, y: 1.0, background=FLOOR, hidden=lambda x, y: False):
        fine = 5
        row, column = (np.mgrid[0 : size[0] * fine, 0 : size[1] * fine] + 0.5) / fine
        x, y = (column - centre[0]) / radius, (row - centre[1]) / radius
        ball = 255 * np.array(BALL_COLOR[:3]) * np.broadcast_to(shade(x, y), x.shape)[..., np.newaxis]
        is_ball = (np.hypot(x, y) < 1) & ~np.broadcast_to(hidden(x, y), x.shape)
        image = np.where(is_ball[..., np.newaxis], ball, background)
        return image.reshape(size[0], fine, size[1], fine, 3).mean(axis=(1, 3))

    return draw
