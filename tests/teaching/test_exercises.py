"""The checker tells right from wrong, names what fails, and never gives the answer away."""

import re

import numpy as np
import pytest
from numpy.polynomial import Polynomial
from scipy.stats import norm

from wam_cast.errors import InputError
from wam_cast.teaching.exercises import EXERCISES, Standing, check, solved


def named(name, answer):
    answer.__name__ = name
    return answer


MISTAKES = [
    (
        "hand_position",
        lambda q, lengths: [-(lengths @ np.cos(q.cumsum())), lengths @ np.sin(q.cumsum())],
        "wrong order",
    ),
    ("hand_position", lambda q, lengths: [lengths @ np.sin(q), -(lengths @ np.cos(q))], "a joint turns all that hangs"),
    ("hand_position", lambda q, lengths: [lengths @ np.cos(q.cumsum()), lengths @ np.sin(q.cumsum())], "must hang"),
    ("hand_position", lambda q, lengths: np.zeros(3), r"must be of shape \(2,\), and has the shape \(3,\)"),
    ("hand_position", lambda q, lengths: "there", "must be numbers, not str"),
    ("hand_position", lambda q, lengths: [np.nan, 0.0], "not finite"),
    (
        "hand_position",
        lambda q, lengths: q / 0 if q[0] else 1 / 0,
        r"raises ZeroDivisionError: division by zero \(line",
    ),
    ("hand_jacobian", lambda q, lengths: np.zeros((len(q), 2)), r"has the shape \(3, 2\) \(transposed\?\)"),
    ("hand_jacobian", lambda q, lengths: lengths * [np.cos(q.cumsum()), np.sin(q.cumsum())], "not its own alone"),
    ("joint_torques", lambda J, force: -J.T @ force, "the sign is wrong"),
    ("joint_torques", lambda J, force: np.linalg.pinv(J) @ force, "virtual work"),
    ("joint_torques", lambda J, force: J @ force, "raises ValueError"),
    ("null_space_torque", lambda J, torque: np.zeros_like(torque), "more was taken away"),
    ("null_space_torque", lambda J, torque: torque, "the part that pushes|is not zero, so it still pushes"),
    ("hand_law", lambda J, p, v, kp, kd: J.T @ (kp * p - kd * v), "the damper has the wrong sign"),
    ("hand_law", lambda J, p, v, kp, kd: J.T @ (kp * p), "the damper is missing"),
    ("ball_acceleration", lambda hand, ball, length, g: g / length * (ball - hand), "drives the ball away"),
    ("ball_acceleration", lambda hand, ball, length, g: g * (hand - ball), "a longer string must swing more slowly"),
    ("hand_for_ball", lambda ball, a, length, g: ball - length / g * a, "on the wrong side"),
    ("hand_for_ball", lambda ball, a, length, g: ball + g / length * a, "length and gravity are exchanged"),
    (
        "step_coefficients",
        lambda: [0, 0, 0, 10, -15, 6],
        "derivative number 3 is not zero, so the hand's velocity jumps",
    ),
    ("step_coefficients", lambda: [0, 1], "derivative number 1 is not zero, so the ball's velocity jumps"),
    ("step_coefficients", lambda: [70, -315, 540, -420, 126, 0, 0, 0, 0, 0], "the lowest power comes first"),
    ("step_coefficients", lambda: [0, 0, 0, 0, 0, 1], "at s = 1 the derivative number 1"),
    ("arc_motion", lambda a, w, c, r: (r * unit(a), r * c * unit(a + np.pi / 2)), "still changes its direction"),
    ("arc_motion", lambda a, w, c, r: r * unit(a), r"position must be of shape \(2,\)"),
    ("arc_motion", lambda a, w, c, r: (r * unit(a),), "must return 2 things: position, acceleration"),
    ("turning_hand", lambda t, a, T, r, length, g: r * unit(a * quintic(t / T)), "the ball still swings by"),
    ("turning_hand", lambda t, a, T, r, length, g: r * unit(a), "at the start the hand is not"),
    (
        "monomials",
        lambda X, degree: np.hstack([X**k for k in range(degree + 1)]),
        "a product of several variables|too many",
    ),
    ("monomials", lambda X, degree: X, "a constant is not among"),
    ("gaussian_kernel", lambda A, B, s: np.exp(-(distance(A, B) ** 2) / (2 * s**2)), "falls off too slowly"),
    ("gaussian_kernel", lambda A, B, s: np.exp(-distance(A, B) / s), "the distance is not squared"),
    ("gaussian_kernel", lambda A, B, s: A @ B.T, "as like itself as can be"),
    ("gaussian_kernel", lambda A, B, s: np.exp(-distance(A, B).T), "shape|fall off"),
    ("gaussian_kernel", lambda A, B, s: np.tri(len(A), len(B)), "not symmetric"),
    ("ridge_weights", lambda K, y, lam: np.linalg.solve(K + lam, y), "to the diagonal alone"),
    ("ridge_weights", lambda K, y, lam: np.linalg.solve(K, y), "regularization is missing"),
    ("leave_one_out", lambda K, y, lam: y - K @ weights(K, y, lam), "casts that the model has learned from"),
    ("leave_one_out", lambda K, y, lam: -weights(K, y, lam) / np.diag(inverse(K, lam)), "measured minus predicted"),
    ("leave_one_out", lambda K, y, lam: np.mean(y), r"has the shape \(\)"),
    ("best_sigma", lambda X, y, sigmas, lam: min(sigmas, key=lambda s: training(X, y, s, lam)), "learned from"),
    ("best_sigma", lambda X, y, sigmas, lam: 0.123, "none of the sigmas"),
    ("landing_std", lambda slopes, s, m: np.sum((slopes * s) ** 2) + m**2, "that is the variance"),
    ("landing_std", lambda slopes, s, m: np.linalg.norm(slopes * s), "the model's own error is missing"),
    ("landing_std", lambda slopes, s, m: np.abs(slopes * s).sum() + m, "as if all were bad at once"),
    ("hit_probability", lambda o, s, r: 1 - 2 * norm.cdf(-r / s), "off the middle"),
    ("hit_probability", lambda o, s, r: norm.cdf(r, o, s), "one side only"),
    ("disc_probability", lambda o, s, r: np.prod(norm.cdf(r, o, s) - norm.cdf(-r, o, s)), "a square about the circle"),
    ("best_cast", lambda o, s, r: np.argmin(np.linalg.norm(o, axis=1)), "predicted to miss least"),
    ("best_cast", lambda o, s, r: np.argmin(s.prod(axis=1)), "scatters least"),
    ("best_cast", lambda o, s, r: -1, "from 0 on"),
    ("restitution", lambda drop, bounce: bounce / drop, "a ratio of speeds"),
    ("bouncing_time", lambda h, e, g: np.sqrt(2 * h / g) * 2 * e / (1 - e), "the first fall is missing"),
    ("bouncing_time", lambda h, e, g: np.sqrt(2 * h / g) / (1 - e), "a way up and a way down"),
    ("contact_force", lambda x, v, k, d: k * x * (1 + d * v), "where nothing touches"),
    ("contact_force", lambda x, v, k, d: k * max(x, 0) * (1 + d * v), "it can only push"),
    ("contact_force", lambda x, v, k, d: k * max(x, 0) * max(1 - d * v, 0), "stronger where the bodies part|pulls"),
    ("rebound_speed", lambda speed, m, k, d: speed, "no speed was lost"),
    ("rebound_speed", lambda speed, m, k, d: speed / (1 + d * speed), "at another speed"),
    ("dissipation_for", lambda e, speed: (1 - e) / speed, "the ball keeps 0"),
    ("posterior", lambda m, S, f, o, s: update(m, S, f, o, s**0.5), "taken for its variance"),
    ("posterior", lambda m, S, f, o, s: update(m, S, f, o + f @ m, s), "not taken off what was seen"),
    ("posterior", lambda m, S, f, o, s: (m, S), "less uncertain than before"),
    ("posterior", lambda m, S, f, o, s: (m, S + np.tri(4) - np.eye(4)), "not symmetric"),
    ("believed", lambda f, m, S: (f @ m, f @ S @ f), "that is the variance"),
    ("believed", lambda f, m, S: (f @ m, np.sqrt(f**2 @ np.diag(S))), "more than a diagonal"),
    ("most_telling", lambda c, t, S, s: np.argmax([f @ S @ f for f in c]), "is itself most uncertain"),
    ("aim", lambda cup, features_of, m: cup - features_of(cup) @ m, "once is not enough"),
    ("aim", lambda cup, features_of, m: cup, "does not correct"),
]


