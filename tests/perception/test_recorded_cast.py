"""A cast that was rendered: what cameras of 320 x 240 pixels saw of it, against where the ball was."""

from dataclasses import replace

import numpy as np
import pytest

from wam_cast.errors import InputError
from wam_cast.motion.stages import Stage
from wam_cast.perception.ball_observer import believed_cameras, true_cameras
from wam_cast.perception.recorded_cast import observe_cast
from wam_cast.scenario import Cameras, Scenario


def truth_at(recording, times):
    return np.column_stack([np.interp(times, recording.times, axis) for axis in recording.p_WL.T])


def test_the_landing_is_seen_and_lies_within_its_deviation(seen_cast):
    recording, sighting = seen_cast
    error = sighting.landing.position - recording.outcome.landing
    assert np.linalg.norm(error) < 0.003
    assert np.linalg.norm(error) < 3 * sighting.landing.std
    assert sighting.landing.std < 0.002


def test_detected_centres_are_where_drake_draws_the_ball(seen_cast):
    recording, sighting = seen_cast
    truth = truth_at(recording, sighting.times)
    for i, camera in enumerate(believed_cameras(recording.scenario.cameras)):
        off = np.array([look.detections[i, :2] for look in sighting.looks]) - camera.project(truth)
        assert np.abs(off[:-1]).max() < 0.4
        assert np.abs(off[:-1].mean(axis=0)).max() < 0.12


def test_the_path_is_the_balls_at_the_times_of_the_pictures(seen_cast):
    recording, sighting = seen_cast
    period = 1 / recording.scenario.cameras.frame_rate
    np.testing.assert_allclose(np.diff(sighting.times), period, atol=1e-9)
    assert list(sighting.n_seen) == [len(sighting.looks)] * 2
    off = np.linalg.norm(sighting.p_WL[2:-1] - truth_at(recording, sighting.times[2:-1]), axis=1)
    assert off.max() < 0.003
    assert np.isnan(sighting.p_WL[-1]).all()  # it is down


def test_they_look_from_before_the_drop_until_the_ball_is_at_the_rim(seen_cast):
    recording, sighting = seen_cast
    heights = truth_at(recording, sighting.times)[:, 2] - recording.scenario.cup.rim_height
    assert heights[-2] > 0
    assert heights[-1] < 2 * recording.scenario.ball.radius
    assert sighting.looks[-1].belief.is_down


@pytest.mark.slow
def test_the_same_seed_gives_the_same_pictures(seen_cast):
    recording, sighting = seen_cast
    n = int(np.sum(recording.stages < Stage.DROP)) + 5
    short = replace(recording, **{name: getattr(recording, name)[:n] for name in ("times", "states", "stages")})
    again, other = (observe_cast(short, noise_seed=seed) for seed in (3, 4))
    assert len(again.looks) >= 2
    for mine, before in zip(again.looks, sighting.looks, strict=False):
        np.testing.assert_array_equal(mine.detections, before.detections)
    assert not np.array_equal(other.looks[0].detections, again.looks[0].detections)
    assert again.landing is None  # nothing has come down yet


def test_without_cameras_nothing_is_seen(seen_cast):
    recording, _ = seen_cast
    with pytest.raises(InputError, match=r"cameras\.number = 0"):
        observe_cast(replace(recording, scenario=Scenario()))


def test_a_target_is_in_the_middle_of_a_level_picture_and_an_error_moves_the_camera():
    cameras = Cameras(number=2, offsets=[[0.01, 0.0, 0.0], [0.0, 0.0, 0.0]], turns=[[0.0, 0.0, 0.0], [0.0, 0.1, 0.0]])
    first, second = believed_cameras(cameras)
    target = np.array(cameras.targets[0])
    np.testing.assert_allclose(first.project(target[np.newaxis])[0], (320, 240), atol=0.51)
    above = first.project(target + np.array([[0.0, 0.0, 0.0], [0.0, 0.0, 0.1]]))
    assert above[1, 0] == pytest.approx(above[0, 0])
    assert above[1, 1] < above[0, 1]
    moved, turned = true_cameras(cameras)
    np.testing.assert_allclose(moved.p_WV - first.p_WV, (0.01, 0.0, 0.0), atol=1e-12)
    np.testing.assert_array_equal(moved.R_WV, first.R_WV)
    # Turned to its right about its own axis that points down, by 0.1 rad: the target moves to the left.
    left = turned.project(target[np.newaxis])[0, 0] - second.project(target[np.newaxis])[0, 0]
    assert left == pytest.approx(-second.focal_length * np.tan(0.1), rel=0.01)
    assert len(believed_cameras(Cameras(number=1))) == 1
