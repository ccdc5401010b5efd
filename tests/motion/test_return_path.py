"""The return: a path without a jump, within reach, that takes the ball out of any cup and brings it to rest."""

import numpy as np
import pytest

from wam_cast.cast import Cast
from wam_cast.motion.pendulum import swing_frequency
from wam_cast.motion.return_path import Return
from wam_cast.motion.stages import CastMotion, Stage
from wam_cast.scenario import Arm, Motion, Scenario, String
from wam_cast.simulation.simulator import CastSimulator

SCENARIO = Scenario()
REACHED = [0.264, 0.33, 0.40, 0.41, 0.6, 0.825, 0.827, 0.9, 0.985]
CUPS = [-1.0, 0.0, *REACHED, 3.0]
REACH = 0.87  # of the shipped arm, from its shoulder, with the elbow bent
OMEGA = swing_frequency(SCENARIO)

each_cup = pytest.mark.parametrize("cup", [None, *CUPS])


def sampled(path, step=0.002):
    values = [path.evaluate(t) for t in np.arange(0, path.duration + 0.1, step)]
    return (np.array(column) for column in zip(*values, strict=True))


@each_cup
def test_path_goes_from_the_drop_to_home(cup):
    path = Return(SCENARIO, 0.5, cup)
    (start, at_rest), (end, still) = path.evaluate(0.0), path.evaluate(path.duration - 1e-9)
    np.testing.assert_allclose(start, [0.5, 0.35], atol=1e-12)
    np.testing.assert_allclose(end, [0.2, 0.8], atol=1e-9)
    np.testing.assert_allclose([at_rest, still], 0, atol=1e-6)
    np.testing.assert_array_equal(path.evaluate(path.duration + 1.0), [[0.2, 0.8], [0, 0]])


@each_cup
def test_velocity_is_the_positions_derivative_and_never_jumps(cup):
    place, velocity = sampled(Return(SCENARIO, 0.5, cup))
    by_difference = np.diff(place, axis=0) / 0.002
    np.testing.assert_allclose(by_difference, (velocity[1:] + velocity[:-1]) / 2, atol=2e-4)
    assert np.abs(np.diff(velocity, axis=0) / 0.002).max() < 4.5  # no acceleration that a jump would be


def drop_radius(cup):
    """Return about where the hand is at the end of a cast that reaches a cup [m]."""
    return 0.24 + 0.35 * cup


@pytest.mark.parametrize("cup", REACHED)
def test_hand_stays_within_the_arms_reach(cup):
    place, _ = sampled(Return(SCENARIO, drop_radius(cup), cup))
    # With the string slack it may go a little farther, as it does in the drop.
    assert np.hypot(place[:, 0], place[:, 1] - 1.0).max() < REACH + 0.02


@pytest.mark.parametrize("cup", REACHED)
def test_string_is_slack_until_it_is_drawn_tight_slowly(cup):
    """Wherever the ball lies in the cup, a hand that moves fast does not pull it; then its wall is within the string's reach."""
    motion = SCENARIO.motion
    place, velocity = sampled(Return(SCENARIO, drop_radius(cup), cup))
    fetched, pulled = (round(t / 0.002) for t in (1.0, 1.0 + motion.pull_duration))
    wall = cup + 0.01 if cup < 0.415 else cup - 0.01
    to_wall = np.hypot(place[:, 0] - wall, place[:, 1] - 0.026)
    assert to_wall[:fetched].max() < 0.6 - 0.008
    assert to_wall[pulled] == pytest.approx(0.6 + 0.0095, abs=1e-3)  # it hangs 10 mm above the bottom
    assert np.linalg.norm(velocity[fetched:pulled], axis=1).max() < 0.03


def test_ball_in_a_far_cup_is_pulled_over_the_wall_at_the_arms_full_reach():
    # So far out that the string must slant more than it should: as little as the reach from the shoulder lets it.
    path, motion = Return(SCENARIO, drop_radius(0.985), 0.985), SCENARIO.motion
    climbed = motion.fetch_duration + motion.pull_duration + motion.slide_duration + motion.lift_duration
    radius, height = path.evaluate(climbed)[0]
    assert np.hypot(radius, height - (SCENARIO.arm.mount_height - 0.346)) == pytest.approx(REACH, abs=1e-9)


@pytest.mark.parametrize("cup", [0.3, 0.6, 0.8])
def test_hand_ends_up_above_the_wall_and_lifts_straight(cup):
    path, motion = Return(SCENARIO, 0.5, cup), SCENARIO.motion
    begin = motion.fetch_duration + motion.pull_duration + motion.slide_duration
    wall = cup + 0.01 if cup < 0.415 else cup - 0.01
    lifting = np.array([path.evaluate(begin + share * motion.lift_duration)[0] for share in (0, 0.3, 0.6, 1)])
    np.testing.assert_allclose(lifting[:, 0], wall, atol=1e-12)
    # The ball leaves the wall within the cup, and is clear of the rim before it moves sideways.
    assert lifting[0, 1] - 0.6 == pytest.approx(0.12 - 0.02)
    assert lifting[-1, 1] - 0.6 - SCENARIO.ball.radius > SCENARIO.cup.rim_height + 0.05


# ---------------------------------------------------------------- in simulation


