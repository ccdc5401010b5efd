"""What is known of the ball after each picture: against casts by the same laws, seen by cameras whose errors are drawn."""

from dataclasses import replace

import numpy as np
import pytest

from wam_cast.perception.ball_filter import BallBelief, BallFilter, ObservedLanding
from wam_cast.perception.ball_motion import Hand, moved
from wam_cast.perception.ball_observer import believed_cameras
from wam_cast.perception.pinhole import Camera
from wam_cast.perception.triangulation import CENTRE_STD, triangulate
from wam_cast.scenario import Cameras, Scenario

SCENARIO = Scenario(cameras=Cameras(number=2))
CAMERAS = believed_cameras(SCENARIO.cameras)
FRAME, GRAVITY, RIM = 1 / 60, SCENARIO.gravity, SCENARIO.cup.rim_height
N_SWING = 6
"""Pictures before the hand drops."""


def hand_at(number):
    """Return p_WE and v_WE of a hand that rests, and from picture `N_SWING` on drops at 14 m/s^2."""
    t = max(number - N_SWING, 0) * FRAME
    return np.array([0.5, 0.0, 0.8 - 7 * t**2, 0.0, 0.0, -14 * t])


def fly(rng, length=0.6, across=0.0):
    """Return where the ball is in each picture until it is below the rim plane, (n, 3), and where it crosses it, (2,)."""
    angle = -0.5 + 0.05 * rng.standard_normal()
    r = length * np.array([np.sin(angle), across, -np.cos(angle)])
    state = np.array([[*(hand_at(0)[:3] + r), *(1.0 * np.array([np.cos(angle), 0.0, np.sin(angle)])), length]])
    path = [state[0]]
    while path[-1][2] > RIM:
        number = len(path) - 1
        state = moved(state, Hand.between(hand_at(number), hand_at(number + 1), FRAME), FRAME, GRAVITY)
        path.append(state[0])
    p, v = path[-2][:3], path[-2][3:6]
    duration = (v[2] + np.sqrt(v[2] ** 2 + 2 * GRAVITY * (p[2] - RIM))) / GRAVITY
    return np.array(path)[:, :3], p[:2] + duration * v[:2]


def look(path, rng, cameras=CAMERAS):
    """Return what the cameras find, shape (n, n_cameras, 4)."""
    found = np.empty((len(path), len(cameras), 4))
    for i, camera in enumerate(cameras):
        found[:, i, :2] = camera.project(path) + CENTRE_STD * rng.standard_normal((len(path), 2))
        found[:, i, 2] = 0.0
        found[:, i, 3] = camera.focal_length * SCENARIO.ball.radius / ((path - camera.p_WV) @ camera.R_WV[:, 2])
    return found


def watch(detections, cameras=CAMERAS, hand=hand_at, **options):
    ball_filter, belief, beliefs = BallFilter(SCENARIO, cameras, FRAME, **options), BallBelief(), []
    for number in range(len(detections) + 4):
        seen = detections[number] if number < len(detections) else np.full((len(cameras), 4), np.nan)
        belief = ball_filter.after(belief, seen, hand(number))
        beliefs.append(belief)
    return beliefs


@pytest.fixture(scope="module")
def casts():
    """Return paths, landings and what was found of 30 casts."""
    rng = np.random.default_rng(0)
    flown = [fly(rng) for _ in range(30)]
    return [(path, landing, look(path, rng)) for path, landing in flown]


def normalized(casts, which):
    """Return the landings' errors [m], (n, 2), and their squared Mahalanobis distances, (n,), of some of the cameras."""
    cameras = [CAMERAS[i] for i in which]
    found = [watch(detections[:, which], cameras)[-1].landing for _, _, detections in casts]
    errors = np.array([one.position - landing for one, (_, landing, _) in zip(found, casts, strict=True)])
    return errors, np.array(
        [error @ np.linalg.solve(one.covariance, error) for one, error in zip(found, errors, strict=True)]
    )


def test_landings_are_as_exact_as_their_covariances_say(casts):
    errors, squared = normalized(casts, [0, 1])
    assert np.percentile(np.linalg.norm(errors, axis=1), 95) < 0.0025
    # The motion has no noise here, which the filter allows for: the errors are smaller than it says, not by much.
    assert 0.3 < squared.mean() / 2 < 1.2
    assert (np.abs(errors.mean(axis=0)) < 3 * errors.std(axis=0) / np.sqrt(len(errors))).all()


@pytest.mark.parametrize("which", [0, 1])
def test_one_camera_does_with_what_is_known_of_string_and_casting_plane(casts, which):
    errors, squared = normalized(casts[:8], [which])
    assert np.median(np.linalg.norm(errors, axis=1)) < 0.01
    assert squared.mean() / 2 < 1.2


def test_the_path_is_followed_from_the_second_picture_on(casts):
    path, _, detections = casts[0]
    beliefs = watch(detections)
    off = [np.linalg.norm(belief.mean[:3] - p_WL) for belief, p_WL in zip(beliefs, path, strict=False)]
    assert max(off[1:-3]) < 0.002
    assert beliefs[5].mean[6] == pytest.approx(0.6, abs=0.003)


