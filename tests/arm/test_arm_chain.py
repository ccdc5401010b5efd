"""The arm's numbers, without Drake, are those that Drake makes of its URDF."""

import os

import numpy as np
import pytest

from wam_cast.arm.arm_chain import arm_chain
from wam_cast.arm.arm_model import models_directory
from wam_cast.arm.posture import frame_origins, hand_rotation, mass_matrix
from wam_cast.robot.plant import make_arm_plant
from wam_cast.scenario import Scenario

ARMS = (
    {},
    {"mass_scale": [1, 1.1, 0.9, 1.2, 1, 0.8, 1.3], "inertia_scale": 1.5, "rotor_inertia_scale": 0.5},
    {"mount": "floor", "mount_height": 0.0, "torque_scale": 1.2, "viscous_friction_scale": 3.0},
)


@pytest.mark.parametrize("values", ARMS)
@pytest.mark.parametrize("seed", range(3))
def test_inertia_and_places_are_drakes(values, seed):
    scenario = Scenario.from_dict({"arm": values})
    chain, plant = arm_chain(scenario.arm), make_arm_plant(scenario)
    context, q = plant.CreateDefaultContext(), np.random.default_rng(seed).normal(size=7)
    plant.SetPositions(context, q)
    np.testing.assert_allclose(mass_matrix(chain, q), plant.CalcMassMatrix(context), rtol=0, atol=1e-13)
    base, hand = plant.GetFrameByName("base"), plant.GetFrameByName("tool_plate")
    X_BE = plant.CalcRelativeTransform(context, base, hand)
    np.testing.assert_allclose(frame_origins(chain, q)[-1], X_BE.translation(), rtol=0, atol=1e-15)
    np.testing.assert_allclose(hand_rotation(chain, q), X_BE.rotation().matrix(), rtol=0, atol=1e-15)
    np.testing.assert_array_equal(chain.torque_limits, plant.GetEffortUpperLimits())
    np.testing.assert_array_equal(chain.velocity_limits, plant.GetVelocityUpperLimits())


def test_a_file_that_has_changed_is_read_anew(tmp_path):
    path = tmp_path / "arm.urdf"
    text = (models_directory() / "wam7.urdf").read_text().replace("meshes/", f"{models_directory()}/meshes/")
    path.write_text(text)
    arm = Scenario.from_dict({"arm": {"urdf": str(path)}}).arm
    before = arm_chain(arm).mass[0]
    assert before == 10.76768767
    path.write_text(text.replace(f'"{before}"', '"12.5"'))
    os.utime(path, ns=(0, 0))
    assert arm_chain(arm).mass[0] == 12.5
