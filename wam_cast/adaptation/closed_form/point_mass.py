"""A ball on a massless inextensible string, taut or slack, whose upper end follows a given path: where it comes down.

In the casting plane, for many casts at once, without Drake or JAX. While the string is taut the ball swings as a pendulum; where
its tension would be negative the ball flies on a parabola, until the string is as long as it can be again: then the ball loses the
velocity with which it would go on to stretch it.
"""

from __future__ import annotations

from typing import NamedTuple, Self

import numpy as np
from numpy.typing import NDArray

from wam_cast.adaptation.closed_form.hand_path import HandPath, Rows
from wam_cast.motion.pendulum import string_matrices
from wam_cast.scenario import Scenario
from wam_cast.types import Array

STEP = 0.004
"""Of the integration [s]."""

N_SECANTS = 8
"""With which the time of an event is found in a step."""

N_HALVINGS = 30
"""With which a crossing of the rim plane is."""

LEAST_SHARE = 1e-3
"""Of a step that is taken to an event, so that time goes on."""


class Swing(NamedTuple):
    """How the ball swings below the hand while the string is taut.

    With theta the string's angle from straight down, outward, and a the hand's acceleration::

        theta'' = -((g + a_z) sin(theta) + a_x cos(theta)) / reduced_length - damping theta'
    """

    length: float
    """From the hand to the ball's centre [m]."""
    reduced_length: float
    """From the hand to the centre of oscillation [m]: of a point mass, `length`."""
    damping: float
    """[1/s]"""
    gravity: float
    """[m/s^2]"""

    @classmethod
    def of(cls, scenario: Scenario) -> Self:
        """Return how a scenario's string and ball swing, straight as one rigid body: with the string's mass and the ball's size."""
        inertia, damping, stiffness = (float(matrix.sum()) for matrix in string_matrices(scenario))
        return cls(scenario.string.length, scenario.gravity * inertia / stiffness, damping / inertia, scenario.gravity)

    @classmethod
    def of_point(cls, scenario: Scenario) -> Self:
        """Return how a point mass on a massless string would."""
        return cls(scenario.string.length, scenario.string.length, 0.0, scenario.gravity)


class Landings(NamedTuple):
    """Where and how balls come down through the rim plane; nan where they do not, (n,) each but for the velocity."""

    radius: Array
    """[m]"""
    velocity: Array
    """Outward and up [m/s], (2, n)."""
    crossing_time: Array
    """[s]"""
    crossing_slack: Array
    """Of the string at the crossing [m]."""
    slack: Array
    """The least from there until the whole ball is below the plane [m]."""


class Balls(NamedTuple):
    """Balls at a time of their own, (n,); vectors (2, n), outward and up."""

    t: Array
    is_taut: NDArray[np.bool_]
    angle: Array
    rate: Array
    """Of the string, from straight down; of no meaning where it is slack."""
    place: Array
    velocity: Array

    def of(self, rows: Rows) -> Balls:
        """Return some of them."""
        return Balls._make(values[..., rows] for values in self)

    def with_rows(self, rows: Rows, balls: Balls) -> Balls:
        """Return all of them, some of them replaced."""
        replaced = Balls._make(values.copy() for values in self)
        for values, new in zip(replaced, balls, strict=True):
            values[..., rows] = new
        return replaced


