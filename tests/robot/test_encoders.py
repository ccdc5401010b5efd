"""The encoders: whole counts, of the right size, and no more than half a count off."""

import csv

import numpy as np
import pytest

from wam_cast.arm.arm_chain import arm_chain, encoder_resolution
from wam_cast.arm.arm_model import models_directory
from wam_cast.robot.encoders import Encoders
from wam_cast.scenario import Scenario

PERIOD = 0.002
RESOLUTION = np.array([4e-5, 5e-5, 9e-5, 8e-5, 1.6e-4, 1.6e-4, 1e-4])
UNIT = np.concatenate([RESOLUTION, RESOLUTION / PERIOD])


def measured(state):
    encoders = Encoders(RESOLUTION, PERIOD, np.zeros(7))
    context = encoders.CreateDefaultContext()
    encoders.get_input_port().FixValue(context, state)
    return encoders.get_output_port().Eval(context)


def test_resolution_is_a_count_over_the_gears():
    with (models_directory() / "wam7_parameters.csv").open(encoding="utf-8", newline="") as file:
        rows = [row for row in csv.DictReader(file) if row["joint_type"] == "revolute"]
    gears = np.array([float(row["gear_ratio"]) for row in rows])
    found = encoder_resolution(arm_chain(Scenario().arm), 4096)
    np.testing.assert_allclose(found, 2 * np.pi / (4096 * gears), rtol=1e-12)


@pytest.mark.parametrize("off", [0.0, 0.49, -0.49])
def test_state_less_than_half_a_count_off_is_measured_as_that_count(off):
    counts = np.array([0, 1, -1, 12345, -9876, 3, 8, 0, -1, 1, 20, -30, 400, 7])
    np.testing.assert_allclose(measured((counts + off) * UNIT), counts * UNIT, rtol=1e-12, atol=0)


def test_measured_state_is_at_most_half_a_count_off_and_as_often_too_large_as_too_small():
    rng = np.random.default_rng(0)
    states = rng.uniform(-1, 1, (400, 14)) * np.r_[np.full(7, 2.0), np.full(7, 5.0)]
    errors = np.array([measured(state) - state for state in states]) / UNIT
    assert np.abs(errors).max() <= 0.5 + 1e-9
    # Rounding errors are uniform: their mean is 0 and their standard deviation 1 / sqrt(12).
    assert np.abs(errors.mean(axis=0)).max() < 4 / np.sqrt(12 * len(states))
    np.testing.assert_allclose(errors.std(axis=0), 1 / np.sqrt(12), rtol=0.1)


def test_without_counts_angles_are_off_by_the_offset_and_speeds_exact():
    offset = 1e-3 * np.arange(1, 8)
    encoders = Encoders(encoder_resolution(arm_chain(Scenario().arm), 0), PERIOD, offset)
    context, state = encoders.CreateDefaultContext(), np.linspace(-1, 1, 14)
    encoders.get_input_port().FixValue(context, state)
    np.testing.assert_array_equal(encoders.get_output_port().Eval(context), state + np.r_[offset, np.zeros(7)])
    np.testing.assert_array_equal(encoders.get_input_port().Eval(context), state)