def left_swinging(simulator, cast, cup):
    """Return the amplitude [m] of the ball's swing at the end of the return, and the recording."""
    recording = simulator.record(cast, cup)
    offset = (recording.p_WL - recording.p_WE)[-1, :2]
    return np.linalg.norm([offset, recording.v_WL[-1, :2] / OMEGA]), recording


# Casts that land at 0.29, 0.61 and 0.95 m: lifted on the far side, on the near one, and pulled over the wall.
NEAR, MIDDLE, FAR = Cast(0.1, 0.40, 0.10), Cast(0.3, 0.60, 0.10), Cast(0.3755, 0.6335, 0.3975)


@pytest.mark.slow
@pytest.mark.parametrize(
    ("cast", "restitution"), [(MIDDLE, 0.6), pytest.param(FAR, 0.25, marks=pytest.mark.slow)], ids=["middle", "far"]
)
def test_ball_is_lifted_out_of_its_cup_and_hangs_at_rest(cast, restitution):
    simulator = CastSimulator(Scenario.from_dict({"cup": {"restitution": restitution}}))
    cup = tuple(simulator.simulate(cast).landing)
    swing, recording = left_swinging(simulator, cast, cup)
    assert recording.outcome.is_caught
    assert recording.outcome.return_faults == ()
    assert swing < 2.5e-3
    np.testing.assert_allclose(recording.p_WL[-1], [0.2, 0, 0.2], atol=3e-3)
    # Wherever the ball is above the cup's shadow, it is in the cup or clear of its rim, never through its wall.
    offset = np.hypot(*(recording.p_WL[:, :2] - cup).T)
    inside_wall = (offset > 0.0115) & (offset < 0.053) & (recording.p_WL[:, 2] < 0.10)
    assert not np.any(inside_wall[recording.stages == Stage.RETURN])


@pytest.mark.slow
def test_near_cup_lets_the_ball_go_as_well(simulator):
    cup = tuple(simulator.simulate(NEAR).landing)
    swing, recording = left_swinging(simulator, NEAR, cup)
    assert recording.outcome.is_caught
    assert swing < 1.5e-3


@pytest.mark.slow
def test_missed_ball_is_brought_home_too(simulator):
    cup = tuple(simulator.simulate(MIDDLE).landing + np.array([0.0, 0.09]))
    _, recording = left_swinging(simulator, MIDDLE, cup)
    assert not recording.outcome.is_caught
    assert recording.outcome.return_faults == ()
    assert recording.p_WL[-1, 2] > 0.19


@pytest.mark.slow
def test_limit_met_on_the_way_home_is_told_apart_from_the_casts():
    hasty = CastSimulator(Scenario.from_dict({"motion": {"retreat_duration": 0.3}}))
    cup = tuple(hasty.simulate(MIDDLE).landing)
    recording = hasty.record(MIDDLE, cup)
    assert recording.outcome.is_caught
    assert recording.outcome.limits_hit == ()
    assert any("torque" in fault or "speed" in fault for fault in recording.outcome.return_faults)


@pytest.mark.slow
@pytest.mark.parametrize(("restitution", "first"), [(0.25, 0), (0.6, 1)])  # in turn
def test_swing_that_the_return_leaves_is_small_over_the_whole_reach(restitution, first):
    from wam_cast.learning.reference import reference_model
    from wam_cast.planning.plan import plan_cast

    simulator = CastSimulator(Scenario.from_dict({"cup": {"restitution": restitution}}))
    for radius in np.linspace(0.265, 0.984, 10)[first::2]:
        plan = plan_cast(reference_model(), (radius, 0.0))
        swing, recording = left_swinging(simulator, plan.cast, plan.cup)
        assert recording.outcome.is_caught
        assert recording.outcome.return_faults == ()
        assert swing < 2.5e-3, radius


@pytest.mark.parametrize(
    "values",
    [
        {"string": {"length": 0.1}},
        {"string": {"length": 0.3}},
        {"arm": {"mount_height": 1.8}},
        {"arm": {"mount_height": 1.6}, "motion": {"start_height": 1.1}},
    ],
)
def test_a_cup_that_no_ball_can_be_lifted_out_of_leaves_a_way_home(values):
    parts = {
        "string": String,
        "arm": Arm,
        "motion": Motion,
    }  # a scenario that is read is refused if no ball could rest in a cup
    scenario = Scenario().model_copy(update={name: parts[name](**part) for name, part in values.items()})
    for cup in (0.3, 0.5, 0.7, 0.9, 1.2, 2.0):
        path = Return(scenario, 0.5, cup)
        (radius, height), velocity = path.evaluate(path.duration)
        assert (radius, height) == pytest.approx((scenario.motion.start_radius, scenario.motion.start_height))
        np.testing.assert_array_equal(velocity, 0)
        assert all(np.isfinite(path.evaluate(t)).all() for t in np.linspace(0, path.duration, 50))


def test_motion_knows_the_cup_only_after_the_hold():
    with_cup, without = (CastMotion(SCENARIO, MIDDLE, cup_radius=radius) for radius in (0.6, None))
    for t in np.linspace(0, with_cup.stage_ends[Stage.HOLD], 50):
        np.testing.assert_array_equal(with_cup.evaluate(t), without.evaluate(t))
