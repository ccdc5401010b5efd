"""Scenario -> MultibodyPlant: the arm from its model file, the string, the ball and the cup from the scenario.

Frames: W world, B arm base (`base`), E hand (`tool_plate`), L ball, C cup (rim's centre, z up). The base of an arm that hangs is
rolled by pi, so that joint 1 turns by `-bearing`.
"""

from __future__ import annotations

import logging
import math
from collections.abc import Iterator
from contextlib import contextmanager

import numpy as np
from pydrake.geometry import AddContactMaterial, Box, Cylinder, ProximityProperties, Sphere
from pydrake.math import RigidTransform, RotationMatrix
from pydrake.multibody.parsing import Parser
from pydrake.multibody.plant import CoulombFriction, MultibodyPlant
from pydrake.multibody.tree import (
    FixedOffsetFrame,
    Frame,
    ModelInstanceIndex,
    RigidBody,
    SpatialInertia,
    UnitInertia,
    UniversalJoint,
)

from wam_cast.arm.arm_model import arm_model
from wam_cast.arm.posture import base_rotation
from wam_cast.cast import default_cup
from wam_cast.motion.string_chain import STRING_RADIUS, hook_angles, string_chain
from wam_cast.robot.cup_mesh import cup_mesh
from wam_cast.robot.drake_types import translation
from wam_cast.scenario import Arm, Ball, Cup, Scenario, String
from wam_cast.types import Array, Position

N_ARM = 7
"""Joints of the arm: the first positions and velocities of every plant that is made here."""

HOOK = slice(N_ARM, N_ARM + 2)
"""The joint between hand and string among those of a plant with a string: its angles in the casting plane and across it."""

IMPACT_SPEED = 2.0
"""At which a cup's restitution is stated [m/s]: about as fast as casts come down."""

STICTION_SPEED = 0.1
"""Sliding speed [m/s] below which contact friction fades; a sharper law would cost the integrator many steps an impact."""

N_CUP_WALLS = 16
"""Boxes that make up the cup's round wall for contact."""

STRING_COLOR = (0.28, 0.24, 0.20, 1.0)
BALL_COLOR = (0.90, 0.33, 0.05, 1.0)
CUP_COLOR = (0.10, 0.42, 0.60, 0.25)
"""Translucent, so that a caught ball can be seen."""
STAND_COLOR = (0.62, 0.56, 0.47, 1.0)
FLOOR_COLOR = (0.80, 0.80, 0.78, 1.0)
FLOOR_RADIUS = 1.5
"""Of the round patch of floor that is drawn [m]; contact knows a larger one."""


def base_pose(arm: Arm, tilt: tuple[float, float] = (0.0, 0.0)) -> RigidTransform:
    """Return X_WB of the mounted arm, turned by a small `tilt` about the world's x and y axes [rad] besides."""
    return translation([0, 0, arm.mount_height], RotationMatrix(base_rotation(arm, tilt)))


def add_arm(plant: MultibodyPlant, scenario: Scenario, tilt: tuple[float, float] = (0.0, 0.0)) -> ModelInstanceIndex:
    """Add the arm, mounted, and set gravity; return its model instance."""
    with _quiet_about_joint_friction():
        (arm,) = Parser(plant).AddModelsFromString(arm_model(scenario.arm).urdf, "urdf")
    plant.WeldFrames(plant.world_frame(), plant.GetFrameByName("base", arm), base_pose(scenario.arm, tilt))
    plant.mutable_gravity_field().set_gravity_vector(np.array([0.0, 0.0, -scenario.gravity]))
    return arm


def add_string(plant: MultibodyPlant, string: String, ball: Ball, parent_frame: Frame) -> Frame:
    """Add the string below `parent_frame`, as long as the `ball` leaves it, and return the frame at its end.

    A universal joint turns about x of its parent first, then about y of its child, and is singular where the second angle
    is a right angle. `parent_frame` has its x axis normal to the casting plane, so that swinging in that plane is the first
    angle, which may turn without limit.
    """
    model = plant.AddModelInstance("string")
    link_length, damping = string.link_length(ball), string_chain(string, ball).damping
    inertia = SpatialInertia(
        string.mass / string.n_links,
        np.array([0, 0, link_length / 2]),
        # A thin rod's, and about its own axis a cord's: without that the joint could be turned by nothing where it is singular.
        UnitInertia(link_length**2 / 3, link_length**2 / 3, STRING_RADIUS**2 / 2),
    )
    for i in range(string.n_links):
        link = plant.AddRigidBody(f"string_link{i}", model, inertia)
        plant.AddJoint(UniversalJoint(f"string_joint{i}", parent_frame, link.body_frame(), damping[i]))
        parent_frame = plant.AddFrame(
            FixedOffsetFrame(f"string_end{i}", link.body_frame(), translation([0, 0, link_length]))
        )
        if plant.geometry_source_is_registered():
            X_LinkGeometry = translation([0, 0, link_length / 2])
            thread = Cylinder(STRING_RADIUS, link_length)
            plant.RegisterVisualGeometry(link, X_LinkGeometry, thread, f"string_link{i}", np.array(STRING_COLOR))
    return parent_frame