class PointMass:
    """Balls on strings below hands that follow a path."""

    def __init__(self, swing: Swing, path: HandPath) -> None:
        self._swing, self._path = swing, path

    def at_rest(self, n: int) -> Balls:
        """Return n balls that hang still at the time 0."""
        hand, velocity, _ = self._path(np.zeros(n), np.arange(n))
        place = hand - [[0.0], [self._swing.length]]
        return Balls(np.zeros(n), np.ones(n, dtype=bool), np.zeros(n), np.zeros(n), place, velocity)

    def advanced(self, balls: Balls, rows: Rows, step: float = STEP) -> Balls:
        """Return the balls of the casts `rows` a step [s] later, or where the string went slack or taut on the way."""
        after = self._moved(balls, rows, np.full(len(rows), step))
        found = np.flatnonzero(self._excess(after, rows) > 0)
        if not len(found):
            return after
        before, of_event = balls.of(found), rows[found]
        h = self._time_of_event(before, of_event, step)
        return after.with_rows(found, self._switched(self._moved(before, of_event, h), of_event))

    def _time_of_event(self, balls: Balls, rows: Rows, step: float) -> Array:
        """Return when, within a step [s], strings can no longer be as they are: by the Illinois method, (n,)."""
        low, high = np.full(len(rows), LEAST_SHARE * step), np.full(len(rows), step)
        below, above = (self._excess(self._moved(balls, rows, h), rows) for h in (low, high))
        is_late = below >= 0
        for _ in range(N_SECANTS):
            h = np.where(is_late, low, high - above * (high - low) / np.where(is_late, 1.0, above - below))
            value = self._excess(self._moved(balls, rows, h), rows)
            is_over = value > 0
            # An end that stays counts half, lest it stay for ever.
            below, above = np.where(is_over, below / 2, value), np.where(is_over, value, above / 2)
            low, high = np.where(is_over, low, h), np.where(is_over, h, high)
        return np.where(is_late, LEAST_SHARE * step, high)

    def tension(self, balls: Balls, rows: Rows) -> Array:
        """Return what a taut string would have to pull the ball with, by its mass [m/s^2], (n,)."""
        _, _, acceleration = self._path(balls.t, rows)
        along, _ = _directions(balls.angle)
        needed = (acceleration * along).sum(axis=0) + self._swing.gravity * along[1]
        return np.asarray(self._swing.length * balls.rate**2 - needed)

    def slack(self, balls: Balls, rows: Rows) -> Array:
        """Return by how much hand and ball are closer than the string is long [m], (n,)."""
        hand, _, _ = self._path(balls.t, rows)
        return np.asarray(self._swing.length - np.hypot(*(balls.place - hand)))

    def _excess(self, balls: Balls, rows: Rows) -> Array:
        """Return what is above zero where a string can no longer be as it is, (n,)."""
        return -np.where(balls.is_taut, self.tension(balls, rows), self.slack(balls, rows))

    def _switched(self, balls: Balls, rows: Rows) -> Balls:
        """Return the balls after their strings went slack, or were pulled tight, where they hold if they are pulled still."""
        hand, hand_velocity, _ = self._path(balls.t, rows)
        offset = balls.place - hand
        angle = np.arctan2(offset[0], -offset[1])
        along, across = _directions(angle)
        rate = ((balls.velocity - hand_velocity) * across).sum(axis=0) / self._swing.length
        tight = balls._replace(
            is_taut=~balls.is_taut,
            angle=angle,
            rate=rate,
            place=hand + self._swing.length * along,
            velocity=hand_velocity + self._swing.length * rate * across,
        )
        return tight._replace(is_taut=tight.is_taut & (self.tension(tight, rows) > 0))

    def _moved(self, balls: Balls, rows: Rows, h: Array) -> Balls:
        """Return the balls times h [s] later, their strings as they are."""
        fall = np.stack([np.zeros_like(h), -self._swing.gravity * h])
        flown = balls._replace(
            t=balls.t + h, place=balls.place + h * (balls.velocity + fall / 2), velocity=balls.velocity + fall
        )
        taut = np.flatnonzero(balls.is_taut)
        return flown.with_rows(taut, self._swung(balls.of(taut), rows[taut], h[taut])) if len(taut) else flown

    def _swung(self, balls: Balls, rows: Rows, h: Array) -> Balls:
        """Return balls on taut strings later, by Runge and Kutta's fourth order."""
        first, second, third = (self._path(balls.t + share * h, rows) for share in (0.0, 0.5, 1.0))
        angle, rate = balls.angle, balls.rate
        a_1 = self._turning(angle, rate, first[2])
        a_2 = self._turning(angle + h / 2 * rate, rate + h / 2 * a_1, second[2])
        a_3 = self._turning(angle + h / 2 * (rate + h / 2 * a_1), rate + h / 2 * a_2, second[2])
        a_4 = self._turning(angle + h * (rate + h / 2 * a_2), rate + h * a_3, third[2])
        angle = angle + h * rate + h**2 / 6 * (a_1 + a_2 + a_3)
        rate = rate + h / 6 * (a_1 + 2 * a_2 + 2 * a_3 + a_4)
        along, across = _directions(angle)
        length = self._swing.length
        return balls._replace(
            t=balls.t + h,
            angle=angle,
            rate=rate,
            place=third[0] + length * along,
            velocity=third[1] + length * rate * across,
        )

    def _turning(self, angle: Array, rate: Array, acceleration: Array) -> Array:
        """Return the string's angular acceleration below a hand that accelerates."""
        _, length, damping, gravity = self._swing
        pull = (gravity + acceleration[1]) * np.sin(angle) + acceleration[0] * np.cos(angle)
        return np.asarray(-pull / length - damping * rate)


def fall(
    swing: Swing, path: HandPath, latest: Array, rim_height: float, ball_radius: float, step: float = STEP
) -> Landings:
    """Return where balls that hang still at first come down, each before a latest time [s], (n,)."""
    n, model = len(latest), PointMass(swing, path)
    balls = model.at_rest(n)
    found = Landings(np.full(n, np.nan), np.full((2, n), np.nan), *np.full((3, n), np.nan))
    rows = np.arange(n)
    while len(rows):
        before = balls.of(rows)
        after = model.advanced(before, rows, step)
        balls = balls.with_rows(rows, after)
        crosses = (before.place[1] > rim_height) & (after.place[1] <= rim_height) & np.isnan(found.radius[rows])
        if crosses.any():
            here = _crossing(before.of(crosses), after.of(crosses), rim_height)
            slack = model.slack(here, rows[crosses])
            for values, new in zip(found, (here.place[0], here.velocity, here.t, slack, slack), strict=True):
                values[..., rows[crosses]] = new
        is_above = after.place[1] > rim_height - ball_radius
        falls = ~np.isnan(found.radius[rows]) & is_above
        found.slack[rows[falls]] = np.minimum(found.slack[rows[falls]], model.slack(after.of(falls), rows[falls]))
        rows = rows[is_above & (after.t < latest[rows])]
    return found


def _crossing(before: Balls, after: Balls, height: float) -> Balls:
    """Return balls on the cubics between two states, where they come down through a height [m]."""
    T = after.t - before.t
    change = after.place - before.place
    bend, twist = (
        3 * change - T * (2 * before.velocity + after.velocity),
        T * (before.velocity + after.velocity) - 2 * change,
    )
    low, high = np.zeros_like(T), np.ones_like(T)
    for _ in range(N_HALVINGS):
        u = 0.5 * (low + high)
        is_above = before.place[1] + u * (T * before.velocity[1] + u * (bend[1] + u * twist[1])) > height
        low, high = np.where(is_above, u, low), np.where(is_above, high, u)
    return before._replace(
        t=before.t + high * T,
        place=before.place + high * (T * before.velocity + high * (bend + high * twist)),
        velocity=before.velocity + high * (2 * bend + 3 * high * twist) / T,
    )


def _directions(angle: Array) -> tuple[Array, Array]:
    """Return the directions along a string, from the hand on, and across it, (2, n) each."""
    s, c = np.sin(angle), np.cos(angle)
    return np.stack([s, -c]), np.stack([c, s])
