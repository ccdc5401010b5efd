"""Where the ball and the hand are: the ball as ports of a diagram, and both in recorded states of a plant."""

from __future__ import annotations

import numpy as np
from pydrake.multibody.plant import MultibodyPlant
from pydrake.systems.framework import BasicVector, Context

from wam_cast.robot.drake_types import evaluate
from wam_cast.robot.python_system import PythonSystem
from wam_cast.types import Array


class BallTracker(PythonSystem):
    """Picks the ball out of the plant's body poses and velocities: -> position p_WL [m] (3), velocity v_WL [m/s] (3)."""

    def __init__(self, plant: MultibodyPlant) -> None:
        super().__init__()
        self._ball = plant.GetBodyByName("ball").index()
        poses, velocities = (plant.get_body_poses_output_port(), plant.get_body_spatial_velocities_output_port())
        self._poses = self.DeclareAbstractInputPort("body_poses", poses.Allocate())
        self._velocities = self.DeclareAbstractInputPort("body_spatial_velocities", velocities.Allocate())
        self.DeclareVectorOutputPort("position", 3, self._calc_position, {self._poses.ticket()})
        self.DeclareVectorOutputPort("velocity", 3, self._calc_velocity, {self._velocities.ticket()})

    def _calc_position(self, context: Context, output: BasicVector) -> None:
        output.SetFromVector(evaluate(self._poses, context)[self._ball].translation())

    def _calc_velocity(self, context: Context, output: BasicVector) -> None:
        output.SetFromVector(evaluate(self._velocities, context)[self._ball].translational())


class Kinematics:
    """Evaluates a station's `plant` at states other than its simulation's."""

    def __init__(self, plant: MultibodyPlant) -> None:
        self._plant = plant
        self._context = plant.CreateDefaultContext()
        self._ball = plant.GetBodyByName("ball")
        self._hand = plant.GetBodyByName("tool_plate")

    def evaluate(self, states: Array) -> tuple[Array, Array, Array]:
        """Return p_WL [m], v_WL [m/s] and p_WE [m] of `states`, shape (n, n_x); each of shape (n, 3)."""
        result = np.empty((3, len(states), 3))
        for i, state in enumerate(states):
            self._plant.SetPositionsAndVelocities(self._context, state)
            result[0, i] = self._ball.EvalPoseInWorld(self._context).translation()
            result[1, i] = self._ball.EvalSpatialVelocityInWorld(self._context).translational()
            result[2, i] = self._hand.EvalPoseInWorld(self._context).translation()
        return result[0], result[1], result[2]
