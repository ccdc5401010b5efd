"""The parts of a scenario: groups of values, each with its unit, its default and what is allowed.

Beyond its range a number is no laboratory's, and of no simulation that ends.
"""

from __future__ import annotations

import os
from typing import TYPE_CHECKING, Annotated, Any, Literal, Self, TypeAlias, TypeVar

from pydantic import BaseModel, BeforeValidator, ConfigDict, Field, field_validator, model_validator
from pydantic_core import PydanticCustomError

from wam_cast.errors import quoted, with_input_errors

Stiffness = Annotated[float, Field(ge=0, le=1e4)]
Stiffnesses = tuple[Stiffness, Stiffness, Stiffness, Stiffness, Stiffness, Stiffness, Stiffness]
Factor = Annotated[float, Field(ge=0.05, le=20)]
Duration = Annotated[float, Field(ge=0.01, le=60)]
Distance = Annotated[float, Field(ge=0.001, le=5)]
Speed = Annotated[float, Field(ge=0.001, le=20)]
Wait = Annotated[float, Field(ge=0, le=60)]


def _for_each_joint(value: Any) -> Any:
    """Return a single number seven times."""
    return (value,) * 7 if isinstance(value, (int, float)) and not isinstance(value, bool) else value


T = TypeVar("T")
ForEachJoint: TypeAlias = Annotated[tuple[T, T, T, T, T, T, T], BeforeValidator(_for_each_joint)]

Scale: TypeAlias = ForEachJoint[Factor]  # factors of the joints 1 to 7, or one for all
Multiples: TypeAlias = ForEachJoint[Annotated[float, Field(ge=0, le=20)]]  # the same, 0 among them
Shares: TypeAlias = ForEachJoint[Annotated[float, Field(ge=0, le=2)]]  # the same, from 0 to 2

CupOffset = Annotated[float, Field(ge=-0.1, le=0.1)]
Offset = Annotated[float, Field(ge=-0.2, le=0.2)]
Offsets: TypeAlias = ForEachJoint[Offset]  # small angles of the joints 1 to 7 [rad], or one for all

UNSCALED = (1.0,) * 7


class Part(BaseModel):
    """A frozen group of values that refuses unknown keys, nan and infinity."""

    model_config = ConfigDict(frozen=True, extra="forbid", allow_inf_nan=False)
    if not TYPE_CHECKING:  # which knows the values by the fields
        __init__ = with_input_errors(BaseModel.__init__)

    @field_validator("*", mode="before")
    @classmethod
    def _no_truth_values(cls, value: Any) -> Any:
        if isinstance(value, bool):
            raise PydanticCustomError("float_type", "Input should be a number")
        return value


class Arm(Part):
    """The arm: a WAM with 7 joints, where it is mounted, and what of one arm differs from its model file.

    Attributes
    ----------
    urdf
        The arm's model file, by default the shipped `models/wam7.urdf`; a path counts from the scenario file's folder, in Python
        from where the program runs. Any URDF will do whose seven joints are arranged as the WAM's: see `wam_cast.arm.arm_model`.
    base_frame, hand_frame
        Names of the links that are mounted and that the string hangs from.
    joints
        Names of the seven joints from base to hand; by default the revolute ones between these two links.
    mount
        "ceiling": the arm hangs and joint 1 turns by the negative of the bearing. "floor": it stands, and joint 1 turns by the
        bearing. "wall": it sticks out horizontally along the world's x axis from a wall at x = 0, and casts along that axis alone.
    mount_height
        Height of the mounting face's centre above the floor [m]. The axes of the joints 1 to 3 meet 0.346 m beyond it.
    wrist_pitch
        Joint 6 in the starting posture [rad]. Joints 3, 5 and 7 are zero there; joints 2 and 4 follow from the hand's position.
    coulomb_friction
        Share of the joints' Coulomb friction (from the model file) that acts: 0 none, 1 all.
    viscous_friction_scale, mass_scale, inertia_scale, rotor_inertia_scale
        Factors of what the model file says of the joints 1 to 7, of the links that they carry, and of their motors. A link's
        inertia goes with its mass, and by `inertia_scale` besides.
    torque_scale
        Torque that the motors give, by what is commanded.
    knee_speed
        Fraction of its velocity limit from which on a motor cannot give its peak torque: from there to the limit it falls linearly
        to zero, for torques that drive the motion. 1: it never falls.
    encoder_offset
        By which the encoders read too much [rad]. The controller does not know of it: it puts the arm elsewhere.
    base_tilt
        Of the mounting about the world's x and y axes [rad], of which the controller does not know either.
    """

    urdf: str | None = None
    base_frame: str = "base"
    hand_frame: str = "tool_plate"
    joints: tuple[str, str, str, str, str, str, str] | None = None
    mount: Literal["ceiling", "floor", "wall"] = "ceiling"
    mount_height: Annotated[float, Field(ge=0, le=10)] = 1.346
    wrist_pitch: Annotated[float, Field(ge=-1.6, le=1.6)] = -0.6
    coulomb_friction: Shares = (0.0,) * 7
    viscous_friction_scale: Multiples = UNSCALED
    mass_scale: Scale = UNSCALED
    inertia_scale: Scale = UNSCALED
    rotor_inertia_scale: Scale = UNSCALED
    torque_scale: Scale = UNSCALED
    knee_speed: Annotated[float, Field(gt=0, le=1)] = 1.0
    encoder_offset: Offsets = (0.0,) * 7
    base_tilt: tuple[Offset, Offset] = (0.0, 0.0)

    @field_validator("urdf")
    @classmethod
    def _is_found_from_anywhere(cls, path: str | None) -> str | None:
        try:
            return None if path is None else os.path.realpath(path)
        except (OSError, ValueError) as error:  # no folder that it could count from; a null byte
            raise ValueError(f"arm.urdf = {quoted(path)}: {error}; name a URDF file") from None


