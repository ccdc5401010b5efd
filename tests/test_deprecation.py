"""Names that were changed: the old one gives the same, and a warning that names the new one."""

import numpy as np
import pytest

import wam_cast as wc

CAST = np.array([[0.3, 0.6, 0.1]])


@pytest.fixture(scope="module")
def model():
    return wc.reference_model()


@pytest.fixture(scope="module")
def plan(model):
    return wc.plan_cast(model, (0.6, 0.1), "gradient")


@pytest.mark.parametrize(
    ("old", "new"),
    [
        ("predicted_spread", "predicted_std"),
        ("predicted_peak_load", "predicted_peak_torque_utilization"),
        ("predicted_peak_speed", "predicted_peak_velocity_utilization"),
        ("clear_entry_probability", "rim_clear_probability"),
    ],
)
def test_a_plans_old_names(plan, old, new):
    with pytest.warns(DeprecationWarning, match=f"Plan.{old} is now {new}"):
        assert getattr(plan, old) == getattr(plan, new)


@pytest.mark.parametrize(
    ("old", "new"), [("peak_load", "peak_torque_utilization"), ("peak_speed", "peak_velocity_utilization")]
)
def test_an_outcomes_old_names(simulator, old, new):
    outcome = simulator.simulate(wc.Cast(0.3, 0.6, 0.1))
    with pytest.warns(DeprecationWarning, match=f"Outcome.{old} is now {new}"):
        np.testing.assert_array_equal(getattr(outcome, old), getattr(outcome, new))


@pytest.mark.parametrize(("old", "new"), [("known_casts", "training_casts"), ("known_outputs", "training_outputs")])
def test_a_models_old_names(model, old, new):
    with pytest.warns(DeprecationWarning, match=f"ForwardModel.{old} is now {new}"):
        assert getattr(model, old) is getattr(model, new)


def test_a_models_old_method(model):
    with pytest.warns(DeprecationWarning, match="ForwardModel.expand is now linearize"):
        old = model.expand(CAST[0])
    for was, now in zip(old, model.linearize(CAST[0]), strict=True):
        np.testing.assert_array_equal(was, now)


@pytest.mark.parametrize("old", ["expand", "predict_with_gradient"])
def test_an_estimators_old_methods(old):
    X = np.linspace(0, 2, 20).reshape(-1, 1)
    ridge = wc.KernelRidge(sigma=0.5).fit(X, np.sin(X[:, 0]))
    with pytest.warns(DeprecationWarning, match=f"KernelRidge.{old} is now linearize"):
        method = getattr(ridge, old)
    for was, now in zip(method([[1.0]]), ridge.linearize([[1.0]]), strict=True):
        np.testing.assert_array_equal(was, now)
    with pytest.warns(DeprecationWarning, match="linearize"):
        np.testing.assert_array_equal(ridge.predict_gradient([[1.0]]), ridge.linearize([[1.0]])[1])
