"""Robots that are not the reference one: other mounts, cups on stands, delays, offsets, and a belief that is not the truth."""

import os
import re

import numpy as np
import pytest

from wam_cast.arm.arm_model import models_directory
from wam_cast.arm.posture import starting_posture
from wam_cast.cast import Cast
from wam_cast.robot.plant import make_arm_plant
from wam_cast.robot.station import CastStation
from wam_cast.scenario import Scenario
from wam_cast.simulation.outcome import Status
from wam_cast.simulation.simulator import CastSimulator, simulate_cast

CAST = Cast(0.3, 0.6, 0.1)

FLOOR = {"arm": {"mount": "floor", "mount_height": 0.0}, "motion": {"start_radius": 0.35, "start_height": 0.80}}
WALL = {
    "arm": {"mount": "wall", "mount_height": 1.0, "wrist_pitch": 0.6},
    "motion": {"start_radius": 0.54, "start_height": 0.80},
}


def on_table(radius):
    """Return a scenario 0.4 m higher than the reference, its cup on a round table of that radius [m]."""
    return {
        "arm": {"mount_height": 1.746},
        "motion": {"start_height": 1.20},
        "cup": {"rim_height": 0.52, "base_height": 0.40, "base_radius": radius},
    }


def hand_at_start(changes, bearing=0.0):
    """Return p_WE of the arm in its starting posture."""
    scenario = Scenario.from_dict(changes)
    plant = make_arm_plant(scenario)
    context = plant.CreateDefaultContext()
    plant.SetPositions(context, starting_posture(scenario, bearing))
    return plant.GetFrameByName("tool_plate").CalcPoseInWorld(context).translation()


@pytest.mark.parametrize("changes", [{}, FLOOR, WALL], ids=["ceiling", "floor", "wall"])
def test_hand_starts_where_the_motion_says_however_the_arm_is_mounted(changes):
    motion = Scenario.from_dict(changes).motion
    np.testing.assert_allclose(hand_at_start(changes), [motion.start_radius, 0, motion.start_height], atol=1e-12)


@pytest.mark.parametrize("changes", [{}, FLOOR], ids=["ceiling", "floor"])
def test_joint_1_turns_the_hand_by_the_bearing(changes):
    radius = Scenario.from_dict(changes).motion.start_radius
    np.testing.assert_allclose(
        hand_at_start(changes, 0.7)[:2], [radius * np.cos(0.7), radius * np.sin(0.7)], atol=1e-12
    )


@pytest.mark.parametrize("changes", [FLOOR, WALL], ids=["floor", "wall"])
def test_ball_cast_by_an_arm_on_floor_or_wall_is_caught_where_it_lands(changes):
    cast = Cast(0.2, 0.5, 0.1)
    simulator = CastSimulator(Scenario.from_dict(changes))
    free = simulator.simulate(cast)
    assert free.status is Status.LANDED, free.limits_hit
    assert simulator.simulate(cast, tuple(free.landing)).is_caught


@pytest.mark.slow
def test_landing_turns_with_the_bearing_of_an_arm_on_the_floor():
    simulator = CastSimulator(Scenario.from_dict(FLOOR))
    straight, turned = (simulator.simulate(Cast(0.2, 0.5, 0.1, bearing)) for bearing in (0.0, 0.8))
    assert turned.landing_along == pytest.approx(straight.landing_along, abs=5e-4)
    assert np.arctan2(*turned.landing[::-1]) == pytest.approx(0.8, abs=1e-3)


@pytest.mark.slow
def test_everything_a_table_higher_lands_in_the_same_cup_the_same():
    """Arm, hand, cup and floor of a table raised by 0.4 m: nothing that the ball feels is different."""
    on_floor = CastSimulator(Scenario())
    raised = CastSimulator(Scenario.from_dict(on_table(0.3)))
    where = on_floor.simulate(CAST).landing
    np.testing.assert_allclose(raised.simulate(CAST).landing, where, atol=1e-9)
    for off in (0.0, 0.033, 0.10):
        cup = (where[0] + off, where[1])
        one, other = (simulator.simulate(CAST, cup) for simulator in (on_floor, raised))
        assert one.status == other.status