class String(Part):
    """The string: equal rigid links in a row, on universal joints, and the ball at its end on one more.

    Attributes
    ----------
    length
        From the hook in the hand to the ball's centre [m]; the links share it but for the ball's radius.
    n_links
        Number of links. A cast with 15 takes twice as long as one with 10, with 20 four times, with 40 ten to twenty times.
    mass
        Of the whole string [kg].
    bending_damping
        Moment per rate of curvature [N m^2 s]; a joint between two links has this over the link's length, so that the
        string's own damping does not depend on the number of links.
    bending_stiffness
        Moment per curvature [N m^2]; a joint between two links has this over the link's length. 0: a string, no wire.
    hook_damping
        Of the joint between hand and string [N m s].
    knot_damping
        Of the joint between string and ball, at the ball's surface [N m s].
    """

    length: Annotated[float, Field(ge=0.1, le=5)] = 0.60
    n_links: Annotated[int, Field(ge=1, le=40)] = 10
    mass: Annotated[float, Field(ge=1e-5, le=1)] = 0.003
    bending_damping: Annotated[float, Field(ge=0, le=1e-2)] = 8e-7
    bending_stiffness: Annotated[float, Field(ge=0, le=100)] = 0.0
    hook_damping: Annotated[float, Field(ge=0, le=0.1)] = 1e-4
    knot_damping: Annotated[float, Field(ge=0, le=0.1)] = 1e-5

    def link_length(self, ball: Ball) -> float:
        """Return the length of a link [m], with the `ball` at the string's end."""
        return (self.length - ball.radius) / self.n_links


class Ball(Part):
    """The ball.

    Attributes
    ----------
    mass, radius
        [kg] and [m].
    inertia_factor
        Its moment of inertia over mass times radius squared: 0.4 for a solid sphere, 0.667 for a thin shell as of a tennis ball.
    """

    mass: Annotated[float, Field(ge=5e-4, le=5)] = 0.030
    radius: Annotated[float, Field(ge=1e-4, le=0.2)] = 0.020
    inertia_factor: Annotated[float, Field(gt=0, le=2 / 3 + 1e-3)] = 0.4


class Cup(Part):
    """The cup, a hollow cylinder on the floor or on a round stand, and its contact with the ball.

    Attributes
    ----------
    rim_height
        Height of the rim above the floor [m]: the plane in which a landing is measured.
    base_height
        Height of the cup's foot above the floor [m]: 0 on the floor, else of the stand that goes with it.
    base_radius
        Of that stand [m]: a pedestal, or a round table.
    offset
        From where the cup is said to stand to where it does: along the world's x and y axes [m].
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

    rim_height: Annotated[float, Field(ge=0.005, le=5)] = 0.12
    base_height: Annotated[float, Field(ge=0, le=5)] = 0.0
    base_radius: Annotated[float, Field(ge=0.005, le=5)] = 0.06
    offset: tuple[CupOffset, CupOffset] = (0.0, 0.0)
    inner_radius: Annotated[float, Field(ge=0.003, le=1)] = 0.030
    wall_thickness: Annotated[float, Field(ge=5e-4, le=0.2)] = 0.0045
    bottom_thickness: Annotated[float, Field(ge=5e-4, le=1)] = 0.006
    stiffness: Annotated[float, Field(ge=100, le=1e6)] = 2e4
    restitution: Annotated[float, Field(ge=0.05, le=0.95)] = 0.25
    friction: Annotated[float, Field(ge=0, le=2)] = 0.4

    @property
    def outer_radius(self) -> float:
        """Outer radius of the wall [m]."""
        return self.inner_radius + self.wall_thickness

    @property
    def height(self) -> float:
        """From its foot to its rim [m]."""
        return self.rim_height - self.base_height

    @property
    def bottom_height(self) -> float:
        """Height of the cup's bottom, on which a ball rests, above the floor [m]."""
        return self.base_height + self.bottom_thickness


