"""Prediction: what a plan says of its cast, said of any cast and cup."""

import math

import numpy as np
import pytest

from wam_cast.learning.reference import reference_model
from wam_cast.parallel.threads import one_thread
from wam_cast.planning.cast_prediction import Prediction
from wam_cast.planning.landing_distribution import landing_std, rim_clear_probability, scatter_of_swing
from wam_cast.planning.plan import plan_cast
from wam_cast.planning.prediction import ENTRY_ANGLE
from wam_cast.scenario import Noise, Scenario

NOISE = Noise(distance=0.004, speed=0.01, wait=0.005, swing=0.002)


@pytest.fixture(scope="module")
def model():
    return reference_model().bound_to(Scenario().model_copy(update={"noise": NOISE}))


@pytest.fixture(scope="module")
def plan(model):
    """Return a plan for a cup beside the arm, so that the casting plane's axes are not the world's."""
    return plan_cast(model, (0.3, -0.6))


def test_of_a_plans_cast_and_cup_it_says_what_the_plan_does(model, plan):
    prediction = Prediction.of(model, plan.cast, plan.cup)
    np.testing.assert_allclose(prediction.landing, plan.predicted_landing, atol=1e-9)
    assert prediction.miss == pytest.approx(plan.predicted_miss, abs=1e-9)
    assert prediction.std == pytest.approx(plan.predicted_std, rel=1e-9)
    assert prediction.rim_clear_probability == pytest.approx(plan.rim_clear_probability, abs=1e-6)
    assert prediction.peak_torque_utilization == pytest.approx(plan.predicted_peak_torque_utilization)
    assert prediction.peak_velocity_utilization == pytest.approx(plan.predicted_peak_velocity_utilization)


def test_the_cast_that_is_aimed_at_a_cup_is_the_plans_and_so_is_all_that_is_said_of_it(model, plan):
    with one_thread():  # as the plan was made: sums depend on the number of threads
        prediction = Prediction.aimed(model, plan.cast.to_array(), plan.cup)
    assert prediction.cast == plan.cast
    np.testing.assert_array_equal(prediction.landing, plan.predicted_landing)
    assert prediction.miss == plan.predicted_miss
    assert prediction.std == plan.predicted_std
    assert prediction.entry_angle == plan.predicted_entry_angle
    assert prediction.entry_speed == plan.predicted_entry_speed
    assert prediction.slack == plan.predicted_slack
    assert prediction.peak_torque_utilization == plan.predicted_peak_torque_utilization
    assert prediction.peak_velocity_utilization == plan.predicted_peak_velocity_utilization
    assert prediction.rim_clear_probability == plan.rim_clear_probability


@pytest.mark.parametrize("cup", [(0.3, -0.6), (-0.4, 0.5), (0.0, 0.7)])
def test_a_cast_that_is_aimed_lands_on_the_line_from_the_base_axis_to_the_cup(model, cup):
    for parameters in model.training_casts[:5]:
        prediction = Prediction.aimed(model, parameters, cup)
        np.testing.assert_array_equal(prediction.cast.to_array(), parameters)
        landing = prediction.landing
        assert math.atan2(landing[1], landing[0]) == pytest.approx(math.atan2(cup[1], cup[0]), abs=1e-12)
        assert prediction.miss == pytest.approx(abs(math.hypot(*landing) - math.hypot(*cup)))
        # The same of the same cast, asked without aiming: only how the offset is computed differs.
        again = Prediction.of(model, prediction.cast, cup)
        np.testing.assert_array_equal(again.landing, landing)
        assert (again.miss, again.std) == (prediction.miss, prediction.std)
        assert again.rim_clear_probability == pytest.approx(prediction.rim_clear_probability, abs=1e-6)


def test_noise_of_the_scenario_raises_the_standard_deviation_and_lowers_the_probability(model, plan):
    noisy = Prediction.of(model, plan.cast, plan.cup)
    exact = Prediction.of(reference_model(), plan.cast, plan.cup)
    np.testing.assert_array_equal(noisy.landing, exact.landing)
    swing = scatter_of_swing(model.scenario, NOISE, plan.predicted_entry_speed)
    assert noisy.std.across == pytest.approx(swing.across)
    assert exact.std.across == 0
    assert noisy.std.along > math.hypot(exact.std.along, swing.along)
    assert noisy.rim_clear_probability < exact.rim_clear_probability - 0.01


@pytest.mark.parametrize(("along", "across"), [(0.004, 0.0), (-0.004, 0.0), (0.0, 0.004), (0.0, -0.004)])
def test_of_a_cup_beside_the_landing_the_probability_is_that_of_the_offset_in_the_casting_plane(
    model, plan, along, across
):
    c, s = math.cos(plan.cast.bearing), math.sin(plan.cast.bearing)
    # The ball lands beyond the cup by `along` and to its left by `across`.
    x, y = plan.predicted_landing - [c * along - s * across, s * along + c * across]
    prediction = Prediction.of(model, plan.cast, (x, y))
    parameters = plan.cast.to_array()
    entry_angle = model.predict(parameters[np.newaxis])[0, ENTRY_ANGLE]
    std = landing_std(model, parameters, NOISE)

    def probability(*offset):
        return rim_clear_probability(model.scenario, entry_angle, offset, std)

    assert abs(probability(along, across) - probability(across, along)) > 0.01, "the two directions can be told apart"
    assert prediction.rim_clear_probability == pytest.approx(probability(along, across), abs=1e-6)
    assert prediction.miss == pytest.approx(0.004)
    np.testing.assert_allclose(prediction.landing, plan.predicted_landing, atol=1e-9)
