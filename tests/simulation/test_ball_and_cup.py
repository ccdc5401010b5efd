"""Where the ball is about the cup, in closed form."""

import numpy as np
import pytest

from wam_cast.scenario import Cup, Scenario
from wam_cast.simulation.ball_and_cup import gap_to_contact, is_inside, possible_rise, touches_rim

CUP = Cup()
SCENARIO = Scenario()
R = 0.020
G = 9.81


def test_inside_ends_at_the_wall_and_at_the_rim():
    p_CL = np.array([[0.0, 0, -0.001], [0, 0, 0.001], [0.0299, 0, -0.05], [0.0301, 0, -0.05], [0.022, 0.022, -0.1]])
    np.testing.assert_array_equal(is_inside(p_CL, CUP), [True, False, True, False, False])


def test_ball_could_rise_by_its_kinetic_energy_above_where_it_is():
    lying = CUP.bottom_thickness + R - CUP.rim_height
    assert possible_rise(np.array([0.01, 0.0, lying]), 0.0, SCENARIO) == pytest.approx(0.0, abs=1e-15)
    assert possible_rise(np.array([0.01, 0.0, lying + 0.03]), 0.0, SCENARIO) == pytest.approx(0.03)
    # Thrown up at sqrt(2 g h), a ball rises by h.
    upward = np.sqrt(2 * G * 0.02)
    assert possible_rise(np.array([0.01, 0.0, lying]), upward, SCENARIO) == pytest.approx(0.02)
    assert possible_rise(np.array([0.01, 0.0, lying + 0.03]), upward, SCENARIO) == pytest.approx(0.05)


def test_rim_is_touched_at_a_balls_radius():
    middle = (CUP.inner_radius + CUP.outer_radius) / 2
    gaps = np.array([0.0, 4e-4, 6e-4, 0.01])
    above = np.column_stack([np.full(4, middle), np.zeros(4), R + gaps])
    np.testing.assert_array_equal(touches_rim(above, CUP, R), [True, True, False, False])
    diagonal = (R + gaps) / np.sqrt(2)
    outside = np.column_stack([np.zeros(4), -(CUP.outer_radius + diagonal), diagonal])
    np.testing.assert_array_equal(touches_rim(outside, CUP, R), [True, True, False, False])
    assert not touches_rim(np.array([0.0, 0.0, 0.001]), CUP, R)  # in the middle of the opening


def test_gap_to_contact_is_that_to_the_cups_outside_or_the_floor():
    scenario, at = Scenario(), np.array([0.5, 0.2, 0.0])
    outer = CUP.outer_radius
    gaps = {
        (outer + R + 0.01, 0.0, 0.10): 0.01,  # beside the wall
        (0.0, -(outer + R), 0.10): 0.0,  # at it
        (outer - 0.001, 0.0, CUP.rim_height + R + 0.02): 0.02,  # above the rim
        (0.0, 0.0, CUP.rim_height + R + 0.02): 0.02,  # above the opening
        (outer + 0.3, 0.0, CUP.rim_height + 0.4): 0.5 - R,  # from the rim's outer edge
        (-1.0, 0.0, R + 0.003): 0.003,  # above the floor
    }
    for offset, gap in gaps.items():
        assert gap_to_contact(at + offset, (0.5, 0.2), scenario) == pytest.approx(gap, abs=1e-12), offset