class Controller(Part):
    """Gains of the controller.

    Attributes
    ----------
    kp, kd
        Cartesian stiffness [N/m] and damping [N s/m] of the hand (`K_p`, `K_d` of the paper's Section 2.3).
    posture_stiffness, posture_damping
        Toward the starting posture [N m/rad] and against joint motion [N m s/rad], in the null space of the hand's position.
    period
        Sampling period [s]; the torque is held in between.
    delay
        Periods from a sample to the torque that answers it.
    """

    kp: Annotated[float, Field(ge=0, le=1e6)] = 6000.0
    kd: Annotated[float, Field(ge=0, le=1e5)] = 250.0
    posture_stiffness: Stiffnesses = (20.0, 20.0, 20.0, 20.0, 5.0, 5.0, 0.5)
    posture_damping: Stiffnesses = (3.0, 3.0, 3.0, 3.0, 0.5, 0.5, 0.02)
    period: Annotated[float, Field(ge=1e-5, le=0.1)] = 0.002
    delay: Annotated[int, Field(ge=0, le=20)] = 0


class Motion(Part):
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

    start_radius: Annotated[float, Field(ge=0.01, le=5)] = 0.20
    start_height: Annotated[float, Field(ge=0.05, le=10)] = 0.80
    turn_duration: Duration = 4.0
    min_move_duration: Duration = 0.2
    drop_distance: Annotated[float, Field(ge=0.001, le=5)] = 0.45
    drop_duration: Duration = 0.44
    hold_duration: Duration = 1.5
    fetch_duration: Duration = 1.0
    pull_duration: Duration = 2.0
    slide_duration: Duration = 1.5
    lift_duration: Duration = 0.8
    retreat_duration: Duration = 2.5


class Noise(Part):
    """What a real cast does not repeat; all zero, and so off, by default.

    The noise of a cast is drawn from a seed, see `wam_cast.motion.noise_draws`: the same seed gives the same cast.

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

    distance: Annotated[float, Field(ge=0, le=5)] = 0.0
    speed: Annotated[float, Field(ge=0, le=5)] = 0.0
    wait: Annotated[float, Field(ge=0, le=5)] = 0.0
    torque: Annotated[float, Field(ge=0, le=1)] = 0.0
    encoder_counts: Annotated[int, Field(ge=0, le=10000000)] = 0
    swing: Annotated[float, Field(ge=0, le=1)] = 0.0

    @property
    def is_on(self) -> bool:
        """Whether any noise acts."""
        return any(value > 0 for _, value in self)

    @classmethod
    def typical(cls) -> Self:
        """Return noise of about the size that is to be expected of a real arm."""
        return cls(distance=0.003, speed=0.015, wait=0.004, torque=0.005, encoder_counts=4096, swing=0.005)


class Simulation(Part):
    """Numerical settings.

    Attributes
    ----------
    max_step
        Longest integration step [s]; the integrator takes shorter ones where its error, or a cast's stability, asks for it.
    contact_accuracy
        Relative error that the integrator allows itself in a step of the contact phase, in which the ball can touch the cup or the
        floor.
    """

    max_step: Annotated[float, Field(ge=1e-6, le=0.1)] = 0.002
    contact_accuracy: Annotated[float, Field(gt=0, le=0.5)] = 0.1


class Bounds(Part):
    """Lower and upper bound of each parameter of a cast: distance [m], mean speed [m/s], wait [s]."""

    distance: tuple[Distance, Distance] = (0.05, 0.40)
    speed: tuple[Speed, Speed] = (0.21, 0.85)
    wait: tuple[Wait, Wait] = (0.0, 0.5)

    @model_validator(mode="after")
    def _ordered(self) -> Self:
        for name, (lower, upper) in self:
            if not lower < upper:
                raise ValueError(
                    f"bounds.{name} = [{lower:g}, {upper:g}] is empty: the first number must be below the second"
                )
        return self
