"""Robots as laboratories have them: how far each physical number of one may be from what is believed of it."""

from __future__ import annotations

import math
import zlib
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, Literal, Self

import numpy as np

from wam_cast.errors import InputError, checked_integer, is_finite, quoted
from wam_cast.scenario import Noise, Scenario
from wam_cast.types import Array, checks_types

Kind = Literal["share", "factor", "offset", "fraction", "periods"]


TILT = "arm.base_tilt"
"""What turns with the world and not with the casting plane: its effect is taken apart, for a bearing at a time."""

MOST_FRACTION = 2.0
"""That a scenario allows."""

MOST_SCALE = 1000.0
"""Of ranges."""

MOST_ATTEMPTS = 50
"""To draw a robot that is stable."""


@dataclass(frozen=True)
class Range:
    """How a number of a robot differs from what is believed, and where that is known from.

    Attributes
    ----------
    name
        Of the number in the scenario, such as `"string.length"`.
    kind
        "share": uniform within `size` times the believed value to either side. "factor": log-uniform from the believed value
        divided by `size` to it times `size`. "offset": uniform within `size` [SI units] to either side. "fraction": uniform from
        the believed value to `size` beyond it, the same for all joints, and within `spread` of that for each. "periods": with
        even chances the believed value or `size` beyond it, whatever the scale.
    size
        As of the kind.
    source
        Of the size.
    spread
        For "fraction".
    """

    name: str
    kind: Kind
    size: float
    source: str
    spread: float = 0.0

    def drawn(self, believed: Array, scale: float, rng: np.random.Generator) -> Array:
        """Return the number of one robot, of each joint where it has one for each, shape as of `believed`."""
        # As many draws whatever the scale: a robot of twice the scale differs in the same way, twice as far.
        u = rng.uniform(-1, 1, believed.shape)
        common = rng.uniform(0, 1)
        match self.kind:
            case "share":
                return believed * (1 + scale * self.size * u)
            case "factor":
                return np.asarray(believed * np.exp(scale * math.log(self.size) * u))
            case "offset":
                return believed + scale * self.size * u
            case "fraction":
                own = 1 + min(scale * self.spread, 1.0) * u
                return np.minimum(believed + scale * self.size * common * own, MOST_FRACTION)
            case "periods":
                return believed + round(self.size) * (common < 0.5)


RANGES = (
    Range("string.length", "share", 0.03, "estimate: a tape measure, and a knot that is tied anew"),
    Range("string.mass", "factor", 2.0, "estimate: thread to cord, not weighed"),
    Range("string.bending_damping", "factor", 3.0, "estimate: nobody measures it"),
    Range("string.hook_damping", "factor", 3.0, "estimate: nobody measures it"),
    Range("string.knot_damping", "factor", 3.0, "estimate: nobody measures it"),
    Range("ball.mass", "share", 0.20, "estimate: a ball of the same kind, not weighed"),
    Range("controller.kp", "share", 0.20, "estimate"),
    Range("controller.kd", "share", 0.20, "estimate"),
    Range("arm.mount_height", "offset", 0.005, "estimate: a tape measure"),
    Range("cup.rim_height", "offset", 0.005, "estimate: a tape measure, and an uneven floor"),
    Range("arm.coulomb_friction", "fraction", 1.0, "from none to all of what the arm's file says; see Arm", spread=0.3),
    Range("arm.viscous_friction_scale", "factor", 2.0, "estimate: it halves as the grease warms up"),
    Range("arm.mass_scale", "share", 0.05, "estimate: CAD against the real link, with its cables"),
    Range("arm.inertia_scale", "share", 0.10, "estimate: CAD against the real link"),
    Range("arm.rotor_inertia_scale", "share", 0.10, "estimate: data sheets"),
    Range("arm.torque_scale", "share", 0.05, "estimate: motor constants vary from motor to motor"),
    Range(
        "controller.delay",
        "periods",
        1,
        "a bus that answers one period later; with two the reference gains are unstable",
    ),
    Range("arm.encoder_offset", "offset", math.radians(0.3), "estimate: the homing of a WAM against its stops"),
    Range("arm.base_tilt", "offset", math.radians(0.3), "estimate: a spirit level"),
)
"""By default, of a WAM that is looked after. What moves a landing most of these is the string's length."""


