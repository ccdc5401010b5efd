"""Accelerations, ball and hand of the batched engine are those of Drake's plant, in random states of random scenarios."""

import jax
import numpy as np
import pytest

from wam_cast.batch.dynamics import accelerations, ball_motion
from wam_cast.batch.numbers import numbers, stacked
from wam_cast.cast import Cast
from wam_cast.robot.station import CastStation
from wam_cast.scenario import Scenario

pytestmark = pytest.mark.slow

ROBOTS = (
    {},
    {"arm": {"coulomb_friction": 1.0, "viscous_friction_scale": 2.0, "base_tilt": [0.02, -0.03]}},
    {"arm": {"mass_scale": [1, 1.1, 0.9, 1.2, 1, 0.8, 1.3], "inertia_scale": 1.5, "rotor_inertia_scale": 0.5}},
    {
        "string": {"bending_stiffness": 1e-3, "hook_damping": 1e-3, "mass": 0.02},
        "ball": {"inertia_factor": 0.6, "radius": 0.025},
    },
    {"arm": {"mount": "floor", "mount_height": 0.0}, "gravity": 1.62},
    {"arm": {"mount": "wall", "mount_height": 1.0}, "motion": {"start_radius": 0.5}},
)


def test_they_equal_drakes():
    scenarios = [Scenario.from_dict(robot | {"string": {"n_links": 3} | robot.get("string", {})}) for robot in ROBOTS]
    rng, n = np.random.default_rng(0), len(scenarios)
    q, v = rng.normal(size=(15, n)), 2 * rng.normal(size=(15, n))
    torque = 0.3 * rng.normal(size=(7, n))
    cast = Cast(0.3, 0.6, 0.1)
    values = stacked([numbers(scenario, cast) for scenario in scenarios])
    with jax.enable_x64(True):
        found = np.asarray(jax.jit(accelerations)(values, q, v, torque))
        p_WL, v_WL, p_WE = (np.array(one) for one in jax.jit(ball_motion)(values, q, v))
    for i, scenario in enumerate(scenarios):
        station = CastStation(scenario, has_scene=False)
        root, plant = station.diagram.CreateDefaultContext(), station.plant
        context = plant.GetMyMutableContextFromRoot(root)
        plant.SetPositionsAndVelocities(context, np.r_[q[:, i], v[:, i]])
        station.hold.GetMyMutableContextFromRoot(root).SetDiscreteState(torque[:, i])
        expected = plant.EvalTimeDerivatives(context).CopyToVector()[15:]
        np.testing.assert_allclose(found[:, i], expected, rtol=0, atol=1e-10 * np.abs(expected).max())
        ball, hand = plant.GetBodyByName("ball"), plant.GetBodyByName("tool_plate")
        np.testing.assert_allclose(p_WL[:, i], ball.EvalPoseInWorld(context).translation(), rtol=0, atol=1e-14)
        np.testing.assert_allclose(v_WL[:, i], ball.EvalSpatialVelocityInWorld(context).translational(), atol=1e-13)
        np.testing.assert_allclose(p_WE[:, i], hand.EvalPoseInWorld(context).translation(), rtol=0, atol=1e-14)
