"""The shutter: what it makes of the pictures of a perfect camera."""

import numpy as np
import pytest
from pydrake.common.value import Value
from pydrake.systems.analysis import Simulator
from pydrake.systems.framework import DiagramBuilder, LeafSystem
from pydrake.systems.sensors import ImageRgba8U

from wam_cast.perception.shutter import Shutter
from wam_cast.scenario import Cameras

RATE, START = 50.0, 0.1
LATER = 1e-6
"""What happens at a time is done when a simulator goes on from there [s]."""


class Clock(LeafSystem):
    """Shows the time: everything is 100 counts brighter a second, in tenths of a second; its right half is grey."""

    def __init__(self, size):
        super().__init__()
        self.DeclareAbstractOutputPort("color_image", lambda: Value(ImageRgba8U(*size)), self._show)

    def _show(self, context, output):
        data = output.get_mutable_value().mutable_data
        data[...] = round(10000 * context.get_time()) % 256
        data[:, data.shape[1] // 2 :] = 120


def pictures(cameras, times, which=0, seed=0):
    builder = DiagramBuilder()
    clock = builder.AddSystem(Clock((cameras.width, cameras.height)))
    shutter = builder.AddSystem(Shutter(cameras, which, START))
    builder.Connect(clock.get_output_port(), shutter.get_input_port())
    simulator, seen = Simulator(builder.Build()), []
    shutter.set_seed(shutter.GetMyMutableContextFromRoot(simulator.get_mutable_context()), seed)
    for time in times:
        simulator.AdvanceTo(time)
        port = shutter.get_output_port()
        seen.append(port.Eval(shutter.GetMyContextFromRoot(simulator.get_context())).data.astype(float))
    return seen


def cameras(**values):
    return Cameras(number=2, width=64, height=32, frame_rate=RATE, **{"exposure": 0.0, "pixel_noise": 0.0} | values)


def test_a_picture_is_of_its_time_and_stays_until_the_next():
    first, later, second = pictures(cameras(), [START + LATER, START + 0.9 / RATE, START + 1 / RATE + LATER])
    assert (first[:, :32, :3] == 1000 % 256).all()
    assert (first[..., 3] == 255).all()
    np.testing.assert_array_equal(later, first)
    assert (second[:, :32, :3] == 1200 % 256).all()


def test_an_exposure_is_the_mean_of_what_is_seen_while_the_shutter_is_open():
    # Five pictures a millisecond apart, about the same middle; of three of them the mean is not there yet.
    blurred, sharp = (pictures(cameras(exposure=exposure), [START + 0.003])[0] for exposure in (0.005, 0.0))
    np.testing.assert_array_equal(blurred, sharp)
    open_still = pictures(cameras(exposure=0.005), [START + LATER])[0]
    assert (open_still[:, :32, :3] == round((980 % 256 + 990 % 256 + 1000 % 256) / 5)).all()


@pytest.mark.parametrize("noise", [0.01, 0.03])
def test_noise_has_its_standard_deviation_and_repeats_with_its_seed(noise):
    times = [START + LATER, START + 1 / RATE + LATER]
    seen = pictures(cameras(pixel_noise=noise), times)
    grey = seen[0][:, 32:, :3]
    assert grey.std() == pytest.approx(255 * noise, rel=0.05)
    assert grey.mean() == pytest.approx(120, abs=0.6)
    np.testing.assert_array_equal(seen, pictures(cameras(pixel_noise=noise), times))
    others = [
        seen[1],
        pictures(cameras(pixel_noise=noise), times, which=1)[0],
        pictures(cameras(pixel_noise=noise), times, seed=1)[0],
    ]
    assert all(abs(np.corrcoef(other[:, 32:, :3].ravel(), grey.ravel())[0, 1]) < 0.05 for other in others)
