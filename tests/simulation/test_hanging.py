"""Casts into cups where they land: whether the ball comes to rest or hangs is what the tether says."""

import pytest

from wam_cast.cast import Cast
from wam_cast.scenario import Ball, Scenario, String
from wam_cast.simulation.outcome import Status
from wam_cast.simulation.simulator import simulate_cast

SHORT = Scenario.from_dict({"string": {"length": 0.40}})

# A scenario that is read is refused where no cup can be served.
TOO_SHORT = Scenario().model_copy(update={"string": String(length=0.30), "ball": Ball(mass=0.021)})

FREE = [(0.191, 0.692, 0.016), (0.205, 0.267, 0.436), (0.288, 0.729, 0.030)]
HANGING = [(0.302, 0.655, 0.319), (0.392, 0.381, 0.427)]
"""Distance, speed and wait of casts with the short string: the hand ends too near to the base axis for the cup, or too far."""


def outcome_where_it_lands(scenario, cast):
    landing = simulate_cast(scenario, cast).landing_along
    return landing, simulate_cast(scenario, cast, (landing, 0.0))


@pytest.mark.slow
@pytest.mark.parametrize(("casts", "is_free"), [(FREE, True), (HANGING, False)])
def test_a_ball_rests_in_the_cups_that_the_tether_leaves_it_free_in_and_hangs_in_others(casts, is_free):
    for parameters in casts:
        landing, outcome = outcome_where_it_lands(SHORT, Cast(*parameters))
        # By more than the margin.
        apart = abs(SHORT.motion.start_radius + parameters[0] - landing) - SHORT.tether.span
        assert apart < -0.02 if is_free else apart > 0.02
        assert outcome.status is (Status.CAUGHT if is_free else Status.HANGING), parameters


@pytest.mark.slow
@pytest.mark.parametrize("parameters", [(0.191, 0.692, 0.016), (0.108, 0.330, 0.105)])
def test_a_string_too_short_for_any_cup_leaves_the_ball_hanging_in_every_cup(parameters):
    landing, outcome = outcome_where_it_lands(TOO_SHORT, Cast(*parameters))
    assert outcome.miss < 0.01
    assert outcome.status is Status.HANGING
    assert not TOO_SHORT.tether.leaves_free(parameters[0], landing)
