"""From plans to hit rates and failures."""

import numpy as np
import pytest

import wam_cast as wc
from wam_cast.experiments.paper import execution
from wam_cast.experiments.paper.execution import Thrower, execute_plans, make_trial, summarize
from wam_cast.experiments.paper.report import explain
from wam_cast.experiments.paper.results import Trial
from wam_cast.parallel.workers import Workers


def trial(**changes):
    values = {
        "cup": 0.6,
        "distance": 0.3,
        "speed": 0.5,
        "wait": 0.1,
        "is_feasible": True,
        "predicted_offset": 0.006,
        "predicted_miss": 0.006,
        "executed_offset": 0.014,
        "executed_across": 0.002,
        "executed_miss": 0.014,
        "entry_angle": 0.5,
        "status": "rim_bounce",
        "limits_hit": (),
    }
    return Trial(**values | changes)


def test_summary_counts_failures_by_kind():
    caught = trial(status="caught", executed_miss=0.004)
    lucky = trial(status="caught", is_feasible=False, executed_miss=0.012)
    trials = [caught, lucky, trial(), trial(status="short"), trial(status="long", is_feasible=False)]
    found = summarize("label", "gradient", 0.01, trials)
    assert (found.n_cups, found.n_caught, found.hit_rate) == (5, 2, 0.4)
    assert found.failures == {"long": 1, "rim_bounce": 1, "short": 1}
    assert sum(found.failures.values()) == found.n_cups - found.n_caught
    assert (found.n_no_plan, found.n_no_plan_caught) == (2, 1)
    assert found.n_touched == 1  # the lucky one


def test_misses_are_those_of_the_trials():
    found = summarize("label", "gradient", 0.01, [trial(executed_miss=m) for m in (0.001, 0.002, 0.006)])
    assert found.executed_miss.mean == pytest.approx(0.003)
    assert found.executed_miss.median == pytest.approx(0.002)
    assert found.predicted_miss.max == pytest.approx(0.006)


def test_a_trial_is_its_plan_and_its_outcome():
    model = wc.reference_model()
    plan = wc.plan_cast(model, (0.6, 0.0), "gradient")
    outcome = wc.simulate_cast(wc.Scenario(), plan.cast, plan.cup)
    made = make_trial(plan, outcome)
    assert made.predicted_miss == plan.predicted_miss
    assert abs(made.predicted_offset) == pytest.approx(plan.predicted_miss, abs=1e-6)
    assert made.executed_miss == outcome.miss
    assert abs(made.executed_offset) == pytest.approx(outcome.miss, abs=1e-5)
    assert made.status == "caught"


def test_a_lost_process_is_a_failure():
    plan = wc.plan_cast(wc.reference_model(), (0.6, 0.0), "gradient")
    made = make_trial(plan, None)
    assert made.failure == "diverged"
    assert made.executed_miss is None


def test_cups_lie_evenly_over_the_reach(no_physics):
    model = wc.reference_model()
    throwers = [Thrower("a", "gradient", model), Thrower("b", "program", model)]
    seen = []
    found = execute_plans(
        wc.Scenario(), throwers, 6, executor=Workers(), report=lambda *done: seen.append(done)
    )
    assert [one.label for one in found] == ["a", "b"]
    for one in found:
        cups = np.array([trial.cup for trial in one.trials])
        assert cups[[0, -1]] == pytest.approx(model.reach)
        assert np.diff(cups) == pytest.approx(np.diff(cups)[0])
    assert found[0].trials[2].cup == found[1].trials[2].cup
    assert seen == [(done, 24) for done in range(25)]  # plans, then casts


def test_every_cup_has_noise_of_its_own_and_every_thrower_the_same(no_physics, monkeypatch):
    seeds, without_physics = [], execution.simulate_cast

    def outcome(*args, noise_seed):
        seeds.append(noise_seed)
        return without_physics(*args)

    monkeypatch.setattr(execution, "simulate_cast", outcome)
    throwers = [Thrower(name, "gradient", wc.reference_model()) for name in "ab"]
    execute_plans(wc.Scenario(), throwers, 3, seed=7, executor=Workers(), report=lambda *_: None)
    assert seeds[:3] == seeds[3:]
    assert len(set(seeds)) == 3
    first, seeds[:] = seeds[:], []
    execute_plans(wc.Scenario(), throwers, 3, seed=8, executor=Workers(), report=lambda *_: None)
    assert not set(first) & set(seeds)


def test_explanation_adds_up():
    text = explain(trial(), wc.Scenario())
    assert "+6.0 mm" in text  # the plan
    assert "+8.0 mm along" in text  # the model
    assert "+2.0 mm across" in text
    assert "14.0 mm from the middle" in text  # all of it
    assert "29°" in text
    assert "clear the rim by 10 mm" in text


def test_explanation_names_what_else_went_wrong():
    scenario = wc.Scenario()
    assert "joint 4 speed" in explain(trial(limits_hit=("joint 4 speed",)), scenario)
    assert "found no cast within 10 mm" in explain(trial(is_feasible=False, predicted_miss=0.02), scenario)
    nowhere = {"executed_offset": None, "executed_across": None, "executed_miss": None}
    assert "never came down" in explain(trial(**nowhere), scenario)
    broken = trial(status="diverged", limits_hit=("joint 2 speed",), **nowhere)
    assert explain(broken, scenario) == "its numbers left all bounds"
