"""The ball on a string and in free fall: closed forms, and what must not depend on who looks."""

import numpy as np
import pytest

from wam_cast.perception.ball_motion import Hand, moved, pull

GRAVITY = 9.81
AT_REST = Hand(np.array([0.5, 0.0, 0.8]), np.zeros(3), np.zeros(3))
FRAME = 1 / 60


def swung(states, hand, duration):
    n = round(duration / FRAME)
    for _ in range(n):
        states = moved(states, hand, FRAME, GRAVITY)
    return states


def test_a_slack_ball_flies_along_a_parabola():
    state = np.array([[0.5, 0.1, 0.4, 1.1, -0.2, 0.3, 0.6]])
    p, v = state[0, :3], state[0, 3:6]
    down = np.array([0.0, 0.0, -GRAVITY])
    later = moved(state, AT_REST, 0.1, GRAVITY)[0]
    np.testing.assert_allclose(later, np.concatenate([p + 0.1 * v + 0.005 * down, v + 0.1 * down, [0.6]]), atol=1e-12)


def test_a_hanging_ball_stays_and_its_string_carries_its_weight():
    hanging = np.array([[0.5, 0.0, 0.2, 0.0, 0.0, 0.0, 0.6]])
    np.testing.assert_allclose(swung(hanging, AT_REST, 0.5), hanging, atol=1e-12)
    r = hanging[:, :3] - AT_REST.p_WE
    np.testing.assert_allclose(0.6 * pull(r, np.zeros((1, 3)), np.zeros(3), GRAVITY), GRAVITY)


def test_a_small_swing_has_the_period_of_a_pendulum():
    angle, length = 0.02, 0.6
    start = [0.5 + length * np.sin(angle), 0.0, 0.8 - length * np.cos(angle), 0.0, 0.0, 0.0, length]
    half = np.pi * np.sqrt(length / GRAVITY)
    states, hand, n = np.array([start]), AT_REST, 40
    for _ in range(n):
        states = moved(states, hand, half / n, GRAVITY)
    assert states[0, 0] == pytest.approx(0.5 - length * np.sin(angle), abs=1e-5)


def test_a_swing_keeps_its_energy_and_its_string_its_length():
    state = np.array([[0.5 + 0.6 * np.sin(0.7), 0.0, 0.8 - 0.6 * np.cos(0.7), 0.0, 0.4, 0.0, 0.6]])

    def energy(one):
        return GRAVITY * one[0, 2] + one[0, 3:6] @ one[0, 3:6] / 2

    later = swung(state, AT_REST, 0.5)
    assert energy(later) == pytest.approx(energy(state), rel=2e-3)
    assert np.linalg.norm(later[0, :3] - AT_REST.p_WE) == pytest.approx(0.6, abs=1e-3)


def test_a_ball_feels_an_accelerated_hand_as_another_gravity():
    # Einstein's lift: with a hand that rises at a, all is as at rest under g + a.
    up = Hand(AT_REST.p_WE, np.zeros(3), np.array([0.0, 0.0, 2.0]))
    state = np.array([[0.5 + 0.6 * np.sin(0.3), 0.0, 0.8 - 0.6 * np.cos(0.3), 0.0, 0.1, 0.0, 0.6]])
    rising = moved(state, up, FRAME, GRAVITY)[0]
    resting = moved(state, AT_REST, FRAME, GRAVITY + 2.0)[0]
    p_WE, v_WE = up.at(FRAME)
    np.testing.assert_allclose(rising[:3] - p_WE, resting[:3] - AT_REST.p_WE, atol=1e-9)
    np.testing.assert_allclose(rising[3:6] - v_WE, resting[3:6], atol=1e-6)  # of the steps' own error


def test_a_string_never_pushes_and_a_hand_that_drops_faster_than_the_ball_lets_go():
    drops = Hand(AT_REST.p_WE, np.zeros(3), np.array([0.0, 0.0, -12.0]))
    r = np.array([[0.0, 0.0, -0.6]])
    assert pull(r, np.zeros((1, 3)), drops.a_WE, GRAVITY) == 0
    falls = moved(np.array([[0.5, 0.0, 0.2, 0.0, 0.0, 0.0, 0.6]]), drops, FRAME, GRAVITY)[0]
    assert falls[5] == pytest.approx(-GRAVITY * FRAME)


def test_a_hand_goes_from_one_measurement_to_the_next():
    before, after = np.array([0.5, 0.0, 0.8, 0.1, 0.0, -0.5]), np.array([0.503, 0.0, 0.78, 0.2, 0.0, -0.9])
    p_WE, v_WE = Hand.between(before, after, FRAME).at(FRAME)
    np.testing.assert_allclose(v_WE, after[3:])
    np.testing.assert_allclose(p_WE, before[:3] + FRAME * (before[3:] + after[3:]) / 2)
