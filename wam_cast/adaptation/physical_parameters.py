"""The numbers of a robot that its landings tell of, as normally distributed parameters."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Self

import numpy as np

from wam_cast.adaptation.robot_distribution import MOST_FRACTION, TILT, Kind, RobotDistribution, number
from wam_cast.scenario import Scenario
from wam_cast.types import Array

JOINTS: dict[str, tuple[int, ...]] = {
    "arm.viscous_friction_scale": (2, 4),
    "arm.mass_scale": (4,),
    "arm.inertia_scale": (),
    "arm.rotor_inertia_scale": (),
    "arm.torque_scale": (2, 4),
    "arm.encoder_offset": (1, 2, 3, 4),
}
"""Joints whose numbers move a landing of the default robots by 0.07 mm or more, one standard deviation each; the others' do not."""


@dataclass(frozen=True)
class Parameter:
    """One number of a scenario, or one factor of a number of several joints, as a function of a normal variable z.

    Attributes
    ----------
    name
        Of the number.
    indices
        Of those of its values, where it has several, that move, from 0.
    kind
        How, as of a `.Range`.
    std
        Standard deviation of that range: of a uniform one its half width over the square root of 3.
    """

    name: str
    indices: tuple[int, ...]
    kind: Kind
    std: float

    def moved(self, value: Array, z: float) -> Array:
        """Return the number, shape as of `value`, that is believed to be `value`."""
        flat = value.reshape(-1).copy()
        own = flat[list(self.indices)]
        match self.kind:
            case "share":
                own = own * (1 + self.std * z)
            case "factor":
                own = own * math.exp(self.std * z)
            case "fraction":
                # Uniform from what is believed on: its mean is sqrt(3) deviations above.
                own = np.clip(own + self.std * (math.sqrt(3) + z), 0.0, MOST_FRACTION)
            case _:
                own = own + self.std * z
        flat[list(self.indices)] = own
        return flat.reshape(value.shape)


@dataclass(frozen=True)
class PhysicalParameters:
    """What of the robots of a distribution is to be identified; what is left out moves landings little, or has no derivative.

    Attributes
    ----------
    center
        The scenario whose numbers are moved: what is believed, with what all robots have in common.
    parameters
        All of them. The last two are the base's tilt about the world's axes, of deviation 0 if the robots are upright.
    """

    center: Scenario
    parameters: tuple[Parameter, ...]

    @classmethod
    def of(cls, robots: RobotDistribution) -> Self:
        """Return those of a distribution."""
        center = robots.believed.without_noise
        for name, factor in robots.shifts.items():
            center = _replaced(center, name, factor * number(center, name))
        parameters, tilt = [], 0.0
        for one in robots.ranges:
            if one.kind == "periods":
                continue
            width = math.log(one.size) if one.kind == "factor" else one.size / (2 if one.kind == "fraction" else 1)
            std = robots.scale * width / math.sqrt(3)
            n = number(center, one.name).size
            if one.name == TILT:
                tilt = std
            elif one.kind == "fraction":
                parameters.append(Parameter(one.name, tuple(range(n)), one.kind, std))
            else:
                joints = JOINTS.get(one.name, range(1, n + 1))
                parameters += [Parameter(one.name, (joint - 1,), one.kind, std) for joint in joints]
        tilts = [Parameter(TILT, (axis,), "offset", tilt) for axis in (0, 1)]
        return cls(center, (*parameters, *tilts))

    @property
    def n(self) -> int:
        """How many there are."""
        return len(self.parameters)

    def scenario(self, z: Array, of: Scenario | None = None) -> Scenario:
        """Return the scenario of parameters z, shape (n,): `center`, or another one, with its numbers in place of those.

        A number may be beyond what a scenario's file may say.
        """
        values: dict[str, Array] = {}
        for one, by in zip(self.parameters, z, strict=True):
            values[one.name] = one.moved(values.get(one.name, number(self.center, one.name)), float(by))
        moved = of or self.center
        for name, value in values.items():
            own = number(moved, name)
            indices = [i for one in self.parameters if one.name == name for i in one.indices]
            own.reshape(-1)[indices] = value.reshape(-1)[indices]
            moved = _replaced(moved, name, own)
        return moved


def _replaced(scenario: Scenario, name: str, value: Array) -> Scenario:
    part, _, field = name.partition(".")
    new = tuple(value.tolist()) if value.ndim else float(value)
    return scenario.model_copy(update={part: getattr(scenario, part).model_copy(update={field: new})})
