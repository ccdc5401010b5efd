"""The arm in the casting plane, against the mass matrix of the whole chain, mechanics, and Drake."""

import numpy as np
import pytest

import wam_cast as wc
from wam_cast.adaptation.closed_form.hand_path import PlannedPath, SampledPath
from wam_cast.adaptation.closed_form.planar_arm import MOVING, PlanarArm, move_arm
from wam_cast.arm.arm_chain import arm_chain
from wam_cast.arm.posture import base_rotation, frame_origins, mass_matrix, starting_posture
from wam_cast.cast import Cast
from wam_cast.generation.sampling import sample_casts
from wam_cast.motion.stages import CastMotion
from wam_cast.scenario import Scenario
from wam_cast.simulation.simulator import CastSimulator

MOUNTS = {
    "ceiling": Scenario(),
    "floor": Scenario.from_dict(
        {
            "arm": {"mount": "floor", "mount_height": 0.0},
            "motion": {"start_radius": 0.40, "start_height": 0.85},
            "bounds": {"distance": [0.05, 0.33]},
        }
    ),
    "wall": Scenario.from_dict(
        {
            "arm": {"mount": "wall", "mount_height": 1.2},
            "motion": {"start_radius": 0.4, "start_height": 0.85},
            "bounds": {"distance": [0.05, 0.3]},
        }
    ),
}

FRICTIONLESS = {"arm": {"viscous_friction_scale": 0.0}}


@pytest.fixture(params=MOUNTS, name="scenario")
def _scenario(request):
    return MOUNTS[request.param]


def some_joints(scenario, n=4):
    """Return joints 2, 4 and 6 off the starting posture [rad], (3, n), and the bodies' angles."""
    q = np.random.default_rng(5).uniform(-0.4, 0.4, (3, n))
    arm = PlanarArm(scenario)
    return arm, q, arm._turns @ q


def whole_posture(scenario, q):
    posture = starting_posture(scenario)
    posture[list(MOVING)] += q
    return posture


def test_the_hand_is_where_the_whole_chain_has_it(scenario):
    arm, q, phi = some_joints(scenario)
    place, _ = arm.hand(phi, np.zeros_like(phi))
    for column in range(q.shape[1]):
        p_BE = frame_origins(arm_chain(scenario.arm), whole_posture(scenario, q[:, column]))[7]
        p_WE = base_rotation(scenario.arm) @ p_BE + [0.0, 0.0, scenario.arm.mount_height]
        np.testing.assert_allclose([*place[:, column], 0.0], p_WE[[0, 2, 1]], atol=1e-12)


def test_accelerations_from_rest_are_those_of_the_whole_chains_mass_matrix(scenario):
    arm, q, phi = some_joints(scenario)
    command = np.array([[20.0], [-5.0], [1.0]]) * [1.0, 0.5, -1.0, 0.2]
    found = arm.acceleration(phi, np.zeros_like(phi), command + arm.gravity_torque(phi))
    for column in range(q.shape[1]):
        M = mass_matrix(arm_chain(scenario.arm), whole_posture(scenario, q[:, column]))[np.ix_(MOVING, MOVING)]
        qdd = np.linalg.solve(M, command[:, column])
        np.testing.assert_allclose(np.linalg.solve(arm._turns, found[:, column]), qdd, rtol=1e-9)


def test_a_free_arm_keeps_its_energy():
    scenario = Scenario.from_dict(FRICTIONLESS)
    arm, h = PlanarArm(scenario), 2e-4
    chain = arm_chain(scenario.arm)
    phi, rate = np.zeros((3, 1)), np.array([[0.8], [-1.5], [2.5]])

    def energy():
        q, v = np.linalg.solve(arm._turns, phi)[:, 0], np.linalg.solve(arm._turns, rate)[:, 0]
        return 0.5 * v @ mass_matrix(chain, whole_posture(scenario, q))[np.ix_(MOVING, MOVING)] @ v

    start = energy()
    for _ in range(1000):  # gravity is carried, so that what is left is the kinetic energy
        middle = rate + h / 2 * arm.acceleration(phi, rate, arm.gravity_torque(phi))
        there = phi + h / 2 * rate
        phi, rate = phi + h * middle, rate + h * arm.acceleration(there, middle, arm.gravity_torque(there))
    assert np.abs(phi).max() > 0.2
    assert energy() == pytest.approx(start, rel=1e-6)


