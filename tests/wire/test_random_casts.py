"""Random casts with cups, hits and clear misses: in one process, in lock step, and over a bad link in real time."""

import numpy as np
import pytest

from wam_cast.generation.sampling import sample_cast
from wam_cast.scenario import Scenario
from wam_cast.simulation.outcome import Status
from wam_cast.simulation.simulator import simulate_cast
from wam_cast.wire.stage import outcome_record

pytestmark = pytest.mark.slow

ASIDE = [(0.08, 0.0), (0.0, -0.08)]


@pytest.fixture(scope="module")
def in_one_process():
    """Return casts, cups and outcomes. Every fourth cup is clear of the landing: near the rim a millimetre may decide."""
    found = []
    for row in range(8):
        cast = sample_cast(Scenario(), 5, row)
        landing = simulate_cast(Scenario(), cast).landing
        cup = tuple((landing + (ASIDE[row // 4] if row % 4 == 3 else (0, 0))).tolist())
        found.append((cast, cup, simulate_cast(Scenario(), cast, cup)))
    assert sum(one.is_caught for _, _, one in found) == 6
    return found


def test_in_lock_step_they_are_the_same_bit_for_bit(in_one_process, lock_step):
    for cast, cup, one in in_one_process:
        assert repr(outcome_record(lock_step.controller.cast(cast, cup))) == repr(outcome_record(one))
    assert lock_step.refusals == []


def test_two_ms_and_a_lost_message_in_a_hundred_change_no_verdict(in_one_process, in_real_time):
    for cast, cup, one in in_one_process:
        in_real_time.link.delay, in_real_time.link.loss = 0.002, 0.01
        over_wire = in_real_time.controller.cast(cast, cup)
        assert over_wire.status is one.status
        assert np.linalg.norm(over_wire.landing - one.landing) < 2e-3 or one.status is not Status.CAUGHT
