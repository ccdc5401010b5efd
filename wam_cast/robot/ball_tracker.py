"""BallTracker: the ball's position and velocity as ports."""

from __future__ import annotations

from pydrake.multibody.plant import MultibodyPlant
from pydrake.systems.framework import BasicVector, Context

from wam_cast.robot.drake_types import evaluate
from wam_cast.robot.python_system import PythonSystem


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
