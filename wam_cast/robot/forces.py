"""The plant in a diagram, with forces that Drake's elements do not have: the arm's Coulomb friction, the string's stiffness.

They act beside the motors' torques, which the motors' limits bound. Drake's own blocks keep Python out of the integrator's steps.
"""

from __future__ import annotations

import numpy as np
from pydrake.geometry import SceneGraph
from pydrake.multibody.plant import MultibodyPlant
from pydrake.systems.framework import DiagramBuilder, OutputPort
from pydrake.systems.primitives import Adder, MatrixGain, Saturation

from wam_cast.arm.arm_chain import FRICTION_SPEED, arm_chain
from wam_cast.robot.drake_types import add_system
from wam_cast.robot.plant import HOOK, N_ARM, fill_plant
from wam_cast.scenario import Scenario
from wam_cast.types import Array


def add_plant(
    builder: DiagramBuilder, scenario: Scenario, *, has_scene: bool, has_ball: bool
) -> tuple[MultibodyPlant, SceneGraph | None]:
    """Add the plant with its forces, and a scene if it is to have geometry; return both."""
    plant = add_system(builder, "plant", MultibodyPlant(time_step=0.0))
    scene_graph = None
    if has_scene:
        scene_graph = add_system(builder, "scene_graph", SceneGraph())
        source = plant.RegisterAsSourceForSceneGraph(scene_graph)
        builder.Connect(plant.get_geometry_pose_output_port(), scene_graph.get_source_pose_port(source))
        builder.Connect(scene_graph.get_query_output_port(), plant.get_geometry_query_input_port())
    fill_plant(plant, scenario, has_ball=has_ball)
    connect_forces(builder, plant, scenario)
    return plant, scene_graph


def connect_forces(builder: DiagramBuilder, plant: MultibodyPlant, scenario: Scenario) -> None:
    """Connect to `plant` those of the forces that `scenario` has."""
    friction = arm_chain(scenario.arm).coulomb_friction
    forces = [_friction_force(builder, plant, friction)] if np.any(friction) else []
    if scenario.string.bending_stiffness > 0 and plant.num_velocities() > N_ARM:
        stiffness = add_system(builder, "bending_stiffness", MatrixGain(bending_gain(plant, scenario)))
        builder.Connect(plant.get_state_output_port(), stiffness.get_input_port())
        forces.append(stiffness.get_output_port())
    if not forces:
        return
    total = add_system(builder, "generalized_force", Adder(len(forces), plant.num_velocities()))
    for i, force in enumerate(forces):
        builder.Connect(force, total.get_input_port(i))
    builder.Connect(total.get_output_port(), plant.get_applied_generalized_force_input_port())


def _friction_force(builder: DiagramBuilder, plant: MultibodyPlant, friction: Array) -> OutputPort:
    n_q, n_v = plant.num_positions(), plant.num_velocities()
    select_v = np.zeros((N_ARM, n_q + n_v))
    select_v[:, n_q : n_q + N_ARM] = np.eye(N_ARM) / FRICTION_SPEED
    onto_arm = np.zeros((n_v, N_ARM))
    onto_arm[:N_ARM] = -np.diag(friction)
    relative_speed = add_system(builder, "relative_speed", MatrixGain(select_v))
    direction = add_system(builder, "direction", Saturation(-np.ones(N_ARM), np.ones(N_ARM)))
    friction_torque = add_system(builder, "friction_torque", MatrixGain(onto_arm))
    builder.Connect(plant.get_state_output_port(), relative_speed.get_input_port())
    builder.Connect(relative_speed.get_output_port(), direction.get_input_port())
    builder.Connect(direction.get_output_port(), friction_torque.get_input_port())
    return friction_torque.get_output_port()


def bending_gain(plant: MultibodyPlant, scenario: Scenario) -> Array:
    """Return K, shape (n_v, n_x): the springs at the joints between links give K x at the plant's state x."""
    string = scenario.string
    first, last = HOOK.stop, HOOK.stop + 2 * (string.n_links - 1)
    gain = np.zeros((plant.num_velocities(), plant.num_multibody_states()))
    joints = np.arange(first, last)
    gain[joints, joints] = -string.bending_stiffness / string.link_length(scenario.ball)
    return gain
