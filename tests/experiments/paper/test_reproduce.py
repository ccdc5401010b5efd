"""The experiment as a whole: what it promises about its split, its resumption and its numbers."""

import json
import math
from contextlib import contextmanager
from types import SimpleNamespace

import numpy as np
import pandas as pd
import pytest
from threadpoolctl import threadpool_limits

import wam_cast as wc
from wam_cast.cast import PARAMETERS
from wam_cast.experiments.frames import to_plain
from wam_cast.experiments.paper import comparison, selection
from wam_cast.experiments.paper import reproduce as run
from wam_cast.experiments.paper.report_figures import CAPTIONS
from wam_cast.learning.parts import Parts
from wam_cast.planning.prediction import OUTPUTS

PHASES = ("describe_samples", "select_models", "compare", "learn_with_fewer_casts")
"""That take the split."""


@pytest.fixture(scope="module")
def watched(tmp_path_factory, without_physics):
    """Return the findings of a run of seed 2 without physics and without its report, and what was seen of it."""
    seen = SimpleNamespace(progress={}, order=[], parts=[], limits=[])

    def noted(owner, name, note):
        function = getattr(owner, name)
        patch.setattr(owner, name, lambda *args: note(*args) or function(*args))

    def report(title, done, total):
        if title not in seen.progress:
            seen.limits.append(title)
        seen.progress.setdefault(title, []).append((done, total))

    @contextmanager
    def limits(number):
        seen.limits.append(number)
        with threadpool_limits(number):
            yield
        seen.limits.append("end")

    with without_physics() as patch:
        patch.setattr(run, "write_report", lambda *_: None)
        patch.setattr(run, "draw_figures", lambda *_: seen.limits.append("drawing") or iter(CAPTIONS))
        patch.setattr(run, "threadpool_limits", limits)
        noted(Parts, "open_test", lambda _: seen.order.append("open"))
        noted(comparison, "_fit", lambda *_: seen.order.append("fit"))
        for name in PHASES:
            noted(
                run, name, lambda *args, name=name: seen.parts.extend((name, a) for a in args if isinstance(a, Parts))
            )
        folder = tmp_path_factory.mktemp("watched") / "run"
        seen.findings = run.reproduce(wc.Scenario(), folder, quick=True, seed=2, on_progress=report)
    return seen


def numbers(findings):
    """Return all numbers but those that a clock made."""

    def without_times(value):
        if isinstance(value, dict):
            return {k: without_times(v) for k, v in value.items() if k not in ("fit_s", "predict_us")}
        if isinstance(value, list):
            return [without_times(item) for item in value]
        return value

    content = findings.to_json({})
    return without_times(json.loads(json.dumps(content)))


@pytest.mark.slow
def test_an_interrupted_run_goes_on_and_finds_the_same_and_another_seed_finds_others(
    finished, watched, no_physics, monkeypatch, tmp_path
):
    def interrupt(title, done, _):
        if title == "execution" and done == 2:
            raise KeyboardInterrupt

    def reproduce(on_progress):
        return run.reproduce(wc.Scenario(), tmp_path / "cut", quick=True, on_progress=on_progress)

    monkeypatch.setattr(run, "write_report", lambda *_: None)
    monkeypatch.setattr(run, "draw_figures", lambda *_: iter(CAPTIONS))
    with pytest.raises(KeyboardInterrupt):
        reproduce(interrupt)
    seen = set()
    whole = reproduce(lambda title, *_: seen.add(title))
    assert numbers(whole) == numbers(finished[0])
    assert numbers(watched.findings)["samples"]["distance"] != numbers(whole)["samples"]["distance"]
    assert "casts" not in seen  # finished before
    assert "comparison" not in seen
    assert "execution" in seen


def test_a_finished_run_computes_nothing_again(no_physics, finished, monkeypatch):
    findings, folder = finished
    monkeypatch.setattr(run, "write_report", lambda *_: None)
    monkeypatch.setattr(run, "draw_figures", lambda *_: iter(CAPTIONS))
    seen = set()
    again = run.reproduce(wc.Scenario(), folder, quick=True, on_progress=lambda title, *_: seen.add(title))
    assert seen == {"figures"}
    assert again.to_json({}) == findings.to_json({})


@pytest.mark.slow
def test_every_phase_reports_from_none_to_all(watched):
    for title, steps in watched.progress.items():
        dones = [done for done, _ in steps]
        assert dones == sorted(dones), title
        assert dones[-1] == steps[-1][1], title
        assert len({total for _, total in steps}) == 1, title


@pytest.mark.slow
def test_test_part_is_opened_once_and_last(watched):
    # Once for the casts without noise, after all fits, and once for those with noise.
    assert watched.order.count("open") == 2
    assert "fit" in watched.order
    assert "fit" not in watched.order[watched.order.index("open") :]


