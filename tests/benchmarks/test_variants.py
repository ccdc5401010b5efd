"""The ablation: each term is left out once, over the same cups and the same noise."""

import math
from types import SimpleNamespace

import numpy as np
import pandas as pd
import pytest
from planners import variants as module
from planners.variants import VARIANTS, ablate, summarize

from wam_cast.experiments.trials import draw_cups, trial_row
from wam_cast.planning.program import TERMS
from wam_cast.planning.reach import Reach
from wam_cast.scenario import Scenario
from wam_cast.simulation.outcome import Status


class Model:
    scenario, reach = Scenario(), (0.4, 0.8)


@pytest.fixture
def told(monkeypatch):
    """Replace planner and simulation; return what they were asked."""
    plans, trials = [], []

    def plan(model, radius, *, without):
        plans.append((radius, without))
        return SimpleNamespace(parameters=np.array([0.3, 0.6, 0.1 + 0.01 * len(without)]))

    def run(scenario, all_trials, executor, *, report):
        trials.extend(all_trials)
        report(len(all_trials))
        rows = [trial_row(scenario, one, outcome(one, i)) for i, one in enumerate(all_trials)]
        return pd.DataFrame(rows)

    monkeypatch.setattr(module, "plan_by_program", plan)
    monkeypatch.setattr(module, "execute", run)
    return plans, trials


def outcome(trial, i):
    # Whatever is left out costs 5 mm, and every fourth cast diverges.
    without = round((trial.cast.wait - 0.1) / 0.01)
    if i % 4 == 3:
        return SimpleNamespace(
            landing=np.full(2, np.nan),
            landing_along=math.nan,
            landing_across=math.nan,
            miss=math.nan,
            entry_angle=math.nan,
            is_caught=False,
            status=Status.DIVERGED,
            limits_hit=(),
            is_slack=False,
            slack=math.nan,
            peak_torque_utilization=np.full(7, math.nan),
            peak_velocity_utilization=np.full(7, math.nan),
        )
    return SimpleNamespace(
        landing=np.array([trial.cup[0] + 0.005 * without, 0.0]),
        landing_along=trial.cup[0] + 0.005 * without,
        landing_across=0.0,
        miss=0.005 * without,
        entry_angle=0.1,
        is_caught=without < 2,
        status=Status.CAUGHT if without < 2 else Status.LONG,
        limits_hit=("joint 4 speed",) if without else (),
        is_slack=without == 0,
        slack=0.02 - 0.003 * without,
        peak_torque_utilization=np.full(7, 0.3),
        peak_velocity_utilization=np.full(7, 0.5 + 0.1 * without),
    )


def test_each_term_is_left_out_once_over_the_same_cups_and_noise(told):
    plans, trials = told
    found = ablate(Model(), 4, seed=2, executor=None, report=lambda *_: None)
    assert found["label"].unique().tolist() == ["nothing", *TERMS, "all of them"]
    assert list(VARIANTS.values()) == [(), *((term,) for term in TERMS), TERMS]
    cups = draw_cups(Reach.of(Model()), 4, 2)
    assert plans == [(cup[0], without) for without in VARIANTS.values() for cup in cups]
    seeds = [trial.noise_seed for trial in trials]
    assert seeds == seeds[:4] * len(VARIANTS)
    assert len(set(seeds[:4])) == 4


def test_rows_say_what_became_of_the_plans(told):
    found = ablate(Model(), 4, seed=2, executor=None, report=lambda *_: None)
    first, last = (summarize(found[found["label"] == label]) for label in ("nothing", "all of them"))
    assert (first["n_cups"], first["n_caught"], first["n_clear"]) == (4, 3, 3)
    assert (first["n_limit_hits"], first["n_taut"], first["executed_miss"]["max"]) == (0, 0, 0.0)
    assert (first["least_slack"], first["largest_utilization"]) == pytest.approx((0.02, 0.5))
    assert (last["n_caught"], last["n_clear"], last["n_limit_hits"], last["n_taut"]) == (0, 0, 3, 3)
    assert last["executed_miss"]["median"] == pytest.approx(0.005 * len(TERMS))
    assert last["largest_utilization"] == pytest.approx(0.5 + 0.1 * len(TERMS))


def test_progress_goes_from_none_to_all(told):
    steps = []
    ablate(Model(), 3, executor=None, report=lambda done, n: steps.append((done, n)))
    n = 2 * 3 * len(VARIANTS)
    assert steps[0] == (0, n)
    assert steps[-1] == (n, n)
    assert all(math.isclose(total, n) for _, total in steps)
