"""The map of the floor: which cups, which casts, how far off, how often caught."""

import json
import math
from concurrent.futures import ThreadPoolExecutor
from dataclasses import replace

import numpy as np
import pandas as pd
import pytest

import wam_cast as wc
from wam_cast.casting_plane import from_polar
from wam_cast.errors import InputError
from wam_cast.experiments import floor_map as module
from wam_cast.experiments import trials
from wam_cast.experiments.floor_map import MapSize, map_floor
from wam_cast.experiments.statistics import wilson_interval
from wam_cast.parallel.workers import run_rows
from wam_cast.planning.plan import plan_cast
from wam_cast.planning.reach import Reach
from wam_cast.scenario import Noise, Scenario

SIZE = MapSize(n_radii=4, n_bearings=3, n_casts=2)


@pytest.fixture
def model():
    return wc.reference_model()


@pytest.fixture
def noisy_model(model):
    return model.bound_to(Scenario().model_copy(update={"noise": Noise.typical()}))


# --- which cups and casts


@pytest.mark.parametrize(
    ("values", "name"), [((1, 3, 1), "n_radii"), ((3, 1, 1), "n_bearings"), ((3, 3, 0), "n_casts")]
)
def test_a_map_of_too_little_is_refused(values, name):
    with pytest.raises(InputError, match=f"{name} = "):
        MapSize(*values)


def test_a_negative_seed_is_refused(floor_without_physics, model):
    with pytest.raises(InputError, match="seed = -1"):
        map_floor(model, SIZE, seed=-1)
    assert not floor_without_physics.planned


def test_cups_lie_evenly_over_the_whole_region(floor_without_physics, model):
    floor, reach = map_floor(model, SIZE), Reach.of(model)
    radii = floor.rings["radius"].tolist()
    np.testing.assert_allclose(radii, np.linspace(reach.nearest, reach.farthest, 4))
    for _, casts in floor.casts.groupby("radius"):
        np.testing.assert_allclose(casts["cup_bearing"], [reach.lowest, 0, reach.highest], atol=1e-12)
    assert floor.radii == model.reach
    assert floor.bearings == (reach.lowest, reach.highest)
    expected = [from_polar(radius, b) for radius in radii for b in (reach.lowest, 0.0, reach.highest)]
    np.testing.assert_allclose([cup for _, cup, _ in floor_without_physics.cast], expected, atol=1e-12)


def test_there_is_one_plan_for_each_radius_by_the_planner_that_was_asked_for(floor_without_physics, model):
    floor = map_floor(model, SIZE, method="program", solver="ipopt")
    assert floor_without_physics.planned == [((radius, 0.0), "program", "ipopt") for radius in floor.rings["radius"]]


def test_a_turned_plan_still_makes_up_for_a_landing_beside_its_plane(floor_without_physics, model):
    floor = map_floor(model, SIZE)
    bearings = floor.casts["cup_bearing"] + 0.02
    assert [cast.bearing for cast, *_ in floor_without_physics.cast] == pytest.approx(bearings.tolist())


def test_a_plan_is_turned_to_each_bearing_as_if_it_was_made_there(floor_without_physics, model, monkeypatch):
    monkeypatch.setattr(module, "plan_cast", plan_cast)
    map_floor(model, MapSize(2, 4), method="gradient")
    for cast, cup, _ in floor_without_physics.cast:
        inside = Reach.of(model).nearest_position(cup)  # the ends of the region, rounded, may be outside
        there = plan_cast(model, inside, "gradient").cast
        assert cast.bearing == pytest.approx(there.bearing, abs=0.01)
        np.testing.assert_allclose(cast.to_array(), there.to_array(), atol=0.02)


def test_noise_differs_from_cast_to_cast_and_from_seed_to_seed(floor_without_physics, noisy_model):
    floor = map_floor(noisy_model, SIZE)
    assert floor.is_noisy
    assert floor.rings["n_casts"].tolist() == [6] * 4
    seeds = floor.casts["noise_seed"].tolist()
    assert seeds == [seed for *_, seed in floor_without_physics.cast]
    assert len(set(seeds)) == len(seeds) == 24
    assert not set(seeds) & set(map_floor(noisy_model, SIZE, seed=1).casts["noise_seed"])


def test_without_noise_each_cup_is_cast_at_once(floor_without_physics, model):
    floor = map_floor(model, SIZE)
    assert not floor.is_noisy
    assert len(floor.casts) == len(floor_without_physics.cast) == 12


# --- what is measured


