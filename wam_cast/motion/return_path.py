"""Return: the hand's way home with the ball, which hangs at rest at its end though nothing measures it.

While the string is slack the ball may lie anywhere in the cup. So the hand draws it slantwise against the cup's wall, where taut
string and wall leave it one place, and then

- goes to above that place, as the ball slides up the wall: there it hangs at rest, and is lifted straight out; or,
- if the cup is farther out than the arm can go, pulls it up and over the wall at a known speed: from above the wall's outer edge
  it swings as a pendulum whose place and speed are known.

From either the ball is given a path to rest at home, and the hand goes where that path asks for it (`.hand_above`).
"""

from __future__ import annotations

import math
from collections.abc import Callable
from itertools import accumulate

import numpy as np

from wam_cast.arm.arm_model import arm_model
from wam_cast.motion.pendulum import Pendulum, hand_above, pendulum_derivatives
from wam_cast.motion.spline import QuinticSpline
from wam_cast.scenario import Scenario
from wam_cast.types import Array

Piece = Callable[[float], tuple[Array, Array]]
"""Time [s] from the piece's start -> the hand's radius and height (2,) [m] and their rates (2,) [m/s]."""

MAX_STRETCH = 0.87 / 0.91
"""How far from the shoulder, relative to the stretched arm, the hand goes with the string taut: the elbow stays bent."""

WALL_SLANT = math.radians(20)
"""Of the string from the vertical where it draws the ball against the wall [rad]."""

PULL_SLACK, PULL_LIFT = 0.015, 0.010
"""The string is drawn tight slowly: from this much slack [m] until the ball hangs this high above the cup's bottom [m]."""

LEAVING_DEPTH = 0.020
"""How far below the rim plane the ball's centre leaves the wall when the hand can be above it [m]."""

CLIMB_SPEED = 0.03
"""Of the hand, upward, as it pulls the ball over the wall [m/s]."""

LARGEST_SLANT = 1.2
"""Of the string from the vertical, to which it may be pulled [rad]."""

LEAST_CLIMB_SLANT = 0.2
"""Of the string at that, at least [rad]: with less the ball is squeezed between wall and string, and shoots out."""