def add_ball(
    plant: MultibodyPlant,
    ball: Ball,
    string_end: Frame,
    knot_damping: float,
    contact: ProximityProperties | None = None,
) -> RigidBody:
    """Add the ball, its surface on a universal joint at the string's end; return its body.

    `knot_damping` is the joint's [N m s]. `contact`: proximity properties, or none.
    """
    inertia = UnitInertia.TriaxiallySymmetric(ball.inertia_factor * ball.radius**2)
    body = plant.AddRigidBody("ball", plant.AddModelInstance("ball"), SpatialInertia(ball.mass, np.zeros(3), inertia))
    knot = plant.AddFrame(FixedOffsetFrame("knot", body.body_frame(), translation([0, 0, -ball.radius])))
    plant.AddJoint(UniversalJoint("knot", string_end, knot, knot_damping))
    if plant.geometry_source_is_registered():
        shape = Sphere(ball.radius)
        plant.RegisterVisualGeometry(body, RigidTransform(), shape, "ball", np.array(BALL_COLOR))
        if contact is not None:
            plant.RegisterCollisionGeometry(body, RigidTransform(), shape, "ball", contact)
    return body


def hunt_crossley_dissipation(restitution: float) -> float:
    """Return the dissipation d [s/m] of the law f = k x (1 + d x') with which an impact at 2 m/s keeps `restitution` of its speed.

    Along the motion v dv/dx = -(k / m) x (1 + d v), which integrates to a - ln(1 + a) = -b - ln(1 - b) for d times the speed
    before (a) and after (b): Hunt and Crossley, Coefficient of Restitution Interpreted as Damping in Vibroimpact, 1975.
    """
    from scipy.optimize import brentq  # takes a quarter of a second, which a cast without a cup does without

    def mismatch(a: float) -> float:
        b = restitution * a
        return a - math.log1p(a) + b + math.log1p(-b)

    # At 0 the mismatch has a double zero of its own, and b = 1 takes an infinite a.
    return float(brentq(mismatch, 1e-6, (1 - 1e-12) / restitution)) / IMPACT_SPEED


def contact_material(cup: Cup) -> ProximityProperties:
    """Return the proximity properties that ball, cup and floor share."""
    properties = ProximityProperties()
    AddContactMaterial(
        dissipation=hunt_crossley_dissipation(cup.restitution),  # Drake takes the mean of two equally stiff bodies
        point_stiffness=2 * cup.stiffness,  # two equal bodies in contact act as springs in series
        friction=CoulombFriction(cup.friction, cup.friction),
        properties=properties,
    )
    return properties


def add_cup(plant: MultibodyPlant, cup: Cup, position: Position = (0.0, 0.0)) -> None:
    """Add the cup, a hollow cylinder with an open top, its stand, and the floor; the cup's frame C is at the rim's centre.

    Its wall is a ring of boxes for contact, whose inner faces touch the inner radius. Where the cup stands is the pose of
    the frame `cup_mount`, a parameter of the plant's context, in which its axis is at world (x, y) `position` [m] by default.
    """
    model = plant.AddModelInstance("cup")
    # The cup stands still, so its inertia matters to nothing but the plant's checks.
    body = plant.AddRigidBody("cup", model, SpatialInertia.SolidSphereWithMass(0.1, cup.outer_radius))
    X_WC = translation([*position, cup.rim_height])
    mount = plant.AddFrame(FixedOffsetFrame("cup_mount", plant.world_frame(), X_WC, model))
    plant.WeldFrames(mount, body.body_frame())
    material = contact_material(cup)
    width = 2 * cup.outer_radius * np.tan(np.pi / N_CUP_WALLS)
    wall = Box(cup.wall_thickness, width, cup.height)
    for i in range(N_CUP_WALLS):
        R_CWall = RotationMatrix.MakeZRotation(2 * np.pi * i / N_CUP_WALLS)
        p_CWall = R_CWall @ np.array([cup.inner_radius + cup.wall_thickness / 2, 0, -cup.height / 2])
        X_CWall = RigidTransform(R_CWall, p_CWall)
        plant.RegisterCollisionGeometry(body, X_CWall, wall, f"cup_wall{i}", material)
    bottom = Cylinder(cup.outer_radius, cup.bottom_thickness)
    X_CBottom = translation([0, 0, cup.bottom_thickness / 2 - cup.height])
    plant.RegisterCollisionGeometry(body, X_CBottom, bottom, "cup_bottom", material)
    plant.RegisterVisualGeometry(body, RigidTransform(), cup_mesh(cup), "cup", np.array(CUP_COLOR))
    if cup.base_height > 0:
        plant.RegisterCollisionGeometry(body, *_stand(cup), "stand", material)
        add_stand_visual(plant, body, cup)
    slab = Box(6, 6, 0.2)
    X_WSlab = translation([0, 0, -0.1])
    plant.RegisterCollisionGeometry(plant.world_body(), X_WSlab, slab, "floor", material)
    patch = Cylinder(FLOOR_RADIUS, 0.02)
    X_WPatch = translation([0, 0, -0.01])
    plant.RegisterVisualGeometry(plant.world_body(), X_WPatch, patch, "floor", np.array(FLOOR_COLOR))