def test_the_length_of_a_string_that_is_not_what_it_is_taken_for_is_found():
    rng = np.random.default_rng(1)
    path, landing = fly(rng, length=0.612)
    beliefs = watch(look(path, rng))
    assert beliefs[N_SWING].mean[6] == pytest.approx(0.612, abs=0.003)
    np.testing.assert_allclose(beliefs[-1].landing.position, landing, atol=0.002)


def test_missing_pictures_widen_the_standard_deviation_and_nothing_seen_is_no_landing(casts):
    _, landing, detections = casts[0]
    stds = []
    for n_missing in (0, 2, 4):
        some = detections.copy()
        some[len(some) - 1 - n_missing :] = np.nan
        seen = watch(some)[-1].landing
        stds.append(seen.std)
        assert np.linalg.norm(seen.position - landing) < 5 * seen.std
    assert stds[0] < stds[1] < stds[2]
    assert watch(np.full_like(detections, np.nan))[-1].landing is None
    twice = np.full_like(detections, np.nan)
    twice[:2] = detections[:2]
    assert watch(twice)[-1].landing is None


def test_a_wrong_centre_and_a_hidden_ball_are_left_out(casts):
    _, _, detections = casts[1]
    expected, unseen = watch(detections)[-1].landing, detections.copy()
    for number, spoilt in ((8, (30.0, 0.0, 0.0, 0.0)), (9, (0.5, 0.0, 0.0, -2.5))):
        spoiled, unseen = detections.copy(), detections.copy()
        spoiled[number, 0] += spoilt
        unseen[number, 0] = np.nan
        found, without = watch(spoiled)[-1].landing, watch(unseen)[-1].landing
        np.testing.assert_array_equal(found.position, without.position)
        assert not np.array_equal(found.position, expected.position)


def test_nothing_changes_with_the_order_of_the_cameras_nor_with_the_bearing(casts):
    _, _, detections = casts[2]
    expected = watch(detections)[-1].landing
    swapped = watch(detections[:, ::-1], CAMERAS[::-1])[-1].landing
    np.testing.assert_allclose(swapped.position, expected.position, atol=1e-9)
    turn = np.array([[np.cos(0.7), -np.sin(0.7), 0.0], [np.sin(0.7), np.cos(0.7), 0.0], [0.0, 0.0, 1.0]])
    cameras = [Camera(turn @ one.p_WV, turn @ one.R_WV, one.width, one.height, one.field_of_view) for one in CAMERAS]
    both = np.kron(np.eye(2), turn)
    turned = watch(detections, cameras, hand=lambda number: both @ hand_at(number))[-1].landing
    np.testing.assert_allclose(
        turned.position, turn[:2, :2] @ expected.position, atol=1e-6
    )  # cubature points turn with the world's axes
    np.testing.assert_allclose(turned.covariance, turn[:2, :2] @ expected.covariance @ turn[:2, :2].T, atol=1e-9)


def test_errors_of_the_calibration_add_to_what_the_pictures_leave(casts):
    _, _, detections = casts[4]
    sharp = watch(detections)[-1].landing
    unsure = watch(detections, calibration_std=0.003)[-1].landing
    np.testing.assert_array_equal(unsure.position, sharp.position)
    np.testing.assert_allclose(unsure.covariance - sharp.covariance, 9e-6 * np.eye(2), atol=1e-15)


def test_what_the_rim_does_to_the_ball_does_not_count(casts):
    path, _, detections = casts[3]
    near = path[:, 2] < RIM + SCENARIO.ball.radius
    bounced = detections.copy()
    bounced[near, :, 0] += 40.0
    np.testing.assert_array_equal(watch(bounced)[-1].landing.position, watch(detections)[-1].landing.position)


def test_a_ball_that_swings_on_never_lands():
    rng = np.random.default_rng(2)
    state = np.array([[0.5, 0.0, 0.2, 0.8, 0.0, 0.0, 0.6]])
    still, path = hand_at(0), []
    for _ in range(40):
        path.append(state[0, :3])
        state = moved(state, Hand.between(still, still, FRAME), FRAME, GRAVITY)
    beliefs = watch(look(np.array(path), rng), hand=lambda _: still)
    assert not any(belief.is_down for belief in beliefs[:40])


def test_triangulation_is_as_exact_as_it_says():
    rng = np.random.default_rng(3)
    p_WL, p_WE = np.array([0.45, 0.0, 0.8 - np.sqrt(0.36 - 0.0025)]), np.array([0.5, 0.0, 0.8])
    found = [triangulate(CAMERAS, look(p_WL[np.newaxis], rng)[0], p_WE, 0.6) for _ in range(50)]
    squared = [(x[:3] - p_WL) @ np.linalg.solve(C[:3, :3], x[:3] - p_WL) for x, C in found]
    assert np.mean(squared) == pytest.approx(3, rel=0.5)
    one_camera = look(p_WL[np.newaxis], rng)[0]
    one_camera[1] = np.nan
    x, C = triangulate(CAMERAS, one_camera, p_WE, 0.6)
    assert np.linalg.norm(x[:3] - p_WL) < 0.03
    assert np.trace(C[:3, :3]) > 4 * np.trace(found[0][1][:3, :3])


def test_one_deviation_for_both_directions_has_their_mean_variance():
    assert ObservedLanding(np.zeros(2), np.array([[9e-6, 2e-6], [2e-6, 16e-6]])).std == pytest.approx(np.sqrt(12.5e-6))
    assert replace(BallBelief(), n_seen=3).landing is None