class Return:
    """The return of one cast, in its casting plane.

    Parameters
    ----------
    scenario
        What is fixed.
    far
        The hand's radius at the end of the drop [m].
    cup_radius
        Of the cup's axis, along the casting plane [m]. Without a cup, or with one so far that the arm cannot lift a ball out of
        it, the hand goes straight up, and the ball is taken to hang at rest then.

    Attributes
    ----------
    duration
        Of the return [s].
    """

    def __init__(self, scenario: Scenario, far: float, cup_radius: float | None) -> None:
        motion = scenario.motion
        self._scenario = scenario
        self._length = scenario.string.length
        self._arm = arm_model(scenario.arm)
        start = np.array([far, motion.start_height - motion.drop_distance])
        pieces = self._straight_up(start) if cup_radius is None else self._out_of_cup(start, cup_radius)
        self._pieces = [piece for piece, _ in pieces]
        self._ends = list(accumulate(duration for _, duration in pieces))
        self.duration = self._ends[-1]

    def evaluate(self, t: float) -> tuple[Array, Array]:
        """Return the hand's radius and height (2,) [m] and their rates (2,) [m/s] at a time `t` [s] of the return or after it."""
        for piece, start, end in zip(self._pieces, [0.0, *self._ends], self._ends, strict=False):
            if t < end:
                return piece(t - start)
        return self._home(), np.zeros(2)

    def _home(self) -> Array:
        return np.array([self._scenario.motion.start_radius, self._scenario.motion.start_height])

    def _straight_up(self, start: Array) -> list[tuple[Piece, float]]:
        top = np.array([start[0], self._scenario.motion.start_height])
        duration = self._scenario.motion.lift_duration
        return [(_Line(start, top, duration), duration), self._retreat(top)]

    def _out_of_cup(self, start: Array, cup_radius: float) -> list[tuple[Piece, float]]:
        """Return the pieces that draw the ball against the wall and then lift it out, and the way home."""
        motion, cup, ball = self._scenario.motion, self._scenario.cup, self._scenario.ball
        cup_radius = max(cup_radius, motion.start_radius)
        low = cup.bottom_height + ball.radius + PULL_LIFT
        wall = cup_radius - (cup.inner_radius - ball.radius)
        side = -1.0
        if wall - self._length * math.sin(WALL_SLANT) < motion.start_radius:
            # There is no room for the hand on the near side.
            wall, side = 2 * cup_radius - wall, 1.0
        slant = self._slant(wall, low, side)
        slant_on_edge = self._slant_on_edge(cup_radius - cup.outer_radius)
        if slant is None or slant_on_edge is None:
            return self._straight_up(start)
        tight = _above(wall, low, side * slant, self._length)
        slack = tight - (PULL_SLACK + PULL_LIFT) * np.array([side * math.sin(slant), math.cos(slant)])
        drawing: list[tuple[Piece, float]] = [
            (_Line(start, slack, motion.fetch_duration), motion.fetch_duration),
            (_Line(slack, tight, motion.pull_duration), motion.pull_duration),
        ]
        leave = cup.rim_height - LEAVING_DEPTH
        if wall > self._reach(leave + self._length):
            return drawing + self._over_the_wall(tight, cup_radius - cup.outer_radius, slant_on_edge)
        slide = _Slide(wall, (low, leave), (side * slant, 0.0), self._length, motion.slide_duration)
        above = _above(wall, leave, 0.0, self._length)
        top = np.array([wall, motion.start_height])
        lifting: list[tuple[Piece, float]] = [
            (slide, motion.slide_duration),
            (_Line(above, top, motion.lift_duration), motion.lift_duration),
        ]
        return drawing + lifting + [self._retreat(top)]

    def _over_the_wall(self, tight: Array, edge: float, slant: float) -> list[tuple[Piece, float]]:
        """Return the pieces that pull the ball over a wall whose outer edge is at radius `edge` [m], and the way home.

        The ball lies on the edge when the string, taut at `slant` [rad], lets it: with the hand rising at speed v it slides along
        the flat top at v / tan(slant), so the string turns at v / (length sin(slant)).
        """
        motion = self._scenario.motion
        hand = _above(edge, self._on_edge, -slant, self._length)
        duration = motion.slide_duration + motion.lift_duration
        climb = _Line(tight, hand, duration, np.array([0.0, CLIMB_SPEED]))
        return [(climb, duration), self._retreat(hand, slant, CLIMB_SPEED)]

    @property
    def _on_edge(self) -> float:
        """Height [m] of a ball's centre on the rim."""
        return self._scenario.cup.rim_height + self._scenario.ball.radius

    def _slant_on_edge(self, edge: float) -> float | None:
        """Return the least slant [rad] at which the hand can hold a ball on the rim at radius `edge` [m]; None if there is none."""

        def room(slant: float) -> float:
            radius, height = _above(edge, self._on_edge, -slant, self._length)
            return float(self._reach(height) - radius)

        if room(LEAST_CLIMB_SLANT) >= 0:
            return LEAST_CLIMB_SLANT
        from scipy.optimize import brentq  # takes a quarter of a second, which other cups do without

        return float(brentq(room, LEAST_CLIMB_SLANT, LARGEST_SLANT)) if room(LARGEST_SLANT) >= 0 else None

    def _reach(self, height: float) -> float:
        """Return the largest radius [m] at which the hand can be at `height` [m]."""
        below = self._arm.shoulder_height - height
        reach = MAX_STRETCH * self._arm.stretched_length
        return self._arm.shoulder_radius + math.sqrt(max(reach**2 - below**2, 0.0))

    def _slant(self, wall: float, low: float, side: float) -> float | None:
        """Return the slant [rad] nearest to `WALL_SLANT` at which the hand reaches: the greater, the nearer to the ball."""
        slants = np.linspace(WALL_SLANT, 0.0 if side > 0 else LARGEST_SLANT, 200)
        hands = [_above(wall, low, side * slant, self._length) for slant in slants]
        reachable = [radius <= self._reach(height) for radius, height in hands]
        return float(slants[int(np.argmax(reachable))]) if any(reachable) else None

    def _retreat(self, hand: Array, slant: float = 0.0, speed: float = 0.0) -> tuple[Piece, float]:
        """Return the way home from where the ball hangs outward of the hand by `slant` [rad], and its duration [s].

        The hand rises at `speed` [m/s], which turns the string inward as it does over the cup's wall. The ball's path begins with
        the four derivatives of a free pendulum that does so, and ends at rest with four zero derivatives.
        """
        pendulum, duration = Pendulum.like(self._scenario), self._scenario.motion.retreat_duration
        turning = -speed / (self._length * math.sin(slant)) if slant > 0 else 0.0
        start = hand_derivatives(hand, speed) + pendulum_derivatives(slant, turning, pendulum)
        end = np.zeros((5, 2))
        end[0] = self._home() - [0.0, pendulum.length]
        return _Shaped(_Polynomial(start, end, duration, 4), pendulum), duration


