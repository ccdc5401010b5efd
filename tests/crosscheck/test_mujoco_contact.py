"""The contact law by hand, and verdicts with it."""

import numpy as np
import pytest

from wam_cast.cast import Cast
from wam_cast.crosscheck.mujoco_contact import CupContact, cast_into_cup
from wam_cast.crosscheck.mujoco_flight import MujocoSimulator
from wam_cast.crosscheck.mujoco_model import compiled, cup_mjcf
from wam_cast.crosscheck.verdict_comparison import compare_verdicts
from wam_cast.robot.plant import STICTION_SPEED, hunt_crossley_dissipation
from wam_cast.scenario import Cup, Scenario
from wam_cast.simulation.outcome import Status

mujoco = pytest.importorskip("mujoco")


SCENARIO = Scenario()
CUP = (0.5, 0.3)
REST = np.zeros(3)


def test_a_ball_beside_all_is_not_touched():
    force, touches, touches_cup = CupContact(SCENARIO, CUP).force(np.array([0.5, 0.3, 0.2]), REST, REST)
    assert not np.any(force)
    assert not touches
    assert not touches_cup


def test_the_bottom_and_the_floor_push_up():
    cup, radius, depth, speed = SCENARIO.cup, SCENARIO.ball.radius, 1e-4, 0.3
    expected = cup.stiffness * depth * (1 + hunt_crossley_dissipation(cup.restitution) * speed)
    for place, height, is_cup in ((CUP, cup.bottom_height, True), ((0.0, 0.0), 0.0, False)):
        p_WL, v_WL = np.array([*place, height + radius - depth]), np.array([0.0, 0.0, -speed])
        force, touches, touches_cup = CupContact(SCENARIO, CUP).force(p_WL, v_WL, REST)
        assert force == pytest.approx([0, 0, expected, 0, 0, 0], abs=1e-9)
        assert touches
        assert touches_cup == is_cup


def test_a_ball_that_leaves_fast_is_not_held():
    p_WL = np.array([0.0, 0.0, SCENARIO.ball.radius - 1e-4])
    force, touches, _ = CupContact(SCENARIO, CUP).force(p_WL, np.array([0.0, 0.0, 5.0]), REST)
    assert touches
    assert not np.any(force)


@pytest.mark.parametrize(("speed", "share"), [(10 * STICTION_SPEED, 1.0), (STICTION_SPEED / 2, 0.5)])
def test_friction_opposes_sliding_and_turns_the_ball(speed, share):
    radius, depth = SCENARIO.ball.radius, 1e-4
    p_WL, v_WL = np.array([0.0, 0.0, radius - depth]), np.array([speed, 0.0, 0.0])
    force, _, _ = CupContact(SCENARIO, CUP).force(p_WL, v_WL, REST)
    friction = share * SCENARIO.cup.friction * SCENARIO.cup.stiffness * depth
    assert force[0] == pytest.approx(-friction)
    assert force[4] == pytest.approx(friction * (radius - depth / 2))  # at the middle of the overlap
    rolling, _, _ = CupContact(SCENARIO, CUP).force(p_WL, v_WL, np.array([0.0, speed / (radius - depth / 2), 0.0]))
    assert rolling[0] == pytest.approx(0, abs=1e-12)


def test_the_wall_faces_the_base_axis_and_pushes_inward():
    radius = SCENARIO.cup.inner_radius - SCENARIO.ball.radius + 1e-4
    outward = np.array([*CUP, 0.0]) / np.hypot(*CUP)
    p_WL = np.array([*CUP, 0.08]) + radius * outward
    force, _, _ = CupContact(SCENARIO, CUP).force(p_WL, REST, REST)
    assert force[:3] == pytest.approx(-2.0 * outward, abs=1e-9)


@pytest.mark.parametrize("restitution", [0.25, 0.6])
def test_an_impact_keeps_its_share_of_the_speed(restitution):
    scenario = Scenario(cup=Cup(restitution=restitution))
    contact, mass, step = CupContact(scenario, CUP), scenario.ball.mass, 5e-6
    height, speed = scenario.ball.radius + 1e-6, -2.0
    while height <= scenario.ball.radius + 2e-6:
        force, _, _ = contact.force(np.array([0, 0, height]), np.array([0, 0, speed]), REST)
        speed += step * force[2] / mass
        height += step * speed
    assert speed == pytest.approx(2 * restitution, rel=0.01)


@pytest.mark.parametrize("restitution", [0.1, 0.25, 0.6])
def test_mujocos_own_contact_keeps_the_same_share(restitution):
    scenario = Scenario(cup=Cup(restitution=restitution), gravity=0.1)
    model = compiled(cup_mjcf(scenario, CUP))
    model.opt.timestep = 2e-5
    data = mujoco.MjData(model)
    data.qpos[:3], data.qvel[2] = [0, 0, scenario.ball.radius + 1e-5], -2.0
    mujoco.mj_step(model, data, 2000)
    assert data.qvel[2] == pytest.approx(2 * restitution, abs=0.02)


@pytest.mark.slow
def test_verdicts_are_drakes():
    (one,) = compare_verdicts(SCENARIO, 1, seed=2, offsets=(0.01,))
    assert one.is_same
    assert one.drake is Status.CAUGHT


def test_a_ball_that_misses_is_told_where():
    simulator, cast = MujocoSimulator(SCENARIO), Cast(0.3, 0.6, 0.1)
    landing = simulator.fly(cast).samples.p_WL[-1, 0]
    status, _ = cast_into_cup(simulator, cast, (landing + 0.15, 0.0))
    assert status is Status.SHORT
