"""What is known of the ball after each picture: a cubature Kalman filter over pendulum and free fall, in pure functions.

The filter is that of Arasaratnam and Haykin, Cubature Kalman Filters, 2009: a covariance is carried by 2 n points at equal weights,
so that neither motion nor cameras need a derivative. By hand: the maintained packages filter linear models, or want JAX.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from wam_cast.perception.ball_motion import SLACK, Hand, moved, pull
from wam_cast.perception.pinhole import Camera
from wam_cast.perception.triangulation import STRING_STD, across_plane, pixel_std, triangulate, visible_part
from wam_cast.scenario import Scenario
from wam_cast.types import Array

N_STATES = 7
"""Position, velocity, and the length of the string."""

SPEED_STD, ACROSS_SPEED_STD = 2.0, 0.03
"""Of the ball's velocity at first sight, in the casting plane and across it [m/s]."""

FREE_NOISE, TAUT_NOISE, ACROSS_NOISE = 0.0003, 0.3, 0.0001
"""Density of the acceleration that the motion does not know [m^2/s^3]: free, where the slack string drags at the ball; on the
string, where the hand's acceleration is known from encoders; and across the casting plane, where nothing drives it."""

PULL_SHARE = 0.2
"""A string that pulls by more than this share of the ball's weight is straight."""

GATE = 5.0
"""Standard deviations by which a centre may be off what is expected; farther off it is something else."""

HIDDEN_SHARE = 0.8
"""A patch narrower than this share of what the ball looks like is part of a ball that something hides."""

SMALLEST = 1e-12
"""Variance that is added where a root is taken of them [m^2], against rounding: a micrometre's."""

LEAST_FRAMES = 3
"""In which the ball must have been seen: its velocity takes two, and one that agrees."""


@dataclass(frozen=True, eq=False)
class ObservedLanding:
    """Where the ball comes down through the rim plane, as observed.

    Attributes
    ----------
    position
        World (x, y) [m], shape (2,).
    covariance
        Of it [m^2], shape (2, 2).
    """

    position: Array
    covariance: Array

    @property
    def std(self) -> float:
        """One standard deviation for both directions, of equal mean variance [m]."""
        return math.sqrt(float(np.trace(self.covariance)) / 2)


@dataclass(frozen=True, eq=False)
class BallBelief:
    """What is known of the ball.

    Attributes
    ----------
    mean, covariance
        Of p_WL [m], v_WL [m/s] and the string's length [m]: (7,) and (7, 7); none before it was seen.
    hand
        p_WE and v_WE of the last picture, (6,); none before the first.
    n_seen
        Pictures in which a camera saw it.
    landing
        Once it has come down; none if too little was seen of it.
    is_down
        Whether it has: then nothing changes any more.
    """

    mean: Array | None = None
    covariance: Array | None = None
    hand: Array | None = None
    n_seen: int = 0
    landing: ObservedLanding | None = None
    is_down: bool = False


