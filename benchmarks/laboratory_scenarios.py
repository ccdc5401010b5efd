"""Scenarios that laboratories have: each by name, as what differs from the reference scenario."""

from __future__ import annotations

import copy
import math
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from wam_cast.scenario import Ball, Cup, Motion, Scenario, String

ARMS = Path(__file__).with_name("arms")
LONG_FOREARM = {"urdf": str(ARMS / "wam_long_forearm.urdf"), "base_frame": "wam_base_link", "hand_frame": "wam_tool"}
HAND = {"urdf": str(ARMS / "wam_hand.urdf"), "base_frame": "wam/base", "hand_frame": "hand/palm"}

TABLE_TENNIS = {"mass": 0.0027, "radius": 0.020, "inertia_factor": 0.667}
SMALL_STEEL = {"mass": 0.021, "radius": 0.0085}
GOLF = {"mass": 0.046, "radius": 0.0214}
TENNIS = {"mass": 0.058, "radius": 0.033, "inertia_factor": 0.667}
WIDE_CUP = {"inner_radius": 0.050, "rim_height": 0.14}

Values = dict[str, Any]


@dataclass(frozen=True)
class Laboratory:
    """What one laboratory has.

    Attributes
    ----------
    name, description
        A short name, and what is special about it in words.
    values
        Of its scenario, nested as in a file; what is left out is the reference scenario's.
    believed
        Of the scenario that is learned from and planned with, if that is another one than the robot's.
    """

    name: str
    description: str
    values: Values
    believed: Values | None = None


def arranged(values: Values, *, shoulder_above: float = 0.2) -> Values:
    """Return `values` with a motion and a mounting that a laboratory would choose for its string, ball and cup.

    In proportion to the reference scenario: before the cast the ball hangs 6 cm above the rim; after the drop the hand is 0.55 of
    the string's length above a ball that rests in the cup, but drops no more than 0.45 m, with the reference's acceleration; the
    shoulder of an arm that hangs is 0.2 m above the start. What `values` say themselves stays.
    """
    string, ball = String(**values.get("string", {})), Ball(**values.get("ball", {}))
    cup, gravity = Cup(**values.get("cup", {})), values.get("gravity", 9.81)
    start_height = cup.rim_height + string.length + ball.radius + 0.06
    drop = min(start_height - cup.bottom_height - ball.radius - 0.55 * string.length, Motion().drop_distance)
    duration = Motion().drop_duration * math.sqrt(drop / Motion().drop_distance * 9.81 / gravity)
    motion = {"start_height": start_height, "drop_distance": drop, "drop_duration": duration}
    arm = {"mount_height": start_height + shoulder_above + 0.346}
    result = copy.deepcopy(values)
    result["motion"] = {name: round(value, 4) for name, value in motion.items()} | values.get("motion", {})
    result["arm"] = {name: round(value, 4) for name, value in arm.items()} | values.get("arm", {})
    return result


def on_stand(base_height: float, height: float = 0.12, **cup: float) -> Values:
    """Return a cup that stands above the floor."""
    return {"base_height": base_height, "rim_height": round(base_height + height, 4), **cup}


def _strings() -> list[Laboratory]:
    lengths = (0.25, 0.3, 0.4, 0.5, 0.8, 1.0, 1.2)
    strings = [
        Laboratory(f"string {length:g} m", f"a string of {length:g} m", arranged({"string": {"length": length}}))
        for length in lengths
    ]
    stiff = {"string": {"bending_stiffness": 2e-5}}
    heavy = {"string": {"mass": 0.010}}
    table = arranged({"string": {"length": 0.3}, "cup": on_stand(0.3)})
    return [
        *strings,
        Laboratory("string 0.3 m, table", "a string of 0.3 m, the cup on a pedestal of 0.3 m", table),
        Laboratory("stiff cord", "a cord with a bending stiffness of 2e-5 N m^2", stiff),
        Laboratory("heavy cord", "a cord of 10 g", heavy),
        Laboratory("2 links", "the string of two links", {"string": {"n_links": 2}}),
    ]


def _balls() -> list[Laboratory]:
    balls = (
        ("table tennis ball", "2.7 g, a shell; a string of 1 g", {"ball": TABLE_TENNIS, "string": {"mass": 0.001}}),
        ("steel ball", "21 g, 17 mm wide, a string of 0.3 m", {"ball": SMALL_STEEL, "string": {"length": 0.3}}),
        ("golf ball", "46 g, a cup of 35 mm", {"ball": GOLF, "cup": {"inner_radius": 0.035}}),
        ("tennis ball", "58 g, a shell of 33 mm, a cup of 50 mm", {"ball": TENNIS, "cup": WIDE_CUP}),
    )
    found = [Laboratory(name, description, arranged(values)) for name, description, values in balls]
    as_it_is = Laboratory("21 g, 0.3 m, as it is", "the reference's motion, with a string of 0.3 m", _short_as_it_is())
    return [*found, as_it_is]


def _short_as_it_is() -> Values:
    return {"string": {"length": 0.30}, "ball": {"mass": 0.021}}


