"""Kinematics: where ball and hand are in recorded states of a plant."""

from __future__ import annotations

import numpy as np
from pydrake.multibody.plant import MultibodyPlant

from wam_cast.types import Array


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