class BallFilter:
    """Takes what cameras see at equal times, and says where the ball is and where it lands.

    Parameters
    ----------
    scenario
        As it is believed to be: gravity, string, ball, the height of the rim.
    cameras
        As they are believed to stand.
    period
        From picture to picture [s].
    calibration_std
        Of a landing for errors in where the cameras stand, in x and in y [m].
    """

    def __init__(
        self, scenario: Scenario, cameras: Sequence[Camera], period: float, calibration_std: float = 0.0
    ) -> None:
        self._scenario, self._cameras, self._period = scenario, tuple(cameras), period
        self._calibration_std = calibration_std

    def after(self, belief: BallBelief, detections: Array, hand: Array) -> BallBelief:
        """Return what is known after one more picture of each camera.

        Parameters
        ----------
        belief
            What was known after the picture before.
        detections
            A row a camera: `Detection`'s four values, nan where it sees none, shape (n, 4).
        hand
            p_WE [m] and v_WE [m/s] in the arm's own opinion, (6,).
        """
        if belief.is_down:
            return belief
        if belief.mean is None or belief.covariance is None or belief.hand is None:
            return self._first_sight(detections, hand)
        way = Hand.between(belief.hand, hand, self._period)
        mean, covariance = self._predicted(belief.mean, belief.covariance, way, self._period)
        clear = self._scenario.cup.rim_height + self._scenario.ball.radius
        if mean[2] < clear and mean[5] < 0:  # what the rim makes of it does not count
            return replace(belief, hand=hand, landing=self._landing(belief, way), is_down=True)
        seen = self._credible(mean, covariance, detections)
        if seen.any():
            mean, covariance = self._updated_by_pixels(mean, covariance, detections, seen)
        return BallBelief(*self._straightened(mean, covariance, way), hand, belief.n_seen + int(seen.any()))

    def _first_sight(self, detections: Array, hand: Array) -> BallBelief:
        if not visible_part(detections).any():
            return BallBelief()
        found, covariance = triangulate(self._cameras, detections, hand[:3], self._scenario.string.length)
        mean = np.concatenate([found[:3], hand[3:], found[3:]])
        at = np.r_[0:3, 6]
        across = across_plane(hand[:3])
        whole = np.zeros((N_STATES, N_STATES))
        whole[np.ix_(at, at)] = covariance
        whole[3:6, 3:6] = SPEED_STD**2 * np.eye(3) + (ACROSS_SPEED_STD**2 - SPEED_STD**2) * np.outer(across, across)
        return BallBelief(mean, whole, hand, 1)

    def _predicted(self, mean: Array, covariance: Array, way: Hand, duration: float) -> tuple[Array, Array]:
        """Return the state a time [s] later."""
        later = moved(_points(mean, covariance), way, duration, self._scenario.gravity)
        mean_later, covariance_later = _moments(later)
        is_near = np.linalg.norm(mean[:3] - way.p_WE) > mean[6] - SLACK
        density, across = TAUT_NOISE if is_near else FREE_NOISE, across_plane(way.p_WE)
        directions = density * np.eye(3) + (ACROSS_NOISE - density) * np.outer(across, across)
        growth = np.array([[duration**3 / 3, duration**2 / 2], [duration**2 / 2, duration]])
        covariance_later[:6, :6] += np.kron(growth, directions)
        return mean_later, covariance_later

    def _credible(self, mean: Array, covariance: Array, detections: Array) -> NDArray[np.bool_]:
        """Return which detections can be of the ball, all of it, shape (n,)."""
        seen = visible_part(detections)
        points = _points(mean, covariance)[:, :3]
        for i in np.flatnonzero(seen):
            camera, detection = self._cameras[i], detections[i]
            expected, spread = _moments(camera.project(points))
            spread += np.eye(2) * pixel_std(detections[i : i + 1])[0] ** 2
            off = detection[:2] - expected
            is_near = off @ np.linalg.solve(spread, off) < GATE**2
            depth = float((mean[:3] - camera.p_WV) @ camera.R_WV[:, 2])
            looks = camera.focal_length * self._scenario.ball.radius / depth
            seen[i] = is_near and detection[3] > HIDDEN_SHARE * looks
        return seen

    def _updated_by_pixels(
        self, mean: Array, covariance: Array, detections: Array, seen: NDArray[np.bool_]
    ) -> tuple[Array, Array]:
        cameras = [self._cameras[i] for i in np.flatnonzero(seen)]

        def project(points: Array) -> Array:
            return np.hstack([camera.project(points[:, :3]) for camera in cameras])

        variances = np.repeat(pixel_std(detections[seen]) ** 2, 2)
        return _updated(mean, covariance, project, detections[seen, :2].ravel(), variances)

    def _straightened(self, mean: Array, covariance: Array, way: Hand) -> tuple[Array, Array]:
        """Return the state, known to be as far from the hand as the string is long if that pulls."""
        p_WE, v_WE = way.at(self._period)
        r = mean[:3] - p_WE
        gravity = self._scenario.gravity
        pulls = float(pull(r[np.newaxis], (mean[3:6] - v_WE)[np.newaxis], way.a_WE, gravity)[0])
        if pulls * np.linalg.norm(r) < PULL_SHARE * gravity or np.linalg.norm(r) < mean[6] - SLACK:
            return mean, covariance

        def stretch(points: Array) -> Array:
            return np.asarray(np.linalg.norm(points[:, :3] - p_WE, axis=1) - points[:, 6])[:, np.newaxis]

        return _updated(mean, covariance, stretch, np.zeros(1), np.array([STRING_STD**2]))

    def _landing(self, belief: BallBelief, way: Hand) -> ObservedLanding | None:
        """Return where a ball that is above the rim plane comes down through it; none if too little was seen of it."""
        assert belief.mean is not None
        assert belief.covariance is not None
        if belief.n_seen < LEAST_FRAMES:
            return None
        height, gravity = self._scenario.cup.rim_height, self._scenario.gravity
        above, rising = belief.mean[2] - height, belief.mean[5]
        duration = (rising + math.sqrt(max(rising**2 + 2 * gravity * above, 0.0))) / gravity
        mean, covariance = self._predicted(belief.mean, belief.covariance, way, duration)
        points = _points(mean, covariance)
        late = (height - points[:, 2]) / np.minimum(points[:, 5], -1e-3)
        position, spread = _moments(points[:, :2] + late[:, np.newaxis] * points[:, 3:5])
        return ObservedLanding(position, spread + self._calibration_std**2 * np.eye(2))


def _points(mean: Array, covariance: Array) -> Array:
    """Return the cubature points of a normal distribution, shape (2 n, n)."""
    n = len(mean)
    root = np.linalg.cholesky(covariance + SMALLEST * np.eye(n))
    return np.vstack([mean + math.sqrt(n) * root.T, mean - math.sqrt(n) * root.T])


def _moments(points: Array) -> tuple[Array, Array]:
    """Return mean and covariance of cubature points."""
    mean = points.mean(axis=0)
    away = points - mean
    return mean, away.T @ away / len(points)


def _updated(
    mean: Array, covariance: Array, measure: Callable[[Array], Array], seen: Array, variances: Array
) -> tuple[Array, Array]:
    """Return mean and covariance after a measurement: `measure` gives what it is at points, shape (2 n, m); `seen` is (m,)."""
    points = _points(mean, covariance)
    expected = measure(points)
    middle, spread = _moments(expected)
    cross = (points - mean).T @ (expected - middle) / len(points)
    gain = np.linalg.solve(spread + np.diag(variances), cross.T).T
    later = covariance - gain @ (spread + np.diag(variances)) @ gain.T
    return mean + gain @ (seen - middle), (later + later.T) / 2