def test_offsets_are_outward_and_to_the_left_at_every_bearing(floor_without_physics, model):
    floor = map_floor(model, MapSize(2, 5))
    ring = floor.rings.iloc[0]
    for cast in floor.casts[1:5].itertuples():
        assert cast.along == pytest.approx(0.003, abs=1e-12)
        assert cast.lateral == pytest.approx(0.002, abs=1e-12)
        assert cast.miss == pytest.approx(math.hypot(0.003, 0.002))
    assert ring["along"]["mean"] == pytest.approx(0.003)
    assert ring["lateral"]["mean"] == pytest.approx(0.002)
    assert ring["along"]["std"] == pytest.approx(0.0, abs=1e-12)


def test_predictions_are_the_plans(floor_without_physics, model):
    for ring in map_floor(model, SIZE).rings.itertuples():
        assert ring.predicted_along == pytest.approx(-0.001)
        assert (ring.predicted_miss, ring.predicted_std) == (0.001, (0.004, 0.003))
        assert ring.rim_clear_probability == 1.0 - 0.5 * ring.radius
        assert (ring.distance, ring.speed, ring.wait) == (0.3, 0.5, 0.1)
        assert ring.is_feasible is (ring.radius < 0.9)


def test_hit_rates_count_all_casts_at_a_radius(floor_without_physics, noisy_model):
    *near, far = map_floor(noisy_model, SIZE).rings.itertuples()
    for ring in near:
        assert (ring.n_caught, ring.n_casts, ring.hit_rate) == (4, 6, 4 / 6)
        assert ring.hit_interval == wilson_interval(4, 6)
    assert (far.n_caught, far.hit_rate) == (0, 0.0)
    assert map_floor(noisy_model, SIZE).n_caught == 12


def test_a_ball_that_never_comes_down_has_no_offset(floor_without_physics, model):
    floor = map_floor(model, SIZE)
    nowhere, *others = floor.record()["rings"][0]["casts"]
    assert nowhere["status"] == "never_crossed"
    assert (nowhere["along"], nowhere["lateral"], nowhere["miss"]) == (None, None, None)
    assert [cast["status"] for cast in others] == ["caught", "caught"]
    assert floor.casts["is_caught"][:3].tolist() == [False, True, True]
    assert module._scatter(pd.Series([np.nan, np.nan])) == {"mean": None, "std": None}


def test_the_map_is_the_same_in_whatever_order_casts_are_done(floor_without_physics, noisy_model, monkeypatch):
    alone = map_floor(noisy_model, SIZE)
    monkeypatch.setattr(trials, "run_rows", run_rows)
    with ThreadPoolExecutor(3) as executor:
        assert map_floor(noisy_model, SIZE, executor=executor).record() == alone.record()
    assert json.loads(json.dumps(alone.record(), allow_nan=False)) == alone.record()


def test_progress_counts_plans_and_casts(floor_without_physics, model):
    seen = []
    map_floor(model, MapSize(2, 3), on_progress=lambda *done: seen.append(done))
    assert seen == [("planning", n, 2) for n in (1, 2)] + [("casting", n, 6) for n in range(7)]


@pytest.mark.slow
def test_real_casts_are_caught_and_depend_neither_on_the_bearing_nor_on_the_process(model, inline_executor):
    floor = map_floor(model, MapSize(2, 2), method="gradient", executor=inline_executor)
    again = map_floor(model, MapSize(2, 2), method="gradient", n_workers=1)
    assert again.record() == floor.record()
    assert floor.n_caught == len(floor.casts) == 4
    for _, casts in floor.casts.groupby("radius"):
        left, right = casts.itertuples()
        assert left.along == pytest.approx(right.along, abs=2e-3)
        assert abs(left.lateral) < 2e-3
        assert math.hypot(left.along, left.lateral) == pytest.approx(left.miss, abs=1e-9)
    turned = from_polar(left.radius, left.cup_bearing)
    plan = plan_cast(model, (left.radius, 0.0), "gradient")
    cast = replace(plan.cast, bearing=plan.cast.bearing + left.cup_bearing)
    assert wc.simulate_cast(Scenario(), cast, turned, noise_seed=left.noise_seed).miss == left.miss


def test_a_planner_of_ones_own_is_told_by_its_name(floor_without_physics, monkeypatch, model):
    def first_in_memory(model, radius):
        return model.training_casts[np.argmin(np.abs(model.training_outputs[:, 0] - radius))]

    monkeypatch.setattr(module, "plan_cast", plan_cast)
    floor = map_floor(model, MapSize(2, 2, 1), method=first_in_memory)
    assert json.loads(json.dumps(floor.record()))["planner"] == "first_in_memory"


def test_a_map_that_would_take_days_is_refused():
    with pytest.raises(InputError, match="= 9000000 casts would take days; choose 100000 at most"):
        MapSize(1_000_000, 9)
