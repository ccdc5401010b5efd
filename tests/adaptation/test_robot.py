"""A robot that only answers casts."""

import shutil
from types import SimpleNamespace

import numpy as np
import pytest

import wam_cast as wc
from wam_cast.adaptation.robot import LARGEST_STD, Robot, SimulatedRobot
from wam_cast.adaptation.robot_distribution import RobotDistribution
from wam_cast.arm.arm_model import models_directory
from wam_cast.cast import Cast
from wam_cast.errors import InputError
from wam_cast.perception.ball_filter import ObservedLanding
from wam_cast.scenario import Arm, Cameras, Noise, Scenario

CAST = Cast(0.30, 0.60, 0.10)
NOISY = Scenario(noise=Noise.typical())


def test_without_noise_and_error_it_answers_as_its_scenario():
    truth = Scenario.from_dict({"string": {"length": 0.61}})
    seen = SimulatedRobot(truth, Scenario(), landing_std=0.0).cast(CAST)
    outcome = wc.simulate_cast(truth, CAST, belief=Scenario())
    np.testing.assert_array_equal(seen.landing, outcome.landing)
    assert (seen.status, seen.limits_hit, seen.is_caught) == (str(outcome.status), outcome.limits_hit, None)


@pytest.mark.slow
def test_each_cast_has_noise_of_its_own_that_the_number_of_the_cast_draws():
    robot = SimulatedRobot(NOISY, seed=3)
    answers = [robot.cast(CAST).landing for _ in range(3)]
    assert len({tuple(one) for one in answers}) == 3
    again = SimulatedRobot(NOISY, seed=3, n_before=2)
    np.testing.assert_array_equal(again.cast(CAST).landing, answers[2])
    assert again.n_casts == 3
    later = robot.after(1)
    np.testing.assert_array_equal(later.cast(CAST).landing, answers[1])
    assert (later.n_casts, robot.n_casts) == (2, 3)
    assert not np.array_equal(SimulatedRobot(NOISY, seed=4).cast(CAST).landing, answers[0])


def test_a_landing_is_measured_with_the_error_that_is_told(monkeypatch):
    exact = wc.simulate_cast(Scenario(), CAST)
    monkeypatch.setattr("wam_cast.adaptation.robot.simulate_cast", lambda *args, **options: exact)
    robot = SimulatedRobot(Scenario(), landing_std=0.004)
    seen = [robot.cast(CAST) for _ in range(2000)]
    errors = np.array([one.landing - exact.landing for one in seen])
    np.testing.assert_allclose(errors.std(axis=0), seen[0].landing_std, rtol=0.05)
    np.testing.assert_allclose(errors.mean(axis=0), 0, atol=0.0004)


def test_a_drawn_robot_is_not_what_is_believed_and_does_not_tell_what_it_is():
    robots = RobotDistribution(NOISY)
    robot = SimulatedRobot.draw(robots, seed=5)
    assert isinstance(robot, Robot)
    assert robot.belief == robots.believed
    public = [value for name, value in vars(robot).items() if not name.startswith("_")]
    assert robots.draw(5) not in public


def test_a_cup_at_the_landing_catches():
    robot = SimulatedRobot(Scenario(), landing_std=0.0)
    x, y = robot.cast(CAST).landing
    assert robot.cast(CAST, (float(x), float(y))).is_caught is True
    assert robot.cast(CAST, (float(x) + 0.3, float(y))).is_caught is False


@pytest.mark.parametrize("std", [-0.001, 1.5, float("nan")])
def test_an_impossible_error_is_refused(std):
    with pytest.raises(InputError, match="landing_std"):
        SimulatedRobot(Scenario(), landing_std=std)


