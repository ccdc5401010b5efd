"""The batched engine against Drake: the same casts, the same rows."""

import numpy as np
import pandas as pd
import pytest

from wam_cast.batch import engine
from wam_cast.batch.engine import simulate_batch
from wam_cast.cast import Cast
from wam_cast.generation.sampling import sample_cast
from wam_cast.scenario import Noise, Scenario
from wam_cast.simulation.simulator import CastSimulator

pytestmark = pytest.mark.slow

TYPICAL = {"noise": Noise.typical().model_dump()}
NOISE = {"noise": TYPICAL["noise"] | {"encoder_counts": 0}}
"""In a turn rounding moves samples by 1e-16 s, and may so take an encoder to the next count."""
ROBOTS = (
    TYPICAL,
    NOISE,
    NOISE | {"controller": {"delay": 1, "kp": 3000.0, "kd": 150.0}},
    {
        "arm": {"coulomb_friction": 1.0, "encoder_offset": 0.01, "base_tilt": [0.01, 0.02], "torque_scale": 0.9},
        "simulation": {"max_step": 5e-4},
    },
    {"arm": {"knee_speed": 0.2}, "string": {"bending_stiffness": 1e-5}},
    {"controller": {"period": 0.004}, "simulation": {"max_step": 0.002}},
    {"arm": {"mount": "floor", "mount_height": 0.0}},
    # A light ball, for which the batched engine takes two steps a period where the scenario allows one.
    {"gravity": 5.0, "ball": {"mass": 0.010}, "string": {"length": 0.5}, "simulation": {"max_step": 0.001}},
    {
        "cup": {"rim_height": 0.02},
        "motion": {"drop_distance": 0.185, "hold_duration": 0.01},
    },  # the ball never comes down
    {"arm": {"torque_scale": 0.05}},  # motors saturate
)
BEARINGS = (0.0, 0.2, -0.3)
QUANTITIES = [
    *("landing_along", "landing_across", "crossing_time", "entry_speed", "entry_angle", "slack"),
    *("peak_torque_utilization", "peak_velocity_utilization", "peak_tracking_error"),
]


def by_drake(scenario, row, seed, belief=None):
    outcome = CastSimulator(scenario, belief).simulate(Cast(*row), noise_seed=seed)
    peaks = outcome.peak_torque_utilization.max(), outcome.peak_velocity_utilization.max()
    values = [getattr(outcome, name) for name in QUANTITIES[:6]]
    return dict(zip(QUANTITIES, [*values, *peaks, outcome.peak_tracking_error], strict=True)) | {
        "status": outcome.status.value,
        "is_slack": outcome.is_slack,
    }


def drawn(scenario, n):
    return [[*sample_cast(scenario, 3, i).to_array(), BEARINGS[i % 3]] for i in range(n)]


@pytest.fixture(scope="module")
def robots():
    scenarios = [Scenario.from_dict(robot) for robot in ROBOTS]
    rows = [drawn(scenario, i + 1)[i] for i, scenario in enumerate(scenarios)]
    return scenarios, rows, simulate_batch(scenarios, rows, range(len(rows)))


def test_rows_are_drakes_at_the_same_step_whatever_the_robot(robots, fixed_steps):
    scenarios, rows, frame = robots
    drake = pd.DataFrame([by_drake(*of_cast) for of_cast in zip(scenarios, rows, range(len(rows)), strict=True)])
    assert list(frame.status) == list(drake.status)
    assert {"landed", "never_crossed", "limit_hit"} <= set(drake.status)
    assert list(frame.is_slack) == list(drake.is_slack)
    np.testing.assert_allclose(frame[QUANTITIES], drake[QUANTITIES], rtol=0, atol=1e-8)


def test_a_cast_does_not_depend_on_the_others(robots):
    scenarios, rows, frame = robots
    reverse = simulate_batch(scenarios[::-1], rows[::-1], list(range(len(rows)))[::-1])
    np.testing.assert_array_equal(reverse[QUANTITIES].to_numpy()[::-1], frame[QUANTITIES].to_numpy())


def test_landings_are_those_of_drakes_own_steps_and_single_precision_serves():
    scenario = Scenario()
    rows = [row[:3] for row in drawn(scenario, 20)]
    frame, single = simulate_batch(scenario, rows), simulate_batch(scenario, rows, precision="float32")
    drake = pd.DataFrame([by_drake(scenario, row, 0) for row in rows])
    landing = ["landing_along", "landing_across"]
    off = np.linalg.norm(frame[landing] - drake[landing], axis=1)
    assert np.median(off) < 1e-6
    assert np.max(off) < 1e-5
    single_off = np.linalg.norm(single[landing] - frame[landing], axis=1)
    assert np.median(single_off) < 1e-5
    assert np.max(single_off) < 1e-4
    assert list(single.status) == list(frame.status) == list(drake.status)
    assert single.landing_along.dtype == np.float64


def test_truth_and_belief_are_two(fixed_steps):
    truth = Scenario.from_dict({"arm": {"mass_scale": 1.1}, "motion": {"start_height": 0.81}})
    row = [0.3, 0.6, 0.1, 0.2]
    expected = by_drake(truth, row, 0, Scenario())
    (found,) = simulate_batch(truth, [row], belief=Scenario()).to_dict("records")
    for name in QUANTITIES:
        assert found[name] == pytest.approx(expected[name], abs=1e-8)


def test_a_cast_that_diverges_is_simulated_in_finer_steps_and_says_so_if_they_do_not_help(monkeypatch):
    scenario = Scenario.from_dict({"string": {"bending_damping": 1e-5}})
    rows = [row[:3] for row in drawn(scenario, 6)]
    found = simulate_batch(scenario, rows)
    assert list(found.status) == ["landed"] * 6
    monkeypatch.setattr(engine, "STABLE_STEP", 1e3)  # for which a control period is one step
    again = simulate_batch(scenario, rows)
    np.testing.assert_allclose(again[QUANTITIES].to_numpy(), found[QUANTITIES].to_numpy(), rtol=0, atol=1e-6)
    monkeypatch.setattr(engine, "FINER", 1)
    never = simulate_batch(scenario, rows)
    assert list(never.status) == ["diverged"] * 6
    assert never[["landing_along", "landing_across", "entry_speed", "entry_angle"]].isna().all(axis=None)


@pytest.mark.parametrize("robot", [{}, TYPICAL])
def test_one_cast_alone_is_the_first_of_two(robot):
    scenario = Scenario.from_dict(robot)
    # With a turn they last about as long as those of `robots`: nothing is compiled for them.
    rows = [[*row[:3], -0.5] for row in drawn(scenario, 2)]
    alone, both = simulate_batch(scenario, rows[:1], [5]), simulate_batch(scenario, rows, [5, 6])
    np.testing.assert_array_equal(alone[QUANTITIES].to_numpy(), both[QUANTITIES].to_numpy()[:1])