@pytest.mark.slow
def test_all_phases_share_one_split(watched):
    assert tuple(name for name, _ in watched.parts) == PHASES
    assert len({id(parts) for _, parts in watched.parts}) == 1
    with pytest.raises(RuntimeError, match="opened already"):
        watched.parts[0][1].open_test()


@pytest.mark.slow
def test_a_run_uses_one_thread_for_each_process(watched):
    assert (watched.limits[0], watched.limits[-1]) == (1, "end")
    assert watched.limits.count("end") == 1
    assert {"casts", "comparison", "noise", "drawing"} <= set(watched.limits[1:-1])


def test_samples_are_described_by_the_training_casts():
    n = 340  # split into 260, 60 and 20
    rng = np.random.default_rng(0)
    columns = [*PARAMETERS, *OUTPUTS]
    frame = pd.DataFrame(rng.uniform(size=(n, len(columns))), columns=columns)
    frame["landing_along"] += 5.0 * (frame.index >= 260)
    frame["landing_across"] *= np.where(frame.index < 260, -0.001, 1.0)
    frame = frame.assign(status="landed", is_slack=frame.index % 4 == 0)
    frame.loc[260:, "is_slack"] = True
    frame.loc[[0, 300], columns[3:]] = np.nan
    frame.loc[[0, 300], "status"] = "diverged"
    data = wc.CastDataset(wc.Scenario(), 0, frame)
    found = run.describe_samples(data, run.split_casts(data))
    train = frame[1:260]
    assert (found.n_train, found.n_validation, found.n_test) == (259, 59, 20)
    assert found.statuses == {"landed": 338, "diverged": 2}
    for name in ("distance", "speed", "wait", "landing_along"):
        assert getattr(found, name).tolist() == train[name].tolist()
    assert found.share_slack == 0.25
    assert found.landing_std == pytest.approx(np.std(train["landing_along"].to_numpy()), rel=1e-12)
    assert found.largest_across == -train["landing_across"].min()


def test_selection_does_not_see_the_test_part(no_physics, tmp_path):
    data = wc.generate_dataset(wc.Scenario(), 85, 0)
    frame = data.frame.copy()
    frame.loc[data.split()[2], "landing_along"] = 7.0
    spoilt = wc.CastDataset(data.scenario, data.seed, frame)
    parts = [run.split_casts(one) for one in (data, spoilt)]
    found = [selection.select_models(wc.Scenario(), part, lambda *_: None) for part in parts]
    assert to_plain(found[0]) == to_plain(found[1])


def test_summary_holds_what_readers_of_it_expect(finished):
    findings, _ = finished
    content = findings.to_json({"casts": 1.0, "comparison": 2.0})
    assert content["wall_s"] == 3.0
    assert (content["n_train"], content["n_validation"], content["n_test"]) == (65, 15, 5)
    kernel = {"isotropic", "ard", "isotropic_by_validation"}
    others = {"gaussian_process", "neural_network", "nearest_neighbour", "constant"}
    assert set(content["test_rmse_m"]) == kernel | others | {"polynomial_12", "polynomial_best"}
    assert all(0 < value < 1 for value in content["test_rmse_m"].values())
    assert content["n_cups"] == 6
    assert content["hit_interval"][0] <= content["hit_rate"] <= content["hit_interval"][1]
    for name in ("predicted_miss_m", "executed_miss_m"):
        values = content[name]
        assert values["median"] <= values["p95"] <= values["max"]
        assert values["mean"] <= values["max"]
    assert json.loads(json.dumps(content, allow_nan=False))["fingerprint"] == wc.Scenario().fingerprint


def test_rows_are_what_their_names_say(finished):
    found = finished[0].comparison
    rmse = dict(zip(found.rows["name"], found.rows["rmse"], strict=True))
    assert rmse["constant"] > 10 * rmse["isotropic"]
    best = found.polynomials.loc[found.polynomials["validation_rmse"].idxmin()]
    assert rmse["polynomial_best"] == best["test_rmse"]
    assert found.polynomials["degree"].tolist() == list(range(1, 13))
    assert found.polynomials["n_terms"].tolist() == [math.comb(d + 3, 3) for d in range(1, 13)]
    residual = found.test_predicted - found.test_measured
    assert rmse["ard"] == pytest.approx(np.sqrt(np.mean(residual**2)))


def test_noise_is_the_difference_to_the_same_casts_without(finished):
    noise = finished[0].noise
    # 5 mm, see `landing` in conftest, over 65 casts.
    assert noise.along_std == pytest.approx(0.005, rel=0.3)
    with_noise = noise.models.iloc[0]
    assert with_noise.regularization > 100 * finished[0].selection.per_parameter.regularization
    assert with_noise.test_rmse > 0.003
