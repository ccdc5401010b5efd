"""Scenario: all that is fixed during an experiment.

Everything is SI and radians. Frames: W world (z up, origin on the floor below the arm's base axis), B arm base, E hand (tool
plate), L ball, C cup (origin at the rim's centre, z out of the opening). A *casting plane* holds the base axis; "radius" is
the distance from that axis within the plane.
"""

from __future__ import annotations

import hashlib
import json
from pathlib import Path
from typing import Annotated, Any, Self

import yaml
from pydantic import BaseModel, ConfigDict, Field, ValidationError, field_validator, model_validator
from pydantic_core import PydanticCustomError

from wam_cast.arm_model import physical_urdf
from wam_cast.errors import InputError, describe_validation
from wam_cast.yaml_file import read_yaml

Positive = Annotated[float, Field(gt=0)]
NonNegative = Annotated[float, Field(ge=0)]
Seven = tuple[NonNegative, NonNegative, NonNegative, NonNegative, NonNegative, NonNegative, NonNegative]


class _Part(BaseModel):
    """A frozen group of values that refuses unknown keys, nan and infinity."""

    model_config = ConfigDict(frozen=True, extra="forbid", allow_inf_nan=False)

    @field_validator("*", mode="before")
    @classmethod
    def _no_truth_values(cls, value: Any) -> Any:
        if isinstance(value, bool):
            raise PydanticCustomError("float_type", "Input should be a number")
        return value


class Arm(_Part):
    """The ceiling-mounted WAM.

    Attributes
    ----------
    mount_height
        Height of the mounting face above the floor [m]. The axes of the joints 1 to 3 meet 0.346 m below it.
    wrist_pitch
        Joint 6 in the starting posture [rad]. Joints 3, 5 and 7 are zero there; joints 2 and 4 follow from the hand's position.
    coulomb_friction
        Share of the joints' Coulomb friction (from `models/wam7.urdf`) that acts: 0 none, 1 all.
    """

    mount_height: Positive = 1.346
    wrist_pitch: Annotated[float, Field(ge=-1.6, le=1.6)] = -0.6
    coulomb_friction: Annotated[float, Field(ge=0, le=2)] = 0.0


class String(_Part):
    """The string: equal rigid links in a row, on universal joints.

    Attributes
    ----------
    length
        From the hook in the hand to the ball's centre [m].
    n_links
        Number of links. A cast with 15 takes twice as long as one with 10, with 20 four times, 30 nine, 40 twenty times.
    mass
        Of the whole string [kg].
    bending_damping
        Moment per rate of curvature [N m^2 s]; a joint between two links has this over the link's length, so that the
        string's own damping does not depend on the number of links.
    hook_damping
        Of the joint between hand and string [N m s].
    """

    length: Positive = 0.60
    n_links: Annotated[int, Field(ge=1, le=40)] = 10
    mass: Positive = 0.003
    bending_damping: NonNegative = 8e-7
    hook_damping: NonNegative = 1e-4


class Ball(_Part):
    """The ball, a solid sphere: mass [kg] and radius [m]."""

    mass: Positive = 0.030
    radius: Positive = 0.020


class Cup(_Part):
    """The cup, a hollow cylinder that stands on the floor, and its contact with the ball.

    Attributes
    ----------
    rim_height
        Height of the rim above the floor [m]: the plane in which a landing is measured.
    inner_radius, wall_thickness, bottom_thickness
        The cup's shape [m].
    stiffness
        Of the contact between ball and cup or floor [N/m].
    restitution
        Share of its speed that a ball keeps which hits a wall squarely at 2 m/s: 0.25 is nearly inelastic, 0.6 lively. Slower
        impacts keep more.
    friction
        Coulomb friction coefficient between ball and cup or floor.
    """

    rim_height: Positive = 0.12
    inner_radius: Positive = 0.030
    wall_thickness: Positive = 0.0045
    bottom_thickness: Positive = 0.006
    stiffness: Positive = 2e4
    restitution: Annotated[float, Field(gt=0, lt=1)] = 0.25
    friction: NonNegative = 0.4

    @property
    def outer_radius(self) -> float:
        """Outer radius of the wall [m]."""
        return self.inner_radius + self.wall_thickness