class RobotDistribution:
    """Robots that differ from what is believed of them, each number by itself.

    Parameters
    ----------
    believed
        The scenario that all robots are taken for, and the middle of all ranges; by default the reference with the noise of a
        typical arm. Its noise, bounds and motion are every robot's.
    ranges
        Of the numbers that differ.
    scale
        By which all ranges are wider.
    shifts
        Factors of numbers, by name, that all robots have in common: `{"ball.mass": 0.5}` are robots with half the ball.

    Raises
    ------
    InputError
        If a name is not that of a number of the scenario, or the scale is negative.
    """

    @checks_types
    def __init__(
        self,
        believed: Scenario | None = None,
        ranges: tuple[Range, ...] = RANGES,
        scale: float = 1.0,
        shifts: dict[str, float] | None = None,
    ) -> None:
        self.believed = believed or Scenario(noise=Noise.typical())
        if not isinstance(ranges, tuple) or not all(isinstance(one, Range) for one in ranges):
            raise InputError(f"ranges = {quoted(ranges)} must be a tuple of Range, such as RANGES")
        self.ranges, self.scale, self.shifts = ranges, _checked_scale(scale), _checked_shifts(shifts or {})
        for name in (*(one.name for one in ranges), *self.shifts):
            number(self.believed, name)

    def scaled(self, scale: float) -> Self:
        """Return the robots whose ranges are so many times as wide."""
        return type(self)(self.believed, self.ranges, self.scale * _checked_scale(scale), self.shifts)

    def shifted(self, shifts: dict[str, float]) -> Self:
        """Return the robots that have these numbers, by name, so many times as large besides."""
        return type(self)(self.believed, self.ranges, self.scale, {**self.shifts, **_checked_shifts(shifts)})

    def without(self, *names: str) -> Self:
        """Return the robots that have these numbers as they are believed, but for what is shifted."""
        kept = tuple(one for one in self.ranges if one.name not in names)
        return type(self)(self.believed, kept, self.scale, self.shifts)

    @checks_types
    def draw(self, seed: int) -> Scenario:
        """Return the scenario of the robot of a seed, an integer from 0 on: the truth, which nobody is to be told.

        One whose control loop is unstable is no robot that anybody would cast with: another is drawn in its place, some 2 of 100 by
        default. But for these, the robot of the same seed and of another scale differs in the same direction. Raises `.InputError`
        if the ranges reach beyond what a scenario may have, or hardly any robot is stable.
        """
        # Only who draws needs Drake.
        from wam_cast.simulation.loop_stability import MAX_GROWTH, loop_growth

        seed = checked_integer("seed", seed, 0)
        for attempt in range(MOST_ATTEMPTS):
            robot = self._drawn(seed, attempt)
            if loop_growth(robot, self.believed) <= MAX_GROWTH:
                return robot
        raise InputError(
            f"robots: of {MOST_ATTEMPTS} that were drawn none has a stable control loop; choose lower gains or narrower ranges"
        )

    def _drawn(self, seed: int, attempt: int) -> Scenario:
        values: dict[str, Any] = {}
        for one in self.ranges:
            # A stream for each name: what one range draws does not depend on which others there are.
            rng = np.random.default_rng([seed, attempt, zlib.crc32(one.name.encode())])
            values[one.name] = one.drawn(number(self.believed, one.name), self.scale, rng)
        for name, factor in self.shifts.items():
            values[name] = factor * values.get(name, number(self.believed, name))
        return changed(self.believed, values)

    def __eq__(self, other: object) -> bool:
        if not isinstance(other, RobotDistribution):
            return NotImplemented
        return vars(self) == vars(other)


def _checked_scale(scale: float) -> float:
    if not is_finite(scale) or not 0 <= scale <= MOST_SCALE:
        raise InputError(f"scale = {quoted(scale)} must be a number from 0 to {MOST_SCALE:g}")
    return float(scale)


def _checked_shifts(shifts: Mapping[str, float]) -> dict[str, float]:
    if not isinstance(shifts, Mapping) or not all(is_finite(factor) for factor in shifts.values()):
        raise InputError(f"shifts = {quoted(shifts)} must map names of numbers to factors, such as ball.mass to 0.5")
    return dict(shifts)


def number(scenario: Scenario, name: str) -> Array:
    """Return a scenario's number by its name, shape () or that of a number for each joint. Raises `.InputError` if it is none."""
    part, _, field = name.partition(".")
    value = getattr(getattr(scenario, part, None), field, None)
    if isinstance(value, bool) or not isinstance(value, (int, float, tuple)):
        raise InputError(f"range of {name!r}: name a number of the scenario, such as string.length")
    return np.array(value, dtype=float)


def changed(scenario: Scenario, values: dict[str, Array]) -> Scenario:
    """Return a scenario with other numbers, by name. Raises `.InputError` if it may not have them."""
    nested = scenario.model_dump()
    for name, value in values.items():
        part, _, field = name.partition(".")
        is_whole = isinstance(getattr(getattr(scenario, part), field), int)
        nested[part][field] = int(value) if is_whole else value.tolist()
    return Scenario.from_dict(nested)
