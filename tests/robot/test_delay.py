"""The delay line: which sample it gives when, and what it starts with."""

import numpy as np
import pytest
from pydrake.systems.analysis import Simulator

from wam_cast.robot.motors import delay_line, fill

SAMPLE = np.array([1.0, -2.0, 0.5, 4.0, 0.1, -0.3, 7.0])


@pytest.mark.parametrize("n_samples", [1, 3])
def test_line_gives_the_sample_of_so_many_before_the_next(n_samples):
    line = delay_line(n_samples, 0.002)
    simulator = Simulator(line)
    context = simulator.get_mutable_context()
    given = []
    for k in range(6):
        line.get_input_port().FixValue(context, k * SAMPLE)
        simulator.AdvanceTo(0.002 * k + 0.001)  # past the sample at 2 k ms
        given.append(line.get_output_port().Eval(context).copy())
    expected = [max(k - n_samples + 1, 0) * SAMPLE for k in range(6)]
    np.testing.assert_array_equal(given, expected)


def test_input_does_not_pass_through():
    assert not delay_line(1, 0.002).HasAnyDirectFeedthrough()


def test_filled_line_gives_its_torque_until_the_first_sample_comes_through():
    line = delay_line(3, 0.002)
    line.configure_default_state(fill(line, SAMPLE))
    simulator = Simulator(line)
    line.get_input_port().FixValue(simulator.get_mutable_context(), np.zeros(7))
    for time, expected in ((0.001, SAMPLE), (0.003, SAMPLE), (0.005, 0 * SAMPLE)):
        simulator.AdvanceTo(time)
        np.testing.assert_array_equal(line.get_output_port().Eval(simulator.get_context()), expected)