class Controller(_Part):
    """Gains of the controller.

    Attributes
    ----------
    kp, kd
        Cartesian stiffness [N/m] and damping [N s/m] of the hand (`K_p`, `K_d` of the paper's Section 2.3).
    posture_stiffness, posture_damping
        Toward the starting posture [N m/rad] and against joint motion [N m s/rad], in the null space of the hand's position.
    period
        Sampling period [s]; the torque is held in between.
    """

    kp: NonNegative = 6000.0
    kd: NonNegative = 250.0
    posture_stiffness: Seven = (20.0, 20.0, 20.0, 20.0, 5.0, 5.0, 0.5)
    posture_damping: Seven = (3.0, 3.0, 3.0, 3.0, 0.5, 0.5, 0.02)
    period: Positive = 0.002


class Motion(_Part):
    """What is the same in every cast.

    Attributes
    ----------
    start_radius, start_height
        The hand before the cast: distance from the base axis and height above the floor [m].
    turn_duration
        How long joint 1 takes to turn the hand by one radian before the cast [s]; `wam_cast.motion.turn` has other angles.
    min_move_duration
        The horizontal move takes at least this long [s]; faster casts are not allowed.
    drop_distance, drop_duration
        How far [m] and how fast [s] the hand goes down in stage 3.
    hold_duration
        How long the hand stays down, so that the ball comes to rest [s].
    fetch_duration, pull_duration, slide_duration, lift_duration, retreat_duration
        The return [s]: to where the string is almost tight; until the ball is drawn against the cup's wall; as it slides up the
        wall; straight up to the starting height; and back. See `wam_cast.motion.return_path`.
    """

    start_radius: Positive = 0.20
    start_height: Positive = 0.80
    turn_duration: Positive = 4.0
    min_move_duration: Positive = 0.2
    drop_distance: Positive = 0.45
    drop_duration: Positive = 0.44
    hold_duration: Positive = 1.5
    fetch_duration: Positive = 1.0
    pull_duration: Positive = 2.0
    slide_duration: Positive = 1.5
    lift_duration: Positive = 0.8
    retreat_duration: Positive = 2.5


class Noise(_Part):
    """What a real cast does not repeat; all zero, and so off, by default.

    The noise of a cast is drawn from a seed, see `wam_cast.robot.noise`: the same seed gives the same cast.

    Attributes
    ----------
    distance, speed, wait
        Standard deviations of the executed from the commanded cast [m], [m/s], [s]. A distance or a speed falls at the lowest
        to a tenth of its command, a wait to zero.
    torque
        Standard deviation of each joint's torque as a fraction of its motor's limit, anew in each control period. The sum stays
        within what the motors give.
    encoder_counts
        Of each motor in a revolution; 0 measures exactly. The controller sees joint angles in whole counts, and speeds in whole
        counts a control period.
    swing
        Standard deviation of the hanging string's angle in the casting plane and across it at the start [rad]. It swings
        with rates to match, so that its phase is random.
    """

    distance: NonNegative = 0.0
    speed: NonNegative = 0.0
    wait: NonNegative = 0.0
    torque: NonNegative = 0.0
    encoder_counts: Annotated[int, Field(ge=0)] = 0
    swing: NonNegative = 0.0

    @property
    def is_on(self) -> bool:
        """Whether any noise acts."""
        return any(value > 0 for _, value in self)

    @classmethod
    def typical(cls) -> Self:
        """Return noise of about the size that is to be expected of a real arm."""
        return cls(distance=0.003, speed=0.015, wait=0.004, torque=0.005, encoder_counts=4096, swing=0.005)


class Simulation(_Part):
    """Numerical settings.

    Attributes
    ----------
    max_step
        Longest integration step [s]; the integrator takes shorter ones where its error, or a cast's stability, asks for it.
    contact_accuracy
        Relative error that the integrator allows itself in a step of the contact phase, in which the ball can touch the cup or the
        floor.
    """

    max_step: Positive = 0.002
    contact_accuracy: Annotated[float, Field(gt=0, le=0.5)] = 0.1


class Bounds(_Part):
    """Lower and upper bound of each parameter of a cast: distance [m], mean speed [m/s], wait [s]."""

    distance: tuple[Positive, Positive] = (0.05, 0.40)
    speed: tuple[Positive, Positive] = (0.21, 0.85)
    wait: tuple[NonNegative, NonNegative] = (0.0, 0.5)

    @model_validator(mode="after")
    def _ordered(self) -> Self:
        for name, (lower, upper) in self:
            if not lower < upper:
                raise ValueError(
                    f"bounds.{name} = [{lower:g}, {upper:g}] is empty: the first number must be below the second"
                )
        return self


