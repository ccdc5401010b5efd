"""Scenario: all that is fixed during an experiment.

Everything is SI and radians. Frames: W world (z up, origin on the floor below the arm's base axis), B arm base, E hand (tool
plate), L ball, C cup (origin at the rim's centre, z out of the opening). A *casting plane* holds the base axis; "radius" is
the distance from that axis within the plane.
"""

from __future__ import annotations

import hashlib
import json
import math
from pathlib import Path
from typing import Annotated, Any, Self

import yaml
from pydantic import Field, ValidationError, model_validator

from wam_cast.arm.arm_model import arm_model
from wam_cast.errors import InputError, describe_validation
from wam_cast.parts.camera_parts import Cameras
from wam_cast.scenario_parts import Arm, Ball, Bounds, Controller, Cup, Motion, Noise, Part, Simulation, String
from wam_cast.tether import LOOSE_MARGIN, Tether, lifting_share
from wam_cast.types import Position, checks_types
from wam_cast.yaml_file import read_yaml

__all__ = [
    "Arm",
    "Ball",
    "Bounds",
    "Cameras",
    "Controller",
    "Cup",
    "Motion",
    "Noise",
    "Scenario",
    "Simulation",
    "String",
]

AFTER_THE_LANDING = ("fetch_duration", "pull_duration", "slide_duration", "lift_duration", "retreat_duration")
BEFORE_THE_CAST = ("turn_duration",)
"""Parts of the motion on which no landing depends: after a turn the ball is at rest, to within what can be measured."""