def test_gravity_takes_twice_the_torque_of_an_arm_twice_as_heavy():
    scenario = Scenario()
    arm, _, phi = some_joints(scenario)
    assert np.abs(arm.gravity_torque(phi)).max() > 1.0
    light = PlanarArm(Scenario.from_dict({"arm": {"mass_scale": 0.5}}))
    np.testing.assert_allclose(light.gravity_torque(phi), 0.5 * arm.gravity_torque(phi))


def test_the_hand_is_drakes_to_a_tenth_of_a_millimetre_and_so_are_the_peaks():
    scenario = Scenario()
    casts = sample_casts(scenario, 2, seed=7)
    motion = move_arm(scenario, casts)
    simulator = CastSimulator(scenario)
    for row, cast in enumerate(casts):
        recording = simulator.record(Cast.from_array(cast))
        times = recording.times[recording.times < motion_end(scenario, cast)]
        place, _, _ = motion.path(times, np.full(len(times), row))
        off = np.abs(place.T - recording.p_WE[: len(times), [0, 2]])
        tracking = np.abs(recording.p_WE_desired - recording.p_WE).max()
        assert off.max() < 2e-4
        assert off.max() < 0.05 * tracking
        outcome = recording.outcome
        assert motion.peak_torque_utilization[row] == pytest.approx(outcome.peak_torque_utilization.max(), abs=0.01)
        assert motion.peak_velocity_utilization[row] == pytest.approx(outcome.peak_velocity_utilization.max(), abs=0.01)
        assert motion.is_within_range[row]


def motion_end(scenario, cast):
    return float(PlannedPath(scenario, cast[np.newaxis]).drop_end[0])


@pytest.mark.slow
def test_a_late_controller_tracks_worse():
    late = Scenario.from_dict({"controller": {"delay": 1}})
    cast = np.array([[0.3, 0.6, 0.1]])
    errors = []
    for scenario in (Scenario(), late):
        path, planned = move_arm(scenario, cast).path, PlannedPath(scenario, cast)
        t = np.linspace(0.0, 0.5, 200)
        rows = np.zeros(200, dtype=int)
        errors.append(np.abs(path(t, rows)[0] - planned(t, rows)[0]).max())
    simulated = [wc.simulate_cast(scenario, Cast(*cast[0])).peak_tracking_error for scenario in (Scenario(), late)]
    assert 0 < errors[1] - errors[0] < 1e-3
    assert simulated[1] > simulated[0]


def test_the_planned_path_is_that_of_the_controller_and_its_derivatives_are_right():
    scenario, casts = Scenario(), sample_casts(Scenario(), 3, seed=1)
    path = PlannedPath(scenario, casts)
    for row, cast in enumerate(casts):
        motion = CastMotion(scenario, Cast.from_array(cast))
        for t in np.linspace(0.0, path.drop_end[row] + 0.1, 37):
            here, rows = np.array([t]), np.array([row])
            place, velocity, acceleration = (values[:, 0] for values in path(here, rows))
            wanted = motion.evaluate(float(t))
            np.testing.assert_allclose(place, wanted[0][[0, 2]], atol=1e-12)
            np.testing.assert_allclose(velocity, wanted[1][[0, 2]], atol=1e-11)
            change = (path(here + 1e-6, rows)[1] - path(here - 1e-6, rows)[1])[:, 0] / 2e-6
            np.testing.assert_allclose(acceleration, change, atol=1e-3)


def test_a_sampled_path_is_the_path_that_was_sampled_and_rests_at_its_end():
    scenario, cast = Scenario(), np.array([[0.3, 0.6, 0.1]])
    planned = PlannedPath(scenario, cast)
    n = 1 + int(np.ceil(planned.drop_end[0] / 0.002))
    rows = np.zeros(n, dtype=int)
    place, velocity, _ = planned(0.002 * np.arange(n), rows)
    sampled = SampledPath(0.002, place.T[..., np.newaxis], velocity.T[..., np.newaxis])
    t = np.linspace(0.0, planned.drop_end[0], 1001)
    rows = np.zeros(1001, dtype=int)
    for found, wanted, atol in zip(sampled(t, rows), planned(t, rows), (1e-6, 1e-4, 0.2), strict=True):
        np.testing.assert_allclose(found, wanted, atol=atol)
    end = sampled(np.array([9.0]), np.array([0]))
    np.testing.assert_allclose(end[0][:, 0], [0.5, 0.35], atol=1e-12)
    assert not end[1].any()
    assert not end[2].any()