AFTER_THE_LANDING = ("fetch_duration", "pull_duration", "slide_duration", "lift_duration", "retreat_duration")
BEFORE_THE_CAST = ("turn_duration",)
"""Parts of the motion on which no landing depends: after a turn the ball is at rest, to within what can be measured."""


class Scenario(_Part):
    """All that is fixed during an experiment; the defaults are the reference scenario."""

    arm: Arm = Arm()
    string: String = String()
    ball: Ball = Ball()
    cup: Cup = Cup()
    controller: Controller = Controller()
    motion: Motion = Motion()
    noise: Noise = Noise()
    simulation: Simulation = Simulation()
    bounds: Bounds = Bounds()

    @model_validator(mode="after")
    def _fits_together(self) -> Self:
        self._check_heights()
        if not self.cup.inner_radius > self.ball.radius:
            raise ValueError(
                f"cup.inner_radius = {self.cup.inner_radius:g} m leaves no room for the ball: "
                f"choose more than ball.radius = {self.ball.radius:g} m"
            )
        if not self.cup.bottom_thickness < self.cup.rim_height:
            raise ValueError(
                f"cup.bottom_thickness = {self.cup.bottom_thickness:g} m must be below "
                f"cup.rim_height = {self.cup.rim_height:g} m"
            )
        slowest, longest = self.bounds.speed[0], self.bounds.distance[1]
        if slowest * self.motion.min_move_duration >= longest:
            raise ValueError(
                f"bounds are empty: even {longest:g} m at {slowest:g} m/s takes less than "
                f"motion.min_move_duration = {self.motion.min_move_duration:g} s; allow longer distances or lower speeds"
            )
        return self

    def _check_heights(self) -> None:
        motion, needed = self.motion, self.string.length + self.ball.radius + self.cup.rim_height
        if motion.start_height >= self.arm.mount_height:
            raise ValueError(
                f"motion.start_height = {motion.start_height:g} m is not below "
                f"arm.mount_height = {self.arm.mount_height:g} m, where the arm hangs"
            )
        if needed >= motion.start_height:
            raise ValueError(
                f"string.length = {self.string.length:g} m is too long for a hand {motion.start_height:g} m high: the ball "
                f"must hang above the rim, so allow less than {motion.start_height - needed + self.string.length:.3g} m, or "
                f"raise motion.start_height"
            )
        if motion.drop_distance >= motion.start_height - self.cup.rim_height:
            raise ValueError(
                f"motion.drop_distance = {motion.drop_distance:g} m takes the hand down to the cup's rim: allow less than "
                f"{motion.start_height - self.cup.rim_height:.3g} m"
            )

    @classmethod
    def from_dict(cls, values: Any) -> Self:
        """Return the scenario of nested values; what is left out keeps its default. Raises `.InputError`."""
        try:
            return cls.model_validate(values)
        except ValidationError as error:
            raise InputError(describe_validation(error, cls)) from None

    @classmethod
    def from_yaml(cls, path: str | Path) -> Self:
        """Read a scenario file; keys that it leaves out keep their default. Raises `.InputError`."""
        try:
            values = read_yaml(path)
            return cls.from_dict({} if values is None else values)
        except InputError as error:
            raise InputError(f"scenario {path}: {error}") from None

    def to_yaml(self) -> str:
        """Return the scenario as YAML text, every value spelled out."""
        return yaml.safe_dump(self.model_dump(mode="json"), sort_keys=False)

    @property
    def without_noise(self) -> Self:
        """The same scenario, all noise off."""
        return self.model_copy(update={"noise": Noise()})

    @property
    def fingerprint(self) -> str:
        """Hash of all that a cast's landing depends on: this scenario but for the cup's shape and contact, and the arm's model.

        Of the cup only the height of its rim counts: a model of the landings serves every cup that is as high.
        """
        values = self.model_dump(mode="json")
        values["cup"] = {"rim_height": self.cup.rim_height}
        values["simulation"].pop("contact_accuracy")
        for name in (*BEFORE_THE_CAST, *AFTER_THE_LANDING):
            values["motion"].pop(name)
        if not self.noise.is_on:
            values.pop("noise")  # as if there were no such thing: casts made before there was stay valid
        values["arm_model"] = physical_urdf()
        text = json.dumps(values, sort_keys=True)
        return hashlib.sha256(text.encode()).hexdigest()[:16]