def hand_derivatives(hand: Array, speed: float) -> Array:
    """Return a hand's place (2,) and four derivatives of it, shape (5, 2), as it rises at a steady `speed` [m/s]."""
    derivatives = np.zeros((5, 2))
    derivatives[0], derivatives[1, 1] = hand, speed
    return derivatives


def _above(radius: float, height: float, slant: float, length: float) -> Array:
    """Return where the hand is, shape (2,), when a string taut at `slant` [rad], outward if positive, holds a ball."""
    return np.array([radius + length * math.sin(slant), height + length * math.cos(slant)])


class _Polynomial:
    """A path and its first derivatives, `n` in all, at once: SciPy's evaluation of a single one takes longer.

    All are in Bernstein's basis of the path's degree, which gives the values at both ends exactly.
    """

    def __init__(self, start: list[Array] | Array, end: list[Array] | Array, duration: float, n: int) -> None:
        degree = len(start) + len(end) - 1
        c = np.vstack([_beside(start, duration, degree), _beside(end, -duration, degree)[::-1]])
        self._duration, self._powers = duration, np.arange(degree + 1)
        # The derivative's coefficients are the differences of the path's, times degree / duration.
        rates = [math.perm(degree, order) / duration**order for order in range(n)]
        coefficients = [_raised(rate * np.diff(c, order, axis=0), degree) for order, rate in enumerate(rates)]
        binomials = np.array([[math.comb(degree, power)] for power in self._powers], dtype=float)
        self._coefficients = binomials * np.hstack(coefficients)

    def __call__(self, t: float) -> Array:
        """Return the path's place (2,) and its derivatives at time `t` [s], shape (n, 2)."""
        u = t / self._duration
        return np.asarray(u**self._powers * (1.0 - u) ** self._powers[::-1] @ self._coefficients).reshape(-1, 2)


def _beside(derivatives: list[Array] | Array, duration: float, degree: int) -> Array:
    """Return a polynomial's first coefficients in Bernstein's basis, (k, 2), given its value and k - 1 derivatives where it begins.

    With a negative `duration` they are the last ones, backwards, given the same where it ends. The j-th forward difference at the
    first coefficient is the j-th derivative times duration^j (degree - j)! / degree! (Farin, Curves and Surfaces for CAGD, ch. 5).
    """
    differences = [value * duration**j / math.perm(degree, j) for j, value in enumerate(derivatives)]
    return np.array([sum(math.comb(q, j) * differences[j] for j in range(q + 1)) for q in range(len(differences))])


def _raised(c: Array, degree: int) -> Array:
    """Return a polynomial's coefficients in Bernstein's basis of a higher degree, (degree + 1, 2)."""
    while len(c) <= degree:
        share = np.linspace(0.0, 1.0, len(c) + 1)[:, np.newaxis]
        c = share * np.vstack([np.zeros(2), c]) + (1.0 - share) * np.vstack([c, np.zeros(2)])
    return c


class _Line:
    """From rest at one place to another, without acceleration at the ends, with `end_velocity` (2,) [m/s] at the second."""

    def __init__(self, start: Array, end: Array, duration: float, end_velocity: Array | None = None) -> None:
        rest = np.zeros(2)
        arrival = rest if end_velocity is None else end_velocity
        self._path = _Polynomial([start, rest, rest], [end, arrival, rest], duration, 2)

    def __call__(self, t: float) -> tuple[Array, Array]:
        place, velocity = self._path(t)
        return place, velocity


class _Slide:
    """The ball slides up a wall at radius `wall` [m] between two heights [m], the string between two slants [rad]."""

    def __init__(
        self, wall: float, heights: tuple[float, float], slants: tuple[float, float], length: float, duration: float
    ) -> None:
        self._wall, self._length = wall, length
        self._height = QuinticSpline(0.0, duration, *heights)
        self._slant = QuinticSpline(0.0, duration, *slants)

    def __call__(self, t: float) -> tuple[Array, Array]:
        (height, climbing), (slant, turning) = self._height.evaluate(t), self._slant.evaluate(t)
        velocity = self._length * turning * np.array([math.cos(slant), -math.sin(slant)])
        return _above(self._wall, height, slant, self._length), velocity + np.array([0.0, climbing])


class _Shaped:
    """The hand above a ball whose radius and height are `path`, with three derivatives."""

    def __init__(self, path: _Polynomial, pendulum: Pendulum) -> None:
        self._path, self._pendulum = path, pendulum

    def __call__(self, t: float) -> tuple[Array, Array]:
        ball = np.zeros((4, 3))
        ball[:, ::2] = self._path(t)
        p_WE, v_WE = hand_above(ball[0], ball[1], ball[2], ball[3], self._pendulum)
        return p_WE[::2], v_WE[::2]