class Scenario(Part):
    """All that is fixed during an experiment; the defaults are the reference scenario.

    `gravity` is the acceleration of free fall [m/s^2].
    """

    gravity: Annotated[float, Field(ge=0.1, le=100)] = 9.81
    arm: Arm = Arm()
    string: String = String()
    ball: Ball = Ball()
    cup: Cup = Cup()
    controller: Controller = Controller()
    motion: Motion = Motion()
    noise: Noise = Noise()
    cameras: Cameras = Cameras()
    simulation: Simulation = Simulation()
    bounds: Bounds = Bounds()

    @model_validator(mode="after")
    def _fits_together(self) -> Self:
        self._check_heights()
        self._check_string()
        arm_model(self.arm)  # raises if its file cannot be used
        if not self.cup.inner_radius > self.ball.radius:
            raise ValueError(
                f"cup.inner_radius = {self.cup.inner_radius:g} m leaves no room for the ball: "
                f"choose more than ball.radius = {self.ball.radius:g} m"
            )
        if self.cup.base_height > 0 and self.cup.base_radius < self.cup.outer_radius:
            raise ValueError(
                f"cup.base_radius = {self.cup.base_radius:g} m: no cup of outer radius {self.cup.outer_radius:g} m stands on that; "
                "choose at least as much"
            )
        if not self.cup.bottom_thickness < self.cup.height:
            raise ValueError(
                f"cup.bottom_thickness = {self.cup.bottom_thickness:g} m must be below the cup's height, {self.cup.height:.4g} m "
                f"from cup.base_height = {self.cup.base_height:g} m to cup.rim_height = {self.cup.rim_height:g} m"
            )
        slowest, longest = self.bounds.speed[0], self.bounds.distance[1]
        if slowest * self.motion.min_move_duration >= longest:
            raise ValueError(
                f"bounds are empty: even {longest:g} m at {slowest:g} m/s takes less than "
                f"motion.min_move_duration = {self.motion.min_move_duration:g} s; allow longer distances or lower speeds"
            )
        if self.tether.span < 0:
            raise ValueError(self._describe_short_string())
        return self

    def _check_heights(self) -> None:
        motion, needed = self.motion, self.string.length + self.ball.radius + self.cup.rim_height
        if self.arm.mount == "ceiling" and motion.start_height >= self.arm.mount_height:
            raise ValueError(
                f"motion.start_height = {motion.start_height:g} m is not below "
                f"arm.mount_height = {self.arm.mount_height:g} m, where the arm hangs"
            )
        if needed >= motion.start_height:
            longest = motion.start_height - needed + self.string.length
            shorter = f"allow less than {longest:.3g} m, or " if longest > 2 * self.ball.radius else ""
            raise ValueError(
                f"string.length = {self.string.length:g} m is too long for a hand {motion.start_height:g} m high: the ball must "
                f"hang above the rim, so {shorter}raise motion.start_height above {needed:.4g} m"
            )
        deepest = motion.start_height - self.cup.rim_height
        if motion.drop_distance >= deepest:
            raise ValueError(
                f"motion.drop_distance = {motion.drop_distance:g} m takes the hand down to the cup's rim: allow less than "
                f"{deepest:.3g} m"
            )

    def _check_string(self) -> None:
        string, ball = self.string, self.ball
        if string.length < 2 * ball.radius:
            raise ValueError(
                f"string.length = {string.length:g} m, to the ball's centre, leaves the string less than the ball's radius: choose "
                f"at least {2 * ball.radius:g} m, twice ball.radius"
            )

    def _describe_short_string(self) -> str:
        """Return in words that the ball can rest in no cup, and what would mend it, of what the other values allow."""
        motion, tether = self.motion, self.tether
        rim, too_high = self.cup.rim_height, tether.height - tether.greatest_height
        length, drop = _round_up(tether.least_length), _round_up(motion.drop_distance + too_high)
        start, hanging = -_round_up(too_high - motion.start_height), self.string.length + self.ball.radius + rim
        remedies = [f"string.length of at least {length:g} m"] * (length + self.ball.radius + rim < motion.start_height)
        remedies += [f"motion.drop_distance of at least {drop:g} m"] * (drop < motion.start_height - rim)
        remedies += [f"motion.start_height of at most {start:g} m"] * (start > max(hanging, motion.drop_distance + rim))
        return (
            f"string.length = {self.string.length:g} m is too short for a ball to rest in any cup: it would hang in a taut "
            f"string, since after the drop the hand is {tether.height:.3g} m above where it is to rest; choose a "
            f"{', or a '.join(remedies) or 'lower cup.rim_height, with a deeper motion.drop_distance'}"
        )

    @property
    def tether(self) -> Tether:
        """What the string lets the ball do once the hand is down."""
        motion = self.motion
        return Tether(
            start_radius=motion.start_radius,
            height=motion.start_height - motion.drop_distance - self.cup.bottom_height - self.ball.radius,
            play=self.cup.inner_radius - self.ball.radius,
            length=self.string.length,
            margin=LOOSE_MARGIN + lifting_share(self.string.mass, self.ball.mass),
        )

    @classmethod
    def from_dict(cls, values: Any) -> Self:
        """Return the scenario of nested values; what is left out keeps its default. Raises `.InputError`."""
        try:
            return cls.model_validate(values)
        except ValidationError as error:
            raise InputError(describe_validation(error, cls)) from None

    @classmethod
    @checks_types
    def from_yaml(cls, path: str | Path) -> Self:
        """Read a scenario file; keys that it leaves out keep their default. Raises `.InputError`."""
        try:
            values = read_yaml(path)
            return cls.from_dict(_counted_from({} if values is None else values, Path(path).parent))
        except InputError as error:
            raise InputError(f"scenario {path}: {error}") from None

    def to_yaml(self) -> str:
        """Return the scenario as YAML text, every value spelled out."""
        return yaml.safe_dump(self.model_dump(mode="json"), sort_keys=False)

    @property
    def without_noise(self) -> Self:
        """The same scenario, all noise off."""
        return self.model_copy(update={"noise": Noise()})

    def place_of_cup(self, cup: Position) -> Position:
        """Return world (x, y) [m] of the axis of a cup that is said to stand at `cup`: see `Cup.offset`."""
        return cup[0] + self.cup.offset[0], cup[1] + self.cup.offset[1]

    @property
    def fingerprint(self) -> str:
        """Hash of all that a landing depends on: this scenario but for the cup's shape, contact and cameras, and the arm's model.

        Of the cup only the height of its rim counts: a model of the landings serves every cup that is as high.
        """
        values = self.model_dump(mode="json")
        values["cup"] = {"rim_height": self.cup.rim_height}
        values["simulation"].pop("contact_accuracy")
        values.pop("cameras")
        for name in (*BEFORE_THE_CAST, *AFTER_THE_LANDING):
            values["motion"].pop(name)
        for name in ("urdf", "base_frame", "hand_frame", "joints"):
            values["arm"].pop(name)
        values["arm_model"] = arm_model(self.arm).physical_urdf
        text = json.dumps(values, sort_keys=True)
        return hashlib.sha256(text.encode()).hexdigest()[:16]


def _counted_from(values: Any, folder: Path) -> Any:
    """Return a scenario's values with the path of the arm's file, if there is one, counted from `folder`."""
    arm = values.get("arm") if isinstance(values, dict) else None
    if not isinstance(arm, dict) or not isinstance(arm.get("urdf"), str):
        return values
    return {**values, "arm": {**arm, "urdf": str(folder / arm["urdf"])}}


def _round_up(value: float) -> float:
    """Return the next number of whole millimetres [m]."""
    return math.ceil(1e3 * value) / 1e3 if math.isfinite(value) else value
