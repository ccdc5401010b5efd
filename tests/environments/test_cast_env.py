"""`wam_cast/Cast-v0`: what Drake says of a cast is what the environment pays for, and Gymnasium's own check is content."""

import importlib
import math
import subprocess
import sys
import warnings

import gymnasium
import numpy as np
import pytest
from gymnasium.error import ResetNeeded
from gymnasium.utils.env_checker import check_env

import wam_cast.environments
from wam_cast.cast import Cast, default_cast, default_cup
from wam_cast.errors import InputError
from wam_cast.scenario import Scenario
from wam_cast.simulation.simulator import simulate_cast

ID = "wam_cast/Cast-v0"


@pytest.fixture(scope="module")
def env():
    return gymnasium.make(ID).unwrapped


def made(env, cast, cup, seed=None):
    env.reset(seed=seed, options={"cup": cup})
    return env.step(env.action(cast))


@pytest.mark.slow
def test_gymnasium_has_no_complaint():
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        check_env(gymnasium.make(ID).unwrapped)


IN_A_NEW_PROCESS = """
import sys, gymnasium, wam_cast
assert "wam_cast/Cast-v0" not in gymnasium.registry
import wam_cast.environments
assert {"wam_cast/Cast-v0", "wam_cast/CastTorque-v0"} <= set(gymnasium.registry)
assert "pydrake" not in sys.modules
del gymnasium.registry["wam_cast/Cast-v0"], sys.modules["wam_cast.environments"]
assert type(gymnasium.make("wam_cast.environments:wam_cast/Cast-v0").unwrapped).__name__ == "CastEnv"
"""


@pytest.mark.slow
def test_importing_the_environments_registers_them_and_loads_no_drake():
    subprocess.run([sys.executable, "-c", IN_A_NEW_PROCESS], check=True)


def test_a_catch_is_paid_and_ends_the_episode(env):
    scenario = Scenario()
    cast, cup = default_cast(scenario), default_cup(scenario)
    outcome = simulate_cast(scenario, cast, cup)
    assert outcome.is_caught
    observation, worth, terminated, truncated, info = made(env, cast, cup)
    np.testing.assert_array_equal(observation, cup)
    assert (terminated, truncated) == (True, False)
    assert info["is_success"] is True
    assert info["status"] == "caught"
    # The action's round trip moves the cast by rounding.
    assert worth == pytest.approx(1 - outcome.miss, abs=1e-6)
    np.testing.assert_allclose(info["landing"], outcome.landing, atol=1e-6)
    np.testing.assert_allclose(info["cast"], [*cast.to_array(), cast.bearing])
    with pytest.raises(ResetNeeded):
        env.step(env.action(cast))


@pytest.mark.slow
def test_a_miss_costs_its_distance_and_a_limit_costs_most(env):
    far = default_cup(Scenario())[0] + 0.2, 0.0
    _, worth, terminated, _, info = made(env, default_cast(Scenario()), far)
    assert terminated
    assert not info["is_success"]
    assert worth == pytest.approx(-info["miss"])
    assert info["miss"] == pytest.approx(0.2, abs=0.02)
    weak = gymnasium.make(ID, scenario=Scenario.from_dict({"arm": {"torque_scale": 0.3}})).unwrapped
    _, worth, _, _, info = made(weak, Cast(0.4, 0.85, 0.0), far)
    assert info["status"] == "limit_hit"
    assert worth == -1.0


@pytest.mark.slow
def test_a_seed_is_the_same_cups_and_the_same_noise():
    noisy = gymnasium.make(ID, scenario=Scenario.from_dict({"noise": {"distance": 0.01}}))
    action = noisy.unwrapped.action(default_cast(Scenario()))

    def episode(seed):
        cup, _ = noisy.reset(seed=seed)
        return cup, noisy.step(action)[4]["landing"]

    first, again, other = episode(7), episode(7), episode(8)
    np.testing.assert_array_equal(first[0], again[0])
    np.testing.assert_array_equal(first[1], again[1])
    assert math.dist(first[0], other[0]) > 1e-3
    assert math.dist(first[1], other[1]) > 1e-4


@pytest.mark.slow
def test_a_picture_shows_the_ball_before_and_in_the_cup_after():
    env = gymnasium.make(ID, render_mode="rgb_array").unwrapped
    cup = default_cup(Scenario())
    env.reset(options={"cup": cup})
    before = env.render()
    assert before.shape == (480, 480, 3)
    assert before.dtype == np.uint8
    _, _, _, _, info = env.step(env.action(default_cast(Scenario())))
    assert info["is_success"]
    after = env.render()
    (row_before, _), (row_after, column_after) = orange(before), orange(after)
    (row_cup, column_cup) = blue(before)
    assert row_after > row_before + 10  # it came down
    assert math.dist((row_after, column_after), (row_cup, column_cup)) < 25
    env.close()
    assert env.render() is None


def orange(image):
    red, green, blue = image.astype(int).transpose(2, 0, 1)
    return np.argwhere((red > green + 60) & (red > blue + 80)).mean(axis=0)


def blue(image):
    red, green, blue = image.astype(int).transpose(2, 0, 1)
    return np.argwhere((blue > red + 40) & (green > red + 20)).mean(axis=0)


def test_an_unknown_render_mode_is_one_line():
    with pytest.raises(InputError, match="render_mode = 'ansi' must be human or rgb_array"):
        wam_cast.environments.stage_view.checked_render_mode("ansi")


def test_without_gymnasium_a_line_says_what_to_install(monkeypatch):
    monkeypatch.setattr("importlib.util.find_spec", lambda _: None)
    with pytest.raises(InputError, match=r"pip install \"wam_cast\[gymnasium\]\""):
        importlib.reload(wam_cast.environments)