def unit(angle):
    return np.array([np.cos(angle), np.sin(angle)])


def quintic(s):
    return Polynomial([0, 0, 0, 10, -15, 6])(s)


def distance(A, B):
    return np.linalg.norm(A[:, None] - B, axis=2)


def inverse(K, lam):
    return np.linalg.inv(K + lam * np.eye(len(K)))


def weights(K, y, lam):
    return inverse(K, lam) @ y


def training(X, y, sigma, lam):
    K = np.exp(-(distance(X, X) ** 2) / sigma**2)
    return np.linalg.norm(y - K @ weights(K, y, lam))


def update(m, S, f, o, s):
    gain = S @ f / (f @ S @ f + s**2)
    return m + gain * (o - f @ m), S - np.outer(gain, S @ f)


@pytest.mark.parametrize(("task", "answer", "words"), MISTAKES)
def test_mistakes_are_named_in_one_line(task, answer, words):
    verdict = check(named(task, answer))
    assert verdict.standing is Standing.WRONG
    assert not verdict.is_right
    assert re.search(words, verdict.words), verdict.words
    assert str(verdict) == f"{task}: wrong: {verdict.words}"
    assert len(str(verdict).splitlines()) == 1
    assert len(str(verdict)) < 300
    assert not re.search(r"np\.|\*\*|@", verdict.words), "that is the answer"


