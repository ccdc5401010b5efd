"""`wam_cast/CastTorque-v0`: the paper's controller as a policy, how episodes end, and what is observed."""

import warnings

import gymnasium
import numpy as np
import pytest
from gymnasium.error import ResetNeeded
from gymnasium.utils.env_checker import check_env

import wam_cast.environments  # noqa: F401 - registers
from wam_cast.cast import default_cast, default_cup
from wam_cast.environments.torque_env import CastTorqueEnv
from wam_cast.errors import InputError
from wam_cast.motion.stages import cast_motion
from wam_cast.robot.controller import CastController, Desired, MeasuredArm
from wam_cast.scenario import Scenario
from wam_cast.simulation.simulator import CastSimulator

ID = "wam_cast/CastTorque-v0"
SCENARIO = Scenario()
CAST, CUP = default_cast(SCENARIO), default_cup(SCENARIO)


class PaperPolicy:
    """The package's own controller, which sees what the environment shows of the arm."""

    def __init__(self, env):
        self.controller = CastController(SCENARIO)
        self.motion = cast_motion(SCENARIO, CAST, cup_radius=CUP[0])
        self.arm = MeasuredArm(self.controller.plant)
        self.peaks = env.unwrapped._most

    def __call__(self, observation, time):
        self.arm.measure(observation[:14])
        desired = Desired(*self.motion.evaluate(time), time, self.motion)
        return self.controller.torque(self.arm, desired) / self.peaks


@pytest.fixture(scope="module")
def episode():
    """Return what the paper's controller makes of an episode: all observations, rewards, and the last step."""
    env = gymnasium.make(ID)
    policy = PaperPolicy(env)
    observation, info = env.reset(options={"cup": CUP})
    observations, rewards, over = [observation], [], False
    while not over:
        observation, worth, terminated, truncated, info = env.step(policy(observation, info["time"]))
        observations.append(observation)
        rewards.append(worth)
        over = terminated or truncated
    return np.array(observations), np.array(rewards), terminated, truncated, info, env


@pytest.mark.slow
def test_gymnasium_has_no_complaint():
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        check_env(gymnasium.make(ID).unwrapped)


def test_the_papers_controller_catches_the_ball(episode):
    _, rewards, terminated, truncated, info, env = episode
    assert (terminated, truncated) == (True, False)
    assert info["is_success"] is True
    assert info["reason"] == "caught"
    assert rewards[-1] > 0.99
    with pytest.raises(ResetNeeded):
        env.unwrapped.step(np.zeros(7))


def test_rewards_add_up_to_how_much_nearer_the_ball_came(episode):
    observations, rewards, *_ = episode
    rest = np.array([*CUP, SCENARIO.cup.bottom_height + SCENARIO.ball.radius])
    distance = np.linalg.norm(observations[:, 16:19] - rest, axis=1)
    assert rewards.sum() == pytest.approx(1.0 + distance[0] - distance[-1], abs=1e-12)
    np.testing.assert_allclose(rewards[:-1], -np.diff(distance)[:-1], atol=1e-12)


@pytest.mark.slow
def test_the_motion_is_that_of_a_simulated_cast(episode):
    observations, *_ = episode
    recording = CastSimulator(SCENARIO).record(CAST, CUP, returns=False)
    # One phase here, two there, which the integrator steps through apart.
    n = min(len(observations), len(recording.times))
    assert abs(len(observations) - len(recording.times)) < 50
    before = recording.times[:n] < recording.outcome.crossing_time
    np.testing.assert_allclose(observations[:n][before, 16:19], recording.p_WL[:n][before], atol=1e-4)
    np.testing.assert_allclose(observations[:n][before, :7], recording.states[:n][before, :7], atol=1e-3)


def test_an_arm_beyond_its_limits_ends_the_episode_and_says_which():
    env = CastTorqueEnv()
    observation, _ = env.reset(options={"cup": CUP})
    action = np.eye(7)[0]  # joint 1 turns ever faster
    worth, terminated, n = 0.0, False, 0
    while not terminated:
        before = observation
        observation, worth, terminated, truncated, info = env.step(action)
        n += 1
    limit = env._loop.plant.GetVelocityUpperLimits()[0]
    assert info["reason"] == "joint 1 speed"
    assert info["time"] == pytest.approx(n * 0.002)
    assert not (truncated or info["is_success"])
    assert before[7] <= limit < observation[7]
    assert worth == pytest.approx(-1.0, abs=0.1)
    assert env.observation_space.contains(observation)


def test_a_ball_on_the_floor_has_missed():
    env = CastTorqueEnv()
    env.reset(options={"cup": (0.6, 0.0)})
    terminated = False
    while not terminated:
        observation, worth, terminated, _, info = env.step(np.zeros(7))  # the arm falls
    assert info["reason"] == "missed"
    assert observation[18] == pytest.approx(SCENARIO.ball.radius, abs=0.003)
    assert abs(worth) < 0.05


def test_time_truncates():
    env = gymnasium.make(ID, max_episode_steps=5, action="force")
    env.reset(seed=0)
    ends = [env.step(np.zeros(3))[2:4] for _ in range(5)]
    assert ends == [(False, False)] * 4 + [(False, True)]


def test_a_force_moves_the_hand_its_way_and_none_holds_it():
    env = CastTorqueEnv(action="force", observes_ball=False)
    arm = MeasuredArm(CastController(SCENARIO).plant)

    def moved(action, n=50):
        start, _ = env.reset(seed=0)
        for _ in range(n):
            observation, *_ = env.step(action)
        places = []
        for one in (start, observation):
            arm.measure(one[:14])
            places.append(arm.p_WE.copy())
        return places[1] - places[0]

    assert env.observation_space.shape == (16,)
    # String and ball are held by nothing but the posture.
    assert np.linalg.norm(moved(np.zeros(3))) < 5e-3
    for axis in np.eye(3):
        way = moved(0.05 * axis) - moved(-0.05 * axis)
        assert way @ axis > 0.5 * np.linalg.norm(way) > 0.005  # the arm is heavier in some directions than in others


def test_reset_builds_nothing_and_forgets_the_episode_before():
    env = CastTorqueEnv(Scenario.from_dict({"noise": {"torque": 0.01, "swing": 0.02, "encoder_counts": 4096}}))
    loop = env._loop
    rng = np.random.default_rng(0)
    actions = rng.uniform(-0.2, 0.2, (20, 7))

    def run(seed):
        start, _ = env.reset(seed=seed)
        return np.array([start, *(env.step(action)[0] for action in actions)])

    first, other, again = run(3), run(4), run(3)
    np.testing.assert_array_equal(first, again)
    assert np.abs(first - other).max() > 1e-3
    assert env._loop is loop


def test_actions_are_checked_and_clipped():
    env = CastTorqueEnv()
    env.reset(seed=0)
    beyond, _ = env.step(np.full(7, 3.0)), env.reset(seed=0)
    np.testing.assert_array_equal(env.step(np.ones(7))[0], beyond[0])
    for wrong in (np.zeros(6), np.full(7, np.nan), "x"):
        with pytest.raises(InputError, match="must be 7 finite numbers from -1 to 1"):
            env.step(wrong)
    with pytest.raises(InputError, match="action = 'position' must be torque or force"):
        CastTorqueEnv(action="position")