def test_ball_beside_the_cup_lies_on_the_table_and_not_on_the_floor():
    simulator = CastSimulator(Scenario.from_dict(on_table(0.5)))
    where = simulator.simulate(CAST).landing
    recording = simulator.record(CAST, (where[0] + 0.12, where[1]), returns=False)
    assert recording.outcome.status is Status.SHORT
    assert recording.p_WL[-1, 2] == pytest.approx(0.42, abs=0.003)


def test_cup_that_stands_beside_where_it_is_said_to_is_missed_by_that():
    where = CastSimulator(Scenario()).simulate(CAST).landing
    moved = CastSimulator(Scenario.from_dict({"cup": {"offset": [0.004, -0.003]}})).simulate(CAST, tuple(where))
    np.testing.assert_allclose(moved.landing, where, atol=1e-12)
    assert moved.miss == pytest.approx(0.005, abs=1e-9)


@pytest.mark.parametrize("delay", [1, 3])
def test_torque_is_that_of_so_many_periods_before(delay):
    changes = {"controller": {"delay": delay, "kp": 1500.0, "kd": 60.0}}
    recording = CastSimulator(Scenario.from_dict(changes)).record(CAST)
    station = CastStation(Scenario.from_dict(changes), has_scene=False)
    controller = station.controller
    context = controller.CreateDefaultContext()
    controller.set_cast(context, CAST)
    n_q = station.plant.num_positions()
    arm_states = recording.states[:, np.r_[0:7, n_q : n_q + 7]]
    asked = []
    for time, state in zip(recording.times, arm_states, strict=True):
        context.SetTime(time)
        controller.get_input_port().FixValue(context, state)
        asked.append(controller.GetOutputPort("actuation").Eval(context).copy())
    # Sample k of the log is what was held up to it: what was asked at sample k - 1 - delay; before that, what holds the arm.
    np.testing.assert_allclose(recording.torques[1 + delay :], asked[: -1 - delay], atol=1e-9)
    np.testing.assert_allclose(recording.torques[1 : 1 + delay], [asked[0]] * delay, atol=1e-9)


def test_encoders_that_read_too_much_put_the_arm_elsewhere_and_nobody_knows():
    offset = 0.005 * np.array([1, -1, 1, 1, -1, 1, -1])
    station = CastStation(Scenario.from_dict({"arm": {"encoder_offset": offset.tolist()}}), has_scene=False)
    context = station.diagram.CreateDefaultContext()
    station.set_start(context, CAST)
    read = station.controller.get_input_port().Eval(station.controller.GetMyContextFromRoot(context))
    known = starting_posture(Scenario())
    np.testing.assert_allclose(read[:7], known, atol=1e-15)
    q = station.plant.GetPositions(station.plant.GetMyContextFromRoot(context))[:7]
    np.testing.assert_allclose(q, known - offset, atol=1e-15)


def test_tilted_arm_casts_as_one_that_is_turned_about_its_mounting():
    """A tilt about y moves the hand as a rotation does; the string hangs straight all the same."""
    tilt = 0.01
    station = CastStation(Scenario.from_dict({"arm": {"base_tilt": [0.0, tilt]}}), has_scene=False)
    context = station.diagram.CreateDefaultContext()
    plant, plant_context = station.plant, station.plant.GetMyContextFromRoot(context)
    p_WE = plant.GetFrameByName("tool_plate").CalcPoseInWorld(plant_context).translation()
    arm = np.array([0.20, 0.80 - 1.346])
    c, s = np.cos(tilt), np.sin(tilt)
    np.testing.assert_allclose(p_WE[[0, 2]], [c * arm[0] + s * arm[1], 1.346 - s * arm[0] + c * arm[1]], atol=1e-9)
    p_WL = station.diagram.GetOutputPort("ball_position").Eval(context)
    np.testing.assert_allclose(p_WL, p_WE - [0, 0, 0.6], atol=1e-9)