def test_every_task_has_a_mistake_that_is_named():
    assert {task for task, *_ in MISTAKES} == {task for tasks in EXERCISES.values() for task in tasks}


def test_what_is_not_written_is_not_yet():
    def needs_another(J, torque):
        return torque - None

    for answer in (lambda *_: None, lambda *_: ..., lambda *_: 1 / (... + 1)):
        verdict = check(named("null_space_torque", answer))
        assert verdict.standing is Standing.NOT_YET
    verdict = check(named("null_space_torque", needs_another))
    assert (
        str(verdict) == "null_space_torque: not yet: something that it needs returns nothing so far; solve that first"
    )
    assert str(check(named("posterior", lambda *_: (None, None)))) == "posterior: not yet"


def test_what_is_to_be_solved_first_is_named(capsys):
    def restitution(drop_height, bounce_height):
        return np.sqrt(bounce_height / drop_height)

    def bouncing_time(height, e, gravity):
        return ...

    assert solved() and solved(restitution)
    assert capsys.readouterr().out == ""
    assert not solved(restitution, bouncing_time)
    assert capsys.readouterr().out == "solve first: bouncing_time\n"


def test_an_array_that_was_given_is_left_alone():
    def in_place(J, torque):
        torque -= J.T @ np.linalg.solve(J @ J.T, J @ torque)
        return torque

    assert "work on a copy" in check(named("null_space_torque", in_place)).words


def test_inputs_are_hidden_drawn_by_the_seed_and_always_the_same():
    asked = []

    def watched(J, force):
        asked.append(force)
        return J.T @ force

    for seed in (0, 0, 1):
        assert check(named("joint_torques", watched), seed=seed).is_right
    first, again, other = (np.concatenate(asked[i : i + 2]) for i in (0, 2, 4))
    np.testing.assert_array_equal(first, again)
    assert np.abs(first - other).min() > 1e-6


def test_an_interruption_by_the_learner_is_not_swallowed():
    def endless(J, force):
        raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        check(named("joint_torques", endless))


@pytest.mark.parametrize(
    ("given", "words"),
    [
        (np.zeros(3), "check takes the function itself"),
        (lambda q: q, "'<lambda>' is no task's function; the tasks are: hand_position"),
        (None, "check takes the function itself"),
    ],
)
def test_what_is_no_answer_is_refused(given, words):
    with pytest.raises(InputError, match=re.escape(words)):
        check(given)
