"""The part of a scenario that sees: how many cameras look at the ball, from where, and what they make of it."""

from __future__ import annotations

import math
from typing import Annotated, Self, TypeAlias

from pydantic import Field, model_validator

from wam_cast.scenario_parts import Offset, Part

Coordinate = Annotated[float, Field(ge=-20, le=20)]
Point: TypeAlias = tuple[Coordinate, Coordinate, Coordinate]
Shift: TypeAlias = tuple[Offset, Offset, Offset]
Pixels = Annotated[int, Field(ge=16, le=4096)]

LEVEL_LEAST = 1e-3
"""How far to the side a camera looks at the least, as a fraction of the distance to its target."""


class Cameras(Part):
    """The cameras that look at the ball; none by default. What they see moves no ball.

    Attributes
    ----------
    number
        How many look: 0, 1 or 2.
    positions, targets
        Of each: where it stands, and a point in the middle of its picture, in the world [m]. Its picture is level.
    offsets, turns
        Of each: by how much it stands elsewhere than `positions` says [m], in the world, and is turned besides [rad], a rotation
        vector about its own axes: errors of a calibration, of which whoever reads its pictures does not know.
    calibration_std
        Standard deviation of a landing for such errors, in x and in y [m]: whoever reads the pictures adds it to what they leave.
    field_of_view
        Of a picture's height [rad].
    width, height
        Of a picture [pixels].
    frame_rate
        Pictures in a second [1/s]; both cameras take theirs at the same time.
    exposure
        For how long the shutter is open [s]: what moves is blurred. 0: it is not.
    pixel_noise
        Standard deviation of a pixel's value, as a fraction of full scale.
    """

    number: Annotated[int, Field(ge=0, le=2)] = 0
    positions: tuple[Point, Point] = ((-0.1, -1.6, 0.7), (1.6, -1.2, 0.7))
    targets: tuple[Point, Point] = ((0.6, 0.0, 0.3), (0.6, 0.0, 0.3))
    offsets: tuple[Shift, Shift] = ((0.0, 0.0, 0.0), (0.0, 0.0, 0.0))
    turns: tuple[Shift, Shift] = ((0.0, 0.0, 0.0), (0.0, 0.0, 0.0))
    calibration_std: Annotated[float, Field(ge=0, le=0.2)] = 0.0
    field_of_view: Annotated[float, Field(ge=0.05, le=2.5)] = 0.7
    width: Pixels = 640
    height: Pixels = 480
    frame_rate: Annotated[float, Field(ge=1, le=1000)] = 60.0
    exposure: Annotated[float, Field(ge=0, le=0.1)] = 0.001
    pixel_noise: Annotated[float, Field(ge=0, le=1)] = 0.01

    @model_validator(mode="after")
    def _can_look(self) -> Self:
        for number, (position, target) in enumerate(zip(self.positions, self.targets, strict=True), 1):
            if math.dist(position[:2], target[:2]) <= LEVEL_LEAST * math.dist(position, target):
                raise ValueError(
                    f"cameras.positions: camera {number} at {list(position)} looks straight up or down at {list(target)}, so "
                    f"that no side of its picture is level; move it to the side by more than {LEVEL_LEAST:g} of the distance"
                )
        if self.exposure >= 1 / self.frame_rate:
            raise ValueError(
                f"cameras.exposure = {self.exposure:g} s is longer than from picture to picture at cameras.frame_rate = "
                f"{self.frame_rate:g} 1/s; choose less than {1 / self.frame_rate:.3g} s"
            )
        return self
