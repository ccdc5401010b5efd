"""The judge on made-up logs: limits of the joints, and the string at the landing."""

import numpy as np
import pytest
from pydrake.multibody.plant import MultibodyPlant

from wam_cast.cast import Cast
from wam_cast.motion.stages import CastMotion
from wam_cast.robot.plant import N_ARM, fill_plant, hanging_positions, make_arm_plant, starting_posture
from wam_cast.scenario import Scenario
from wam_cast.simulation.judging import Judge, Log
from wam_cast.simulation.run import Run

ABOVE = 0.01
"""How far above a ball in a taut string the rim plane is [m]: less than the ball's radius."""


@pytest.fixture(scope="module")
def scenario():
    """Return one whose hand starts where a drop would take it: a scenario that is read must begin with the ball above the rim."""
    motion, string, cup = Scenario().motion, Scenario().string, Scenario().cup
    rim_height = motion.start_height - string.length + ABOVE
    return Scenario().model_copy(update={"cup": cup.model_copy(update={"rim_height": rim_height})})


@pytest.fixture(scope="module")
def plant(scenario):
    plant = MultibodyPlant(time_step=0.0)
    fill_plant(plant, scenario)
    return plant


@pytest.fixture(scope="module")
def hanging(plant, scenario):
    return hanging_positions(plant, starting_posture(make_arm_plant(scenario), scenario))


def log_of(plant, positions, velocities=None):
    """Return a log of motors at rest with one sample every 10 ms, for positions of shape (n, n_q)."""
    n = len(positions)
    if velocities is None:
        velocities = np.zeros((n, plant.num_velocities()))
    return Log(0.01 * np.arange(n), np.hstack([positions, velocities]), np.zeros((n, N_ARM)))


@pytest.mark.parametrize("joint", range(N_ARM))
def test_each_joint_has_a_stop_at_either_end_of_its_range(plant, scenario, hanging, joint):
    judge = Judge(scenario, plant)
    for stops, outward in ((plant.GetPositionLowerLimits(), -1), (plant.GetPositionUpperLimits(), 1)):
        positions = np.tile(hanging, (3, 1))
        positions[1, joint] = stops[joint] - 1e-3 * outward
        assert judge.limits_hit(log_of(plant, positions)) == ()
        positions[1, joint] = stops[joint] + 1e-3 * outward
        assert judge.limits_hit(log_of(plant, positions)) == (f"joint {joint + 1} position",)


def unfolding(plant, scenario, hanging, fold, fold_rate):
    """Return a log of a string bent in its middle, by angles shape (n,), below a hand at rest: the ball stays right below it.

    Hand and ball are then the string's length times the angle's cosine apart.
    """
    middle = N_ARM + 2 * (scenario.string.n_links // 2)
    positions, velocities = np.tile(hanging, (len(fold), 1)), np.zeros((len(fold), plant.num_velocities()))
    for values, angle in ((positions, fold), (velocities, fold_rate)):
        values[:, N_ARM] += angle
        values[:, middle] -= 2 * angle
    return log_of(plant, positions, velocities)


def test_string_is_slack_by_its_state_at_the_landing_whatever_it_is_afterwards(plant, scenario, hanging):
    cast, length = Cast(0.3, 0.6, 0.1), scenario.string.length
    run = Run(cast, None, 0, CastMotion(scenario, cast), None)
    time = 0.01 * np.arange(41)
    # It unfolds as the ball comes down: shorter by ABOVE at the rim plane, taut before the ball is all below it.
    log = unfolding(plant, scenario, hanging, 1.25 * (0.4 - time), np.full(41, -1.25))
    outcome = Judge(scenario, plant).outcome(run, log, log)
    assert outcome.limits_hit == ()
    assert outcome.crossing_time == pytest.approx(0.4 - np.arccos(1 - ABOVE / length) / 1.25, abs=1e-6)
    np.testing.assert_allclose(outcome.landing, [scenario.motion.start_radius, 0.0], atol=1e-9)
    assert outcome.is_slack
    assert outcome.slack == pytest.approx(0.0, abs=1e-6)
