"""MuJoCo's robot against Drake's: the same masses, forces and accelerations at random states of random scenarios."""

import numpy as np
import pytest

from wam_cast.crosscheck.mujoco_flight import Robot
from wam_cast.robot.plant import N_ARM
from wam_cast.robot.station import CastStation
from wam_cast.scenario import Scenario

mujoco = pytest.importorskip("mujoco")


MOUNTS = {
    "ceiling": {},
    "floor": {"arm": {"mount": "floor", "mount_height": 0.2}, "motion": {"start_radius": 0.4}},
    "wall": {"arm": {"mount": "wall", "mount_height": 1.0}, "motion": {"start_radius": 0.6}},
}


def random_scenario(seed):
    """Return a scenario in which all that the dynamics depend on is drawn at random."""
    rng = np.random.default_rng(seed)
    mount = MOUNTS[list(MOUNTS)[seed % 3]]

    def factors():
        return rng.uniform(0.5, 2.0, N_ARM).tolist()

    scales = ("viscous_friction_scale", "mass_scale", "inertia_scale", "rotor_inertia_scale", "torque_scale")
    arm = {name: factors() for name in scales}
    arm |= {"coulomb_friction": rng.uniform(0, 1, N_ARM).tolist(), "base_tilt": rng.uniform(-0.05, 0.05, 2).tolist()}
    string = {"n_links": int(rng.integers(1, 8)), "length": float(rng.uniform(0.4, 0.6))}
    string |= {"mass": float(rng.uniform(0.001, 0.01)), "bending_stiffness": float(rng.choice([0.0, 1e-3]))}
    string |= {name: float(rng.uniform(1e-6, 1e-3)) for name in ("bending_damping", "hook_damping", "knot_damping")}
    ball = {"mass": float(rng.uniform(0.01, 0.1)), "inertia_factor": float(rng.uniform(0.2, 0.66))}
    parts = {
        "arm": {**arm, **mount.get("arm", {})},
        "motion": mount.get("motion", {}),
        "bounds": {"distance": [0.05, 0.2]},
    }
    return Scenario.from_dict({**parts, "string": string, "ball": ball, "gravity": float(rng.uniform(5, 15))})


def random_state(rng, n):
    """Return angles and rates, the arm's slow and fast: Coulomb friction differs."""
    return rng.uniform(-1, 1, n), rng.normal(size=n) * np.where(np.arange(n) < N_ARM, rng.choice([0.05, 1.0]), 5.0)


def mass_matrix(robot):
    """Return MuJoCo's mass matrix, column by column: the function for all of it has other arguments from version to version."""
    n = robot.model.nv
    matrix, column = np.empty((n, n)), np.empty(n)
    for i, unit in enumerate(np.eye(n)):
        mujoco.mj_mulM(robot.model, robot.data, column, unit)
        matrix[i] = column
    return matrix


@pytest.mark.parametrize("seed", range(6))
def test_masses_and_accelerations_are_drakes(seed):
    scenario, rng = random_scenario(seed), np.random.default_rng(seed)
    station, robot = CastStation(scenario, has_scene=False), Robot(scenario, 0.002, has_ball=True)
    context = station.diagram.CreateDefaultContext()
    own, hold = (part.GetMyMutableContextFromRoot(context) for part in (station.plant, station.hold))
    n = station.plant.num_velocities()
    assert robot.model.nv == n
    for _ in range(4):
        (q, v), torque = random_state(rng, n), rng.uniform(-1, 1, N_ARM) * station.plant.GetEffortUpperLimits()
        station.plant.SetPositionsAndVelocities(own, np.concatenate([q, v]))
        hold.SetDiscreteState(torque)
        robot.data.qpos[:], robot.data.qvel[:], robot.data.ctrl[:N_ARM] = q, v, torque
        mujoco.mj_forward(robot.model, robot.data)
        masses = station.plant.CalcMassMatrix(own)
        assert np.abs(mass_matrix(robot) - masses).max() < 1e-12 * np.abs(masses).max()
        acceleration = station.plant.EvalTimeDerivatives(own).CopyToVector()[n:]
        assert np.linalg.norm(robot.data.qacc - acceleration) < 1e-6 * np.linalg.norm(acceleration)


def test_places_are_drakes():
    scenario, rng = random_scenario(0), np.random.default_rng(0)
    station, robot = CastStation(scenario, has_scene=False), Robot(scenario, 0.002, has_ball=True)
    context = station.plant.CreateDefaultContext()
    q, v = random_state(rng, station.plant.num_velocities())
    station.plant.SetPositionsAndVelocities(context, np.concatenate([q, v]))
    robot.set_state(q, v)
    ball, hand = (station.plant.GetBodyByName(name) for name in ("ball", "tool_plate"))
    p_WL, v_WL, p_WE = robot.places
    assert p_WL == pytest.approx(ball.EvalPoseInWorld(context).translation(), abs=1e-12)
    assert v_WL == pytest.approx(ball.EvalSpatialVelocityInWorld(context).translational(), abs=1e-11)
    assert p_WE == pytest.approx(hand.EvalPoseInWorld(context).translation(), abs=1e-12)


def test_the_arms_bearing_changes_nothing():
    robot, rng = Robot(Scenario(), 0.002, has_ball=True), np.random.default_rng(1)
    q, v = random_state(rng, robot.model.nv)
    found = []
    for bearing in (0.0, 1.1):
        robot.set_state(q + bearing * np.eye(robot.model.nv)[0], v)
        mujoco.mj_forward(robot.model, robot.data)
        found.append((mass_matrix(robot), robot.data.qacc.copy()))
    (masses, acceleration), (turned_masses, turned_acceleration) = found
    assert masses == pytest.approx(masses.T, abs=1e-15)
    assert turned_masses == pytest.approx(masses, abs=1e-12)
    assert turned_acceleration == pytest.approx(acceleration, rel=1e-8, abs=1e-6)


@pytest.mark.parametrize("seed", range(3))
def test_the_string_hangs_straight_down(seed):
    scenario = random_scenario(seed)
    robot = Robot(scenario, 0.002, has_ball=True)
    q = robot.hanging(np.random.default_rng(seed).uniform(-1, 1, N_ARM))
    robot.set_state(q, np.zeros(robot.model.nv))
    p_WL, _, p_WE = robot.places
    assert p_WL == pytest.approx(p_WE - [0, 0, scenario.string.length], abs=1e-12)