def test_belief_that_is_the_truth_changes_nothing():
    truth = Scenario.from_dict({"ball": {"mass": 0.028}})
    np.testing.assert_array_equal(
        CastSimulator(truth, truth).simulate(CAST).landing, CastSimulator(truth).simulate(CAST).landing
    )


def test_gravity_torque_is_the_believed_arms_and_gains_are_the_robots():
    truth = Scenario.from_dict({"arm": {"mass_scale": 1.1}, "controller": {"kp": 5000.0}})
    station = CastStation(truth, belief=Scenario(), has_scene=False)
    assert station.belief.controller == truth.controller
    assert station.belief.arm == Scenario().arm
    context = station.diagram.CreateDefaultContext()
    asked = station.controller.GetOutputPort("actuation").Eval(station.controller.GetMyContextFromRoot(context))
    believed, real = (make_arm_plant(one) for one in (Scenario(), truth))
    torques = []
    for plant in (believed, real):
        own = plant.CreateDefaultContext()
        plant.SetPositions(own, starting_posture(Scenario()))
        torques.append(-plant.CalcGravityGeneralizedForces(own))
    np.testing.assert_allclose(asked, torques[0], atol=1e-9)
    np.testing.assert_allclose(torques[1], 1.1 * torques[0], atol=1e-9)


def test_wrong_belief_of_the_arms_mass_moves_the_landing_by_millimetres():
    heavy = Scenario.from_dict({"arm": {"mass_scale": 1.05}})
    told, untold = (CastSimulator(heavy, belief).simulate(CAST).landing for belief in (None, Scenario()))
    assert 1e-4 < np.linalg.norm(told - untold) < 5e-3


def test_ball_on_the_moon_swings_slower_and_lands_elsewhere():
    moon = CastSimulator(Scenario(gravity=1.62)).simulate(Cast(0.3, 0.3, 0.4))
    assert moon.status is not Status.DIVERGED
    station = CastStation(Scenario(gravity=1.62), has_scene=False)
    np.testing.assert_array_equal(station.plant.gravity_field().gravity_vector(), [0, 0, -1.62])


def test_a_motor_that_its_speed_weakens_counts_as_a_limit_met():
    # The motors of a heavy arm are cut off by the knee, well below their peak torque.
    changes = {"arm": {"mass_scale": 2.0}}
    strong = CastSimulator(Scenario.from_dict(changes)).simulate(Cast(0.35, 0.8, 0.0))
    weak = CastSimulator(Scenario.from_dict({"arm": changes["arm"] | {"knee_speed": 0.05}}))
    outcome = weak.simulate(Cast(0.35, 0.8, 0.0))
    assert (strong.status, outcome.status) == (Status.LANDED, Status.LIMIT_HIT)
    assert all("torque" in limit for limit in outcome.limits_hit)
    assert np.max(strong.peak_torque_utilization) < 0.9
    assert np.max(outcome.peak_torque_utilization) == pytest.approx(1.0, abs=1e-9)


def test_an_arm_whose_file_changed_is_simulated_as_it_is_now(tmp_path):
    urdf = tmp_path / "arm.urdf"
    text = (models_directory() / "wam7.urdf").read_text().replace("package://", "file:///")
    text = re.sub(r"<visual.*?</visual>", "", text, flags=re.DOTALL)
    urdf.write_text(text)
    scenario = Scenario.from_dict({"arm": {"urdf": str(urdf)}})
    before = simulate_cast(scenario, CAST).landing_along
    heavier = re.sub(r'<mass value="([^"]*)"', lambda found: f'<mass value="{3 * float(found[1])}"', text)
    urdf.write_text(heavier)
    os.utime(urdf, ns=(1, 1))
    after = simulate_cast(scenario, CAST).landing_along
    assert abs(after - before) > 1e-4
    assert after == CastSimulator(scenario).simulate(CAST).landing_along