def _cups() -> list[Laboratory]:
    wide = on_stand(0.25, base_radius=0.35)
    return [
        Laboratory("high cup", "a rim at 0.20 m", arranged({"cup": {"rim_height": 0.20}})),
        Laboratory("pedestal", "a cup on a pedestal of 0.25 m", arranged({"cup": on_stand(0.25)})),
        Laboratory("table", "a cup on a table of 0.25 m, 0.7 m wide", arranged({"cup": wide})),
        Laboratory("lively cup", "a restitution of 0.6", {"cup": {"restitution": 0.6}}),
    ]


def _arms() -> list[Laboratory]:
    floor = {"mount": "floor", "mount_height": 0.45, "wrist_pitch": 0.6}
    wall = {"mount": "wall", "mount_height": 1.0, "wrist_pitch": 0.6}
    slower, short = {"drop_duration": 0.5}, {"distance": [0.05, 0.25]}
    folded = {"mount": "floor", "mount_height": 0.65}
    light = {"mass_scale": 0.9, "rotor_inertia_scale": 1.2, "viscous_friction_scale": 1.5}
    return [
        Laboratory("long forearm", "another WAM: a forearm of 0.38 m, other masses", {"arm": LONG_FOREARM}),
        Laboratory("hand", "another WAM: with a hand of 1.2 kg and a stiff wrist", {"arm": HAND}),
        Laboratory(
            "floor mount",
            "on a table of 0.45 m, with a drop of 0.5 s",
            {"arm": floor, "motion": {"start_radius": 0.45, **slower}, "bounds": short},
        ),
        Laboratory(
            "floor mount, folded",
            "on a table of 0.65 m, the hand so near that joint 2 meets its limits in the drop",
            {"arm": folded, "motion": {"start_radius": 0.35}, "bounds": short},
        ),
        Laboratory(
            "wall mount",
            "from a wall, 1 m high, with a drop of 0.5 s",
            {"arm": wall, "motion": {"start_radius": 0.6, **slower}, "bounds": short},
        ),
        Laboratory("Coulomb friction", "all of the joints' Coulomb friction", {"arm": {"coulomb_friction": 1}}),
        Laboratory("motors with a knee", "less torque from 0.4 of the velocity limit on", {"arm": {"knee_speed": 0.4}}),
        Laboratory(
            "encoders and base off",
            "0.3 degrees each, of which the belief knows nothing",
            {
                "arm": {
                    "encoder_offset": [0.005, -0.005, 0.005, -0.005, 0.005, -0.005, 0.005],
                    "base_tilt": [0.005, -0.005],
                }
            },
            believed={},
        ),
        Laboratory(
            "other masses", "10 % lighter, more rotor inertia and friction than believed", {"arm": light}, believed={}
        ),
    ]


def _control() -> list[Laboratory]:
    soft = {"kp": 1500.0, "kd": 100.0}
    scale = math.sqrt(1.62 / 9.81)
    moon = {
        "gravity": 1.62,
        "motion": {"min_move_duration": 0.5, "hold_duration": 4.0},
        "bounds": {"speed": [round(0.21 * scale, 3), round(0.85 * scale, 3)], "wait": [0.0, round(0.5 / scale, 2)]},
    }
    return [
        Laboratory("soft gains", "kp 1500, kd 100", {"controller": soft}),
        Laboratory("stiff gains", "kp 12000, kd 400", {"controller": {"kp": 12000.0, "kd": 400.0}}),
        Laboratory("delay of 1 period", "2 ms", {"controller": {"delay": 1}}),
        Laboratory("delay of 2 periods", "4 ms, the reference's gains", {"controller": {"delay": 2}}),
        Laboratory("delay of 2, soft", "4 ms, kp 1500, kd 100", {"controller": {"delay": 2, **soft}}),
        Laboratory("100 Hz", "the reference's gains", {"controller": {"period": 0.01}}),
        Laboratory("100 Hz, soft", "kp 800, kd 50", {"controller": {"period": 0.01, "kp": 800.0, "kd": 50.0}}),
        Laboratory("250 Hz", "kp 3000, kd 150", {"controller": {"period": 0.004, "kp": 3000.0, "kd": 150.0}}),
        Laboratory("1 kHz", "the reference's gains", {"controller": {"period": 0.001}}),
        Laboratory("moon", "gravity of 1.62 m/s^2", arranged(moon)),
        Laboratory("noise", "what is typical of a real arm", {"noise": dict(_typical_noise())}),
    ]


def _typical_noise() -> Values:
    from wam_cast.scenario import Noise

    return Noise.typical().model_dump()


LABORATORIES = (Laboratory("reference", "", {}), *_strings(), *_balls(), *_cups(), *_arms(), *_control())
"""All of them; `name` is unique."""


def scenarios_of(laboratory: Laboratory) -> tuple[Scenario, Scenario]:
    """Return the robot's scenario and the one that is believed. Raises `.InputError` if one is refused."""
    robot = Scenario.from_dict(laboratory.values)
    return robot, robot if laboratory.believed is None else Scenario.from_dict(laboratory.believed)
