"""`make_vec("wam_cast/Cast-v0")`: hits told from landings, episodes that begin where others end, and one call of the engine."""

import gymnasium
import numpy as np
import pandas as pd
import pytest
from gymnasium.vector import AutoresetMode
from gymnasium.wrappers.vector import RecordEpisodeStatistics

import wam_cast.environments  # noqa: F401 - registers
from wam_cast.cast import default_cast
from wam_cast.casting_plane import to_polar
from wam_cast.errors import InputError
from wam_cast.scenario import Scenario

pytest.importorskip("jax", reason="the extra `batch` is not installed")

from wam_cast.environments import cast_vector_env
from wam_cast.environments.cast_task import CastTask
from wam_cast.simulation.simulator import simulate_cast

ID = "wam_cast/Cast-v0"
TASK = CastTask(Scenario())


@pytest.fixture
def engine(monkeypatch):
    """Let casts land where a test says, `landings` [m] along and across their planes, and note the seeds of their noise."""
    told = {"along": None, "across": 0.0, "status": "landed", "is_slack": True, "seeds": []}

    def simulate(scenario, casts, seeds, precision):
        told["seeds"].append(seeds)
        frame = pd.DataFrame({"landing_along": np.broadcast_to(told["along"], len(casts)).astype(float)})
        for column in ("landing_across", "status", "is_slack"):
            frame[column] = told[column.removeprefix("landing_")]
        frame.loc[frame["status"] == "never_crossed", ["landing_along", "landing_across"]] = np.nan
        return frame

    monkeypatch.setattr(cast_vector_env, "simulate_batch", simulate)
    return told


def toward(cups):
    """Return actions that cast toward cups."""
    shape = TASK.action(default_cast(Scenario()))[:3]
    return np.array([[*shape, to_polar(cup)[1] / 2.59] for cup in cups])


def test_a_hit_is_a_ball_whose_centre_comes_down_through_the_opening(engine):
    envs = gymnasium.make_vec(ID, num_envs=6)
    cups, _ = envs.reset(seed=0)
    distances = np.hypot(*cups.T)
    engine["along"] = distances + np.array([0.0, 0.0299, 0.0301, 0.0, 0.0, 0.0])
    engine["is_slack"] = [True, True, True, False, True, True]
    engine["status"] = ["landed", "landed", "landed", "landed", "limit_hit", "never_crossed"]
    after, rewards, terminations, truncations, infos = envs.step(toward(cups))
    final = infos["final_info"]
    assert final["is_success"].tolist() == [True, True, False, False, False, False]
    np.testing.assert_allclose(rewards, [1.0, 0.9701, -0.0301, 0.0, -1.0, -1.0], atol=1e-9)
    assert terminations.all()
    assert not truncations.any()
    # The next episodes have begun.
    assert envs.metadata["autoreset_mode"] is AutoresetMode.SAME_STEP
    np.testing.assert_array_equal(infos["final_obs"], cups)
    assert np.abs(after - cups).min() > 0
    assert envs.observation_space.contains(after)
    assert envs.single_action_space.shape == (4,)


def test_a_cup_that_stands_off_is_missed_by_as_much(engine):
    off = Scenario.from_dict({"cup": {"offset": [0.03, -0.04]}})
    envs = gymnasium.make_vec(ID, num_envs=2, scenario=off)
    cups, _ = envs.reset(options={"cup": (0.6, 0.0)})
    engine["along"] = 0.6
    infos = envs.step(toward(cups))[-1]
    np.testing.assert_allclose(infos["final_info"]["miss"], 0.05)


def test_a_seed_is_the_same_cups_and_noise(engine):
    engine["along"] = 0.5

    def run(seed):
        envs = gymnasium.make_vec(ID, num_envs=3)
        cups, _ = envs.reset(seed=seed)
        later = [envs.step(np.zeros((3, 4)))[0] for _ in range(2)]
        return np.array([cups, *later])

    first, again, other = run(5), run(5), run(6)
    np.testing.assert_array_equal(first, again)
    assert np.abs(first - other).min() > 0
    np.testing.assert_array_equal(engine["seeds"][:2], engine["seeds"][2:4])
    assert len(np.unique(engine["seeds"][:2])) == 6


def test_gymnasiums_own_statistics_count_its_episodes(engine):
    engine["along"] = 0.5
    envs = RecordEpisodeStatistics(gymnasium.make_vec(ID, num_envs=4))
    envs.reset(seed=0)
    for _ in range(3):
        _, rewards, *_ = envs.step(np.zeros((4, 4)))
    assert envs.episode_count == 12
    np.testing.assert_allclose(list(envs.return_queue)[-4:], rewards)
    assert set(envs.length_queue) == {1}


def test_wrong_arguments_are_one_line(engine):
    envs = gymnasium.make_vec(ID, num_envs=2)
    with pytest.raises(InputError, match="call reset"):
        envs.step(np.zeros((2, 4)))
    envs.reset(seed=0)
    with pytest.raises(InputError, match=r"of shape \(4,\), must be \(2, 4\)"):
        envs.step(np.zeros(4))
    with pytest.raises(InputError, match="num_envs = 0 must be an integer, 1 or more"):
        gymnasium.make_vec(ID, num_envs=0)
    with pytest.raises(InputError, match="shows nothing"):
        gymnasium.make_vec(ID, num_envs=1, render_mode="human")


def test_a_step_asks_the_engine_once_for_all_casts(engine):
    engine["along"] = 0.5
    envs = gymnasium.make_vec(ID, num_envs=5)
    envs.reset(seed=0)
    envs.step(np.zeros((5, 4)))
    assert [len(seeds) for seeds in engine["seeds"]] == [5]


@pytest.mark.slow
def test_landings_are_drakes():
    envs = gymnasium.make_vec(ID, num_envs=16)
    envs.reset(seed=1)
    actions = np.random.default_rng(0).uniform(-1, 1, (16, 4))
    actions[:, 3] /= 4
    final = envs.step(actions)[-1]["final_info"]
    for i in (0, 7, 15):
        outcome = simulate_cast(Scenario(), TASK.cast(actions[i]))
        assert final["status"][i] == outcome.status
        np.testing.assert_allclose(final["landing"][i], outcome.landing, atol=5e-6)
