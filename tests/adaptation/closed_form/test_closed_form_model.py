"""The closed form of casts against the batched engine, and as a predictor."""

import numpy as np
import pytest

import wam_cast as wc
from wam_cast.adaptation.closed_form.closed_form_model import ClosedFormModel, closed_form_casts, closed_form_std
from wam_cast.batch.engine import simulate_batch
from wam_cast.errors import InputError
from wam_cast.generation.sampling import sample_casts
from wam_cast.planning.prediction import ACROSS, ALONG, OUTPUTS, Predictor
from wam_cast.scenario import Scenario


@pytest.fixture(scope="module", name="model")
def _model():
    return ClosedFormModel.of(Scenario(), n_casts=150)


LABORATORIES = {
    "reference": {},
    "short string": {"string": {"length": 0.45}, "motion": {"drop_distance": 0.44}},
    "heavy ball": {"ball": {"mass": 0.1}},
    "hasty drop": {"motion": {"drop_duration": 0.35}},
    "soft gains": {"controller": {"kp": 3000.0, "kd": 180.0}},
    "on the floor": {
        "arm": {"mount": "floor", "mount_height": 0.0},
        "motion": {"start_radius": 0.40, "start_height": 0.85},
        "bounds": {"distance": [0.05, 0.33]},
    },
    "on a wall": {
        "arm": {"mount": "wall", "mount_height": 1.2},
        "motion": {"start_radius": 0.4, "start_height": 0.85},
        "bounds": {"distance": [0.05, 0.3]},
    },
}


@pytest.mark.slow
@pytest.mark.parametrize("name", LABORATORIES)
def test_landings_are_those_of_the_batched_engine_within_a_hundredth_of_the_string(name):
    scenario = Scenario.from_dict(LABORATORIES[name])
    casts = sample_casts(scenario, 32, seed=21)  # two chunks
    simulated, found = simulate_batch(scenario, casts), closed_form_casts(scenario, casts)
    assert (found["status"] == simulated["status"]).all()
    has_landed = simulated["landing_along"].notna()
    off = (found["landing_along"] - simulated["landing_along"])[has_landed] / scenario.string.length
    assert has_landed.all()
    assert np.sqrt(np.mean(off**2)) < 0.01
    for peak in ("peak_torque_utilization", "peak_velocity_utilization"):
        np.testing.assert_allclose(found[peak][has_landed], simulated[peak][has_landed], atol=0.02)


def test_an_ordinary_cast_lands_where_drake_has_it():
    scenario, cast = Scenario(), wc.Cast(distance=0.30, speed=0.60, wait=0.10)
    outcome = wc.simulate_cast(scenario, cast)
    (row,) = closed_form_casts(scenario, cast.to_array()[np.newaxis]).itertuples()
    assert row.status == outcome.status == "landed"
    assert row.landing_along == pytest.approx(outcome.landing_along, abs=0.006)
    assert row.landing_across == 0
    assert row.crossing_time == pytest.approx(outcome.crossing_time, abs=0.01)
    assert row.entry_speed == pytest.approx(outcome.entry_speed, abs=0.06)
    assert row.entry_angle == pytest.approx(outcome.entry_angle, abs=0.03)


def test_casts_that_the_arm_cannot_do_or_that_do_not_come_down_say_so():
    casts = np.array([[0.3, 0.6, 0.1]])
    hasty = Scenario.from_dict({"motion": {"drop_duration": 0.2}})
    assert closed_form_casts(hasty, casts)["status"].tolist() == ["limit_hit"]
    # The ball falls so slowly that the hold is over before it is down.
    slow = Scenario.from_dict({"gravity": 0.5, "motion": {"hold_duration": 0.01}})
    frame = closed_form_casts(slow, casts)
    assert frame["status"].tolist() == ["never_crossed"]
    assert frame[["landing_along", "landing_across", "slack"]].isna().all(axis=None)


def test_it_is_a_predictor_whose_gradients_are_those_of_its_predictions(model):
    assert isinstance(model, Predictor)
    scenario = model.scenario
    for cast in sample_casts(scenario, 5, seed=31):
        at = model.linearize(cast)
        np.testing.assert_allclose(at.outputs, model.predict(cast[np.newaxis])[0], rtol=1e-9)
        steps = 1e-5 * np.eye(3)
        outputs = [(model.predict((cast + h)[None]) - model.predict((cast - h)[None]))[0] / 2e-5 for h in steps]
        np.testing.assert_allclose(at.gradient, np.transpose(outputs), rtol=1e-3, atol=1e-4)
        stds = [(model.linearize(cast + h).std - model.linearize(cast - h).std) / 2e-5 for h in steps]
        np.testing.assert_allclose(at.std_gradient, stds, rtol=1e-3, atol=1e-6)
        landing, slope = model.landing_with_gradient(cast[np.newaxis])
        np.testing.assert_allclose([landing[0], *slope[0]], [at.outputs[ALONG], *at.gradient[ALONG]], rtol=1e-9)
        assert at.std > closed_form_std(scenario)
        assert at.outputs[ACROSS] == 0
    assert model.training_outputs.shape == (len(model.training_casts), len(OUTPUTS))


@pytest.mark.slow
def test_landings_of_the_shipped_dataset_are_within_its_standard_deviations():
    # Reference casts, none of which it has seen.
    data = wc.reference_dataset()
    model = ClosedFormModel.of(Scenario(), n_casts=400)
    rows = data.frame[data.frame["status"] == "landed"].iloc[::17]
    casts = rows[["distance", "speed", "wait"]].to_numpy()
    off = model.predict(casts)[:, ALONG] - rows["landing_along"].to_numpy()
    std = np.array([model.linearize(cast).std for cast in casts])
    assert np.sqrt(np.mean(off**2)) < 0.006
    assert 0.9 <= np.mean(np.abs(off) <= 2 * std) <= 0.99


def test_a_planned_cast_is_caught_before_any_was_made(model):
    cup = (0.65, 0.1)
    plan = wc.plan_cast(model, cup)
    assert plan.is_feasible
    assert wc.simulate_cast(Scenario(), plan.cast, cup=cup).is_caught


def test_too_few_casts_are_refused():
    with pytest.raises(InputError, match="too few"):
        ClosedFormModel.of(Scenario(), n_casts=10)