def seen_by_cameras(monkeypatch, recording, landing):
    """Let cameras see a landing of a cast that was recorded; return what they were asked."""
    asked = []

    def record(truth, cast, cup, *, belief, noise_seed):
        asked.append((truth, cup, belief, noise_seed))
        return recording

    def observe(recorded, *, belief, noise_seed):
        asked.append((recorded, belief, noise_seed))
        return SimpleNamespace(landing=landing)

    monkeypatch.setattr("wam_cast.adaptation.robot.record_cast", record)
    monkeypatch.setattr("wam_cast.adaptation.robot.observe_cast", observe)
    return asked


def test_cameras_say_where_the_ball_landed_and_how_well_they_know(monkeypatch):
    recording = SimpleNamespace(outcome=wc.simulate_cast(Scenario(), CAST))
    landing = ObservedLanding(np.array([0.61, 0.003]), np.diag([1e-6, 3e-6]))
    asked = seen_by_cameras(monkeypatch, recording, landing)
    truth, belief = Scenario.from_dict({"string": {"length": 0.61}}), Scenario()
    seen = SimulatedRobot(truth, belief, seed=2, observe="camera").cast(CAST, (0.6, 0.0))
    np.testing.assert_array_equal(seen.landing, landing.position)
    assert seen.landing_std == pytest.approx(np.sqrt(2e-6))
    assert (seen.status, seen.limits_hit) == (str(recording.outcome.status), recording.outcome.limits_hit)
    (simulated, cup, believed, noise_seed), (recorded, known, pixel_seed) = asked
    assert (simulated.cameras.number, simulated.string, cup) == (2, truth.string, (0.6, 0.0))
    assert (recorded, known, believed) == (recording, belief, belief)
    assert pixel_seed == noise_seed


def test_what_cameras_did_not_see_is_no_landing_and_teaches_nothing(monkeypatch, robots_by_formula):
    seen_by_cameras(monkeypatch, SimpleNamespace(outcome=wc.simulate_cast(Scenario(), CAST)), None)
    seen = SimulatedRobot(Scenario(), observe="camera").cast(CAST)
    assert np.isnan(seen.landing).all()
    assert seen.landing_std == LARGEST_STD
    model = robots_by_formula.model
    x = CAST.to_array()[np.newaxis]
    np.testing.assert_array_equal(model.learn([seen]).predict(x), model.predict(x))


def test_a_robots_own_cameras_look_if_it_has_any(monkeypatch):
    own = Scenario(cameras=Cameras(number=1, width=320))
    asked = seen_by_cameras(monkeypatch, SimpleNamespace(outcome=wc.simulate_cast(Scenario(), CAST)), None)
    SimulatedRobot(own, observe="camera").cast(CAST)
    assert asked[0][0].cameras == own.cameras


def test_an_unknown_way_to_observe_is_refused():
    with pytest.raises(InputError, match=r"observe = 'radar' must be one of direct, camera"):
        SimulatedRobot(Scenario(), observe="radar")


@pytest.mark.slow
def test_a_robot_that_cameras_look_at_lands_where_they_say():
    truth = Scenario.from_dict({"string": {"length": 0.608}, "noise": Noise.typical().model_dump()})
    seen = SimulatedRobot(truth, Scenario(), seed=3, observe="camera").cast(CAST)
    exact = SimulatedRobot(truth, Scenario(), seed=3, landing_std=0.0).cast(CAST)
    assert np.linalg.norm(seen.landing - exact.landing) < 0.003
    assert 1e-4 < seen.landing_std < 0.003


def test_an_arm_that_cameras_cannot_be_shown_is_refused_before_its_first_cast(tmp_path):
    shutil.copy(models_directory() / "wam7.urdf", tmp_path)
    shutil.copytree(models_directory() / "meshes", tmp_path / "meshes")
    (tmp_path / "meshes" / "link1_white.obj").write_text("f 1 2 3")
    truth = Scenario(arm=Arm(urdf=str(tmp_path / "wam7.urdf")))
    SimulatedRobot(truth)
    with pytest.raises(InputError, match=r"link1_white\.obj cannot be drawn: line 1, 'f 1 2 3': there is no 1 among 0"):
        SimulatedRobot(truth, observe="camera")
