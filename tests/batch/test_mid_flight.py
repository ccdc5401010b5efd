"""Casts that the batched engine begins and Drake ends, against Drake's alone."""

import numpy as np
import pytest

from wam_cast.batch.mid_flight import HAND_OVER, states_before_landing
from wam_cast.cast import Cast
from wam_cast.motion.polling import POLL_PERIODS
from wam_cast.motion.turn import turn_duration
from wam_cast.scenario import Scenario
from wam_cast.simulation.outcome import Status
from wam_cast.simulation.simulator import CastSimulator

pytestmark = pytest.mark.slow

ROBOT = Scenario.from_dict(
    {
        "noise": {"distance": 0.002, "speed": 0.01, "wait": 0.002, "swing": 0.005, "torque": 0.002},
        "controller": {"delay": 1, "kp": 3000.0, "kd": 150.0},
        "arm": {"knee_speed": 0.4, "coulomb_friction": 0.3, "encoder_offset": 0.005, "torque_scale": 0.95},
    }
)
# With the turn they last about as long as those of test_engine.py: less is compiled for them.
CASTS = [Cast(0.2, 0.8, 0.1, bearing=0.3), Cast(0.3, 0.9, 0.05), Cast(0.25, 0.8, 0.2), Cast(0.3, 4.0, 0.0)]
SEEDS = [7, 8, 2**70, 9]


def test_drake_goes_on_as_if_it_had_begun(fixed_steps):
    simulator, statuses = CastSimulator(ROBOT), []
    *states, of_none = states_before_landing(ROBOT, CASTS, SEEDS)
    assert of_none is None  # that one meets a limit
    assert simulator.simulate(CASTS[-1], noise_seed=SEEDS[-1]).status is Status.LIMIT_HIT
    for cast, seed, state, beside in zip(CASTS, SEEDS, states, (0.0, 0.03, 0.08), strict=False):
        free = simulator.simulate(cast, noise_seed=seed)
        cup = (free.landing[0], free.landing[1] + beside)
        whole, rest = (
            simulator.simulate(cast, cup, noise_seed=seed),
            simulator.simulate_on(cast, cup, state, noise_seed=seed),
        )
        assert rest.landing == pytest.approx(whole.landing, abs=1e-7)
        assert rest.entry_velocity == pytest.approx(whole.entry_velocity, abs=1e-5)
        assert rest.crossing_time == pytest.approx(whole.crossing_time, abs=1e-7)
        assert rest.status is whole.status
        assert rest.miss == pytest.approx(beside, abs=1e-7)
        assert not rest.limits_hit
        assert np.all(rest.peak_torque_utilization <= whole.peak_torque_utilization + 1e-6)
        handed_over = turn_duration(ROBOT, cast.bearing) + whole.crossing_time - HAND_OVER
        assert 0 <= handed_over - state.time < POLL_PERIODS * ROBOT.controller.period
        statuses.append(rest.status)
    assert statuses == [Status.CAUGHT, Status.RIM_BOUNCE, Status.SIDE]