def _stand(cup: Cup) -> tuple[RigidTransform, Cylinder]:
    """Return X_CStand and the shape of the cup's stand."""
    return translation([0, 0, cup.base_height / 2 - cup.rim_height]), Cylinder(cup.base_radius, cup.base_height)


def add_stand_visual(plant: MultibodyPlant, cup_body: RigidBody, cup: Cup) -> None:
    """Show what the cup stands on, if it is not the floor."""
    if cup.base_height > 0:
        plant.RegisterVisualGeometry(cup_body, *_stand(cup), "stand", np.array(STAND_COLOR))


def add_hook(plant: MultibodyPlant) -> Frame:
    """Add and return the frame on the tool plate from which the string hangs: x normal to the casting plane, z out of the plate."""
    X_EHook = RigidTransform(RotationMatrix.MakeZRotation(np.pi / 2))
    return plant.AddFrame(FixedOffsetFrame("hook", plant.GetFrameByName("tool_plate"), X_EHook))


def fill_plant(
    plant: MultibodyPlant, scenario: Scenario, *, has_ball: bool = True, cup: Position | None = None
) -> None:
    """Add arm, string and ball to an empty plant, the cup and the floor if it has geometry, and finalize it.

    Without `has_ball` the arm carries neither string nor ball. `cup` is the world (x, y) of the cup's axis [m], by default that of
    `.default_cup`.
    """
    has_geometry = plant.geometry_source_is_registered()
    add_arm(plant, scenario, scenario.arm.base_tilt)
    string, ball = scenario.string, scenario.ball
    if has_ball:
        string_end = add_string(plant, string, ball, add_hook(plant))
        add_ball(plant, ball, string_end, string.knot_damping, contact_material(scenario.cup) if has_geometry else None)
    if has_geometry:
        add_cup(plant, scenario.cup, cup or default_cup(scenario))
    plant.Finalize()
    plant.set_stiction_tolerance(STICTION_SPEED)


def make_arm_plant(scenario: Scenario) -> MultibodyPlant:
    """Return a finalized plant of the arm alone, as upright as it is said to be: the controller's own model of it."""
    plant = MultibodyPlant(time_step=0.0)
    add_arm(plant, scenario)
    plant.Finalize()
    return plant


def joint_damping(plant: MultibodyPlant) -> Array:
    """Return the viscous damping of every velocity [N m s], shape (n_v,)."""
    damping = np.zeros(plant.num_velocities())
    for index in plant.GetJointIndices():
        joint = plant.get_joint(index)
        start = joint.velocity_start()
        damping[start : start + joint.num_velocities()] = joint.default_damping_vector()
    return damping


def hanging_positions(plant: MultibodyPlant, q_arm: Array) -> Array:
    """Return all positions of a plant from `fill_plant`, the arm at `q_arm` and the string, if any, hanging straight down."""
    if plant.num_positions() == N_ARM:
        return q_arm.copy()
    context = plant.CreateDefaultContext()
    q = np.zeros(plant.num_positions())
    q[:N_ARM] = q_arm
    plant.SetPositions(context, q)
    q[HOOK] = hook_angles(plant.GetFrameByName("hook").CalcPoseInWorld(context).rotation().matrix())
    return q


@contextmanager
def _quiet_about_joint_friction() -> Iterator[None]:
    """Drop Drake's warning that it ignores the joints' friction: the station adds it itself."""
    logger = logging.getLogger("drake")

    def keep(record: logging.LogRecord) -> bool:
        return "friction" not in record.getMessage()

    logger.addFilter(keep)
    try:
        yield
    finally:
        logger.removeFilter(keep)
